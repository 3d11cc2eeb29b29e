"""OME-TIFF files, written by tifffile and OpenImageIO."""

import numpy as np
import OpenImageIO
import pytest
import tifffile

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import format_of, open_source
from volprep_formats.source import SourceSpec, StackLayout

pytestmark = pytest.mark.usefixtures("kept_workers")

SIZES = {"T": 2, "C": 3, "Z": 4, "Y": 7, "X": 5}
NAMES = ("DAPI", "GFP", "2")
LENGTHS = {
    "PhysicalSizeX": 0.25,
    "PhysicalSizeXUnit": "µm",
    "PhysicalSizeY": 0.5,
    "PhysicalSizeZ": 2,
    "PhysicalSizeZUnit": "nm",
}
PIXELS = 'DimensionOrder="XYZCT" Type="uint16" SizeX="5" SizeY="7" SizeC="1" SizeT="1"'
ROOT = 'OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"'
LAYOUTS = [
    {"compression": "zlib"},
    {"compression": "zlib", "predictor": True, "tile": (16, 16)},
    {"bigtiff": True},
    {"byteorder": ">"},
    {"rowsperstrip": 2},
]


def noise(axes: str, dtype: str = "uint16") -> np.ndarray:
    values = np.random.default_rng(5).integers(0, 250, [SIZES[axis] for axis in axes])
    return values.astype(dtype)


def write(path, axes="TCZYX", dtype="uint16", **told):
    values = noise(axes, dtype)
    metadata = {"axes": axes, **LENGTHS}
    if "C" in axes:
        metadata["Channel"] = {"Name": list(NAMES)}
    tifffile.imwrite(path, values, metadata=metadata, ome=True, **told)
    return values


def read(path, **spec):
    with open_source(SourceSpec(path=str(path), **spec), path.parent, Silent()) as source:
        info, depth = source.info, source.info.grid.shape_zyx[0]
        assert info.format == "ome-tiff"
        halves = [source.read_slab(0, depth // 2), source.read_slab(depth // 2, depth)]
        whole = np.concatenate(halves)
        assert (whole.dtype, whole.shape) == (np.dtype(info.stored_type), info.grid.shape_zyx)
        return info, whole


def refusal(path, **spec) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        read(path, **spec)
    return error.value


def rewrite(path, old: str, new: str) -> None:
    """Change the OME-XML in place, at the same length."""
    data = path.read_bytes()
    assert data.count(old.encode()) == 1
    assert len(old.encode()) >= len(new.encode())
    # Spaces between attributes mean nothing.
    path.write_bytes(data.replace(old.encode(), new.encode().ljust(len(old.encode()))))


@pytest.mark.parametrize("axes", ["TCZYX", "TZCYX", "CTZYX", "CZTYX", "ZTCYX", "ZCTYX"])
def test_one_channel_and_time_point_is_read_whatever_the_order_of_the_axes(tmp_path, axes) -> None:
    values = np.moveaxis(write(tmp_path / "a.ome.tif", axes), [axes.index(a) for a in "TCZ"], [0, 1, 2])
    for channel, time in ((0, 0), (2, 1)):
        info, voxels = read(tmp_path / "a.ome.tif", channel=channel + 1, volume=time + 1)
        assert np.array_equal(voxels, values[time, channel])
        assert info.stored_type == "uint16"
        assert np.allclose(info.grid.spacing_mm_zyx, (2e-6, 0.5e-3, 0.25e-3), rtol=1e-12)


@pytest.mark.parametrize(("wanted", "index"), [("DAPI", 0), ("GFP", 1), ("2", 2), (2, 1), ("3", 2)])
def test_a_channel_is_chosen_by_name_or_else_by_number(tmp_path, wanted, index) -> None:
    values = write(tmp_path / "a.ome.tif", "CZYX")
    assert np.array_equal(read(tmp_path / "a.ome.tif", channel=wanted)[1], values[index])


def test_several_channels_without_a_choice_are_refused_with_their_names(tmp_path) -> None:
    write(tmp_path / "a.ome.tif", "CZYX")
    error = refusal(tmp_path / "a.ome.tif")
    assert error.code == "VP1221"
    assert "holds 3 channels" in str(error)
    assert "1: 'DAPI'\n  2: 'GFP'\n  3: '2'" in str(error)


def test_a_name_that_two_channels_have_is_refused(tmp_path) -> None:
    told = {"axes": "CZYX", "Channel": {"Name": ["GFP", "GFP", "3"]}}
    tifffile.imwrite(tmp_path / "a.ome.tif", noise("CZYX"), ome=True, metadata=told)
    assert refusal(tmp_path / "a.ome.tif", channel="GFP").code == "VP1222"
    assert np.array_equal(read(tmp_path / "a.ome.tif", channel="2")[1], noise("CZYX")[1])


@pytest.mark.parametrize("wanted", ["RFP", 4, "0", "-1", ""])
def test_a_channel_that_is_not_there_is_refused_with_those_that_are(tmp_path, wanted) -> None:
    write(tmp_path / "a.ome.tif", "CZYX")
    error = refusal(tmp_path / "a.ome.tif", channel=wanted)
    assert (error.code, "'GFP'" in str(error)) == ("VP1222", True)


def test_several_time_points_without_a_choice_are_refused(tmp_path) -> None:
    write(tmp_path / "a.ome.tif", "TZYX")
    error = refusal(tmp_path / "a.ome.tif")
    assert (error.code, error.fields["key"], error.fields["count"]) == ("VP1221", "volume", 2)
    assert refusal(tmp_path / "a.ome.tif", volume=3).code == "VP1222"


@pytest.mark.parametrize(
    ("dtype", "stored"),
    [
        ("uint8", "uint8"),
        ("int8", "int16"),
        ("uint16", "uint16"),
        ("int16", "int16"),
        ("uint32", "uint8"),
        ("int32", "uint8"),
        ("float32", "float32"),
        ("float64", "float32"),
    ],
)
def test_every_type_becomes_the_smallest_that_holds_it(tmp_path, dtype, stored) -> None:
    if dtype == "int8":
        tifffile.imwrite(tmp_path / "a.ome.tif", noise("ZYX").astype("int8"), ome=True, metadata={"axes": "ZYX"})
        info, voxels = read(tmp_path / "a.ome.tif")
        assert np.array_equal(voxels, noise("ZYX").astype("int8"))
    else:
        values = write(tmp_path / "a.ome.tif", "ZYX", dtype)
        info, voxels = read(tmp_path / "a.ome.tif")
        assert np.array_equal(voxels, values)
    assert info.stored_type == stored


@pytest.mark.parametrize("told", LAYOUTS, ids=str)
def test_every_layout_of_the_file_gives_the_same_voxels(tmp_path, told) -> None:
    values = write(tmp_path / "a.ome.tif", "CZYX", **told)
    assert np.array_equal(read(tmp_path / "a.ome.tif", channel="GFP")[1], values[1])


def test_lzw_is_unpacked(tmp_path) -> None:
    write(tmp_path / "plain.ome.tif", "ZYX")
    text = tifffile.tiffcomment(tmp_path / "plain.ome.tif")
    file = str(tmp_path / "a.ome.tif")
    output = OpenImageIO.ImageOutput.create(file)
    for z, page in enumerate(noise("ZYX")):
        spec = OpenImageIO.ImageSpec(SIZES["X"], SIZES["Y"], 1, "uint16")
        spec.attribute("compression", "lzw")
        if z == 0:
            spec.attribute("ImageDescription", text)
        assert output.open(file, spec, "AppendSubimage" if z else "Create")
        assert output.write_image(page[..., None])
    output.close()
    with tifffile.TiffFile(file) as written:
        assert written.pages[0].compression.name == "LZW"
    assert np.array_equal(read(tmp_path / "a.ome.tif")[1], noise("ZYX"))


def test_samples_of_a_pixel_are_channels(tmp_path) -> None:
    values = np.random.default_rng(1).integers(0, 250, (3, 20, 24, 3), np.uint8)
    tifffile.imwrite(tmp_path / "a.ome.tif", values, photometric="rgb", ome=True, metadata={"axes": "ZYXS"})
    assert "'green'" in str(refusal(tmp_path / "a.ome.tif"))
    assert np.array_equal(read(tmp_path / "a.ome.tif", channel="green")[1], values[..., 1])
    assert np.array_equal(read(tmp_path / "a.ome.tif", channel=3)[1], values[..., 2])


def test_of_a_pyramid_the_finest_is_read(tmp_path) -> None:
    values = np.random.default_rng(1).integers(0, 250, (3, 64, 48), np.uint16)
    with tifffile.TiffWriter(tmp_path / "a.ome.tif", ome=True) as output:
        output.write(values, subifds=1, tile=(32, 32), metadata={"axes": "ZYX"})
        output.write(values[:, ::2, ::2], subfiletype=1, tile=(32, 32))
    assert np.array_equal(read(tmp_path / "a.ome.tif")[1], values)


def test_of_several_images_one_is_chosen_by_name_or_number(tmp_path) -> None:
    with tifffile.TiffWriter(tmp_path / "a.ome.tif", ome=True) as output:
        output.write(noise("ZYX"), metadata={"axes": "ZYX", "Name": "whole"})
        output.write(noise("YX"), metadata={"axes": "YX", "Name": "label"})
    error = refusal(tmp_path / "a.ome.tif")
    assert (error.code, error.fields["key"]) == ("VP1221", "series")
    assert np.array_equal(read(tmp_path / "a.ome.tif", series="whole")[1], noise("ZYX"))
    assert np.array_equal(read(tmp_path / "a.ome.tif", series="2")[1], noise("YX")[None])


def several_files(folder, names):
    """Write the slices of one volume in a file each; return them."""
    values = noise("ZYX")
    data = "".join(
        f'<TiffData FirstZ="{z}" IFD="0" PlaneCount="1"><UUID FileName="{name}">urn:uuid:{z}</UUID></TiffData>'
        for z, name in enumerate(names)
    )
    for z, name in enumerate(names):
        text = f'<{ROOT} UUID="urn:uuid:{z}"><Image Name="i"><Pixels {PIXELS} SizeZ="4">{data}</Pixels></Image></OME>'
        tifffile.imwrite(folder / name, values[z], description=text, metadata=None)
    return values


def test_slices_in_several_files_are_put_together(tmp_path) -> None:
    values = several_files(tmp_path, [f"z{z}.ome.tif" for z in range(4)])
    assert np.array_equal(read(tmp_path / "z2.ome.tif")[1], values)
    (tmp_path / "z3.ome.tif").unlink()
    assert "z3.ome.tif, which is missing" in str(refusal(tmp_path / "z0.ome.tif"))


@pytest.mark.parametrize("name", ["../secret.tif", "/etc/passwd", "..", "a/b.tif", "a\\b.tif", ""])
def test_a_name_that_leads_out_of_the_folder_is_refused(tmp_path, name) -> None:
    (tmp_path / "in").mkdir()
    tifffile.imwrite(tmp_path / "secret.tif", noise("YX"))
    data = f'<TiffData IFD="0"><UUID FileName="{name}">urn:uuid:9</UUID></TiffData>'
    text = f'<{ROOT}><Image><Pixels {PIXELS} SizeZ="1">{data}</Pixels></Image></OME>'
    tifffile.imwrite(tmp_path / "in" / "a.tif", noise("YX"), description=text, metadata=None)
    assert refusal(tmp_path / "in" / "a.tif").code == "VP1226"


@pytest.mark.parametrize("uuid", ['UUID="urn:uuid:1"', ""])
def test_a_file_that_was_renamed_is_read(tmp_path, uuid) -> None:
    data = '<TiffData IFD="0"><UUID FileName="old.tif">urn:uuid:1</UUID></TiffData>'
    text = f'<{ROOT} {uuid}><Image><Pixels {PIXELS} SizeZ="1">{data}</Pixels></Image></OME>'
    tifffile.imwrite(tmp_path / "new.tif", noise("YX"), description=text, metadata=None)
    assert np.array_equal(read(tmp_path / "new.tif")[1][0], noise("YX"))


def test_without_lengths_a_millimetre_is_taken_and_said(tmp_path) -> None:
    tifffile.imwrite(tmp_path / "a.ome.tif", noise("ZYX"), ome=True, metadata={"axes": "ZYX"})
    info, _ = read(tmp_path / "a.ome.tif")
    assert info.grid.spacing_mm_zyx == (1.0, 1.0, 1.0)
    assert "1 mm is assumed" in info.remarks[0]


def test_a_missing_length_beside_others_is_refused_unless_there_is_one_slice(tmp_path) -> None:
    lengths = {"PhysicalSizeX": 0.25, "PhysicalSizeY": 0.5}
    tifffile.imwrite(tmp_path / "a.ome.tif", noise("ZYX"), ome=True, metadata={"axes": "ZYX", **lengths})
    error = refusal(tmp_path / "a.ome.tif")
    assert (error.code, error.fields["axis"]) == ("VP1227", "Z")
    tifffile.imwrite(tmp_path / "b.ome.tif", noise("YX"), ome=True, metadata={"axes": "YX", **lengths})
    info = read(tmp_path / "b.ome.tif")[0]
    assert info.grid.spacing_mm_zyx == (0.25e-3, 0.5e-3, 0.25e-3)
    assert "no distance along Z" in info.remarks[0]


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ('PhysicalSizeX="0.25"', 'PhysicalSizeX="-1"', "VP1227"),
        ('PhysicalSizeX="0.25"', 'PhysicalSizeX="inf"', "VP1227"),
        ('PhysicalSizeX="0.25"', 'PhysicalSizeX="two"', "VP1227"),
        ('PhysicalSizeXUnit="µm"', 'PhysicalSizeXUnit="px"', "VP1224"),
        ('SizeZ="4"', 'SizeZ="5"', "VP1220"),
        ('SizeZ="4"', 'SizeZ="-"', "VP1220"),
        ('SizeZ="4"', 'SizeZ="0"', "VP1220"),
        ('SizeY="7"', 'SizeY="8"', "VP1220"),
        ('Type="uint16"', 'Type="int16"', "VP1220"),
        ('Type="uint16"', 'Type="bit"', "VP1224"),
        ('PlaneCount="4"', 'PlaneCount="9"', "VP1220"),
        ('PlaneCount="4"', 'PlaneCount="3"', "VP1220"),
        ('DimensionOrder="XY', 'DimensionOrder="YX', "VP1220"),
        ("</Pixels>", "</pixels>", "VP1220"),
        ('<Channel ID="Channel:0:0" SamplesPerPixel="1">', '<Channel SamplesPerPixel="2">', "VP1220"),
    ],
)
def test_what_contradicts_itself_is_refused(tmp_path, old, new, code) -> None:
    write(tmp_path / "a.ome.tif", "ZYX")
    rewrite(tmp_path / "a.ome.tif", old, new)
    assert refusal(tmp_path / "a.ome.tif").code == code


def test_pages_without_a_count_are_one_each_in_any_order(tmp_path) -> None:
    values = noise("ZYX")
    data = "".join(f'<TiffData FirstZ="{3 - page}" IFD="{page}"/>' for page in range(4))
    text = f"<{ROOT}><Image><Pixels {PIXELS} SizeZ='4'>{data}</Pixels></Image></OME>"
    tifffile.imwrite(tmp_path / "a.tif", values[::-1], photometric="minisblack", description=text, metadata=None)
    assert np.array_equal(read(tmp_path / "a.tif")[1], values)


def test_a_plane_in_two_places_is_refused(tmp_path) -> None:
    data = '<TiffData IFD="0" PlaneCount="1"/><TiffData IFD="1" PlaneCount="1"/>'
    text = f"<{ROOT}><Image><Pixels {PIXELS} SizeZ='1'>{data}</Pixels></Image></OME>"
    tifffile.imwrite(tmp_path / "a.tif", noise("ZYX")[:2], description=text, metadata=None)
    assert "in two places" in str(refusal(tmp_path / "a.tif"))


def test_a_page_that_is_not_there_is_refused(tmp_path) -> None:
    text = f'<{ROOT}><Image><Pixels {PIXELS} SizeZ="2"><TiffData IFD="0" PlaneCount="2"/></Pixels></Image></OME>'
    tifffile.imwrite(tmp_path / "a.tif", noise("YX"), description=text, metadata=None)
    assert "no page 1" in str(refusal(tmp_path / "a.tif"))


@pytest.mark.parametrize("sizes", ["SizeZ='2147483647' SizeC='1' SizeT='1'", "SizeZ='1' SizeC='1000000' SizeT='2000'"])
def test_huge_sizes_are_refused_before_anything_of_that_size_is_made(tmp_path, sizes) -> None:
    text = f"<{ROOT}><Image><Pixels DimensionOrder='XYZCT' Type='uint16' SizeX='5' SizeY='7' {sizes}/></Image></OME>"
    tifffile.imwrite(tmp_path / "a.tif", noise("YX"), description=text, metadata=None)
    assert refusal(tmp_path / "a.tif", channel=1, volume=1).code == "VP1225"


def test_a_document_type_is_refused(tmp_path) -> None:
    text = f'<!DOCTYPE OME [<!ENTITY a "aaaaaaaaaa">]><{ROOT}><Image Name="&a;"/></OME>'
    tifffile.imwrite(tmp_path / "a.tif", noise("YX"), description=text, metadata=None)
    error = refusal(tmp_path / "a.tif")
    assert (error.code, "document type" in str(error)) == ("VP1220", True)


def test_a_file_without_pages_for_its_own_description_is_refused(tmp_path) -> None:
    text = f"<{ROOT}><BinaryOnly MetadataFile='b.companion.ome' UUID='urn:uuid:1'/></OME>"
    tifffile.imwrite(tmp_path / "a.tif", noise("YX"), description=text, metadata=None)
    assert refusal(tmp_path / "a.tif").code == "VP1224"


def test_as_a_stack_its_pages_are_slices(tmp_path) -> None:
    values = write(tmp_path / "a.ome.tif", "ZYX")
    spec = SourceSpec(path="a.ome.tif", stack=StackLayout(spacing_mm_zyx=(3, 2, 1)))
    with open_source(spec, tmp_path, Silent()) as source:
        assert (source.info.format, source.info.grid.spacing_mm_zyx) == ("stack", (3, 2, 1))
        assert np.array_equal(source.read_slab(0, 4), values)


def test_nothing_but_geometry_is_kept_of_the_description(tmp_path) -> None:
    write(tmp_path / "a.ome.tif", "ZYX")
    rewrite(tmp_path / "a.ome.tif", 'Name="Image0"', 'Name="Bob"')
    assert "Bob" not in read(tmp_path / "a.ome.tif")[0].model_dump_json()


def test_values_that_grow_from_white_to_black_are_refused(tmp_path) -> None:
    file = tmp_path / "a.ome.tif"
    tifffile.imwrite(file, noise("ZYX"), photometric="miniswhite", ome=True, metadata={"axes": "ZYX"})
    assert refusal(file).code == "VP1166"


def test_a_folder_of_the_files_of_one_ome_tiff_is_read_as_one_of_them(tmp_path) -> None:
    values = several_files(tmp_path, [f"z{z}.ome.tif" for z in (3, 0, 2, 1)])
    assert np.array_equal(read(tmp_path)[1], values)
    tifffile.imwrite(tmp_path / "other.tif", values[0])
    assert refusal(tmp_path).code == "VP2084"
    with open_source(SourceSpec(path=str(tmp_path / "z0.ome.tif")), tmp_path, Silent()) as source:
        assert source.info.grid.shape_zyx == values.shape


def test_a_folder_of_ome_tiffs_of_their_own_is_no_set(tmp_path) -> None:
    for z in range(3):
        tifffile.imwrite(tmp_path / f"z{z}.ome.tif", noise("YX"), ome=True)
    assert format_of(tmp_path) == "stack"
