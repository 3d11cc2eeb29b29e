"""Folders of pictures and TIFF files of many pages as volumes."""

import gzip
import struct
import zlib
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
import tifffile
from dicom_files import save_all, stack
from header_files import check_every_cut, read, refusal, refusal_at_open, same_or_refused
from PIL import Image, ImageCms

from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import workers
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec, StackLayout

SHAPE_ZYX = (11, 3, 5)
_NAMES = {"uint8": "uint8", "uint16": "uint16", "int16": "int16", "float32": "float"}


@pytest.fixture(scope="module", autouse=True)
def kept_workers():
    """Workers live as long as this module, not as long as one file is open."""
    with workers():
        yield


def voxels(dtype: str = "uint8", shape: tuple[int, ...] = SHAPE_ZYX) -> np.ndarray:
    values = np.random.default_rng(3).integers(0, 250, shape)
    return (values * 257 if dtype == "uint16" else values).astype(dtype)


def write(file: Path, values: np.ndarray, kind: str = "", **attributes: object) -> Path:
    """One page, [y, x] or [y, x, channel], in the pixel type `kind`."""
    channels = 1 if values.ndim == 2 else values.shape[2]
    spec = OpenImageIO.ImageSpec(values.shape[1], values.shape[0], channels, kind or _NAMES[values.dtype.name])
    spec.attribute("oiio:UnassociatedAlpha", 1)
    for name, value in attributes.items():
        spec.attribute(name, value)
    output = OpenImageIO.ImageOutput.create(str(file))
    assert output.open(str(file), spec), output.geterror()
    assert output.write_image(values.reshape(*values.shape[:2], channels)), output.geterror()
    output.close()
    return file


def write_pages(file: Path, values: np.ndarray, description: str = "") -> Path:
    output = OpenImageIO.ImageOutput.create(str(file))
    for z, page in enumerate(values):
        spec = OpenImageIO.ImageSpec(page.shape[1], page.shape[0], 1, _NAMES[page.dtype.name])
        if description:
            spec.attribute("ImageDescription", description)
        assert output.open(str(file), spec, "AppendSubimage" if z else "Create"), output.geterror()
        assert output.write_image(page[..., np.newaxis]), output.geterror()
    output.close()
    return file


def folder_of(folder: Path, values: np.ndarray, suffix: str = ".png", name: str = "z{}", kind: str = "") -> Path:
    folder.mkdir(exist_ok=True)
    for z, page in enumerate(values):
        write(folder / (name.format(z) + suffix), page, kind)
    return folder


def code(path: Path) -> str:
    return refusal_at_open(path).code


@pytest.mark.parametrize(
    ("suffix", "dtype", "kind"),
    [
        (".png", "uint8", ""),
        (".png", "uint16", ""),
        (".tif", "uint8", ""),
        (".tif", "uint16", ""),
        (".tif", "int16", ""),
        (".tiff", "float32", "float"),
        (".TIF", "float32", "half"),
        (".exr", "float32", "half"),
        (".exr", "float32", "float"),
    ],
)
def test_pictures_are_read_exactly_in_the_order_of_unpadded_numbers(tmp_path, suffix, dtype, kind) -> None:
    values, info = read(folder_of(tmp_path / "s", voxels(dtype), suffix, "cut 7 z{}", kind))
    assert info.stored_type == dtype
    assert values.dtype == dtype
    assert np.array_equal(values, voxels(dtype))


def test_equal_channels_are_one_and_bmp_too(tmp_path) -> None:
    grey = np.repeat(voxels()[..., np.newaxis], 3, axis=-1)
    assert np.array_equal(read(folder_of(tmp_path / "bmp", grey, ".bmp"))[0], voxels())
    opaque = np.concatenate([grey, np.full_like(grey[..., :1], 255)], axis=-1)
    assert np.array_equal(read(folder_of(tmp_path / "png", opaque))[0], voxels())


def test_jpeg_pictures_are_read_as_they_are_decoded_and_said_to_be_lossy(tmp_path) -> None:
    smooth = np.add.outer(np.arange(3), np.add.outer(np.arange(8), np.arange(16))).astype(np.uint8) * 8
    values, info = read(folder_of(tmp_path / "s", smooth, ".jpg"))
    assert np.abs(values.astype(int) - smooth).max() < 8
    assert any("JPEG" in remark for remark in info.remarks)


@pytest.mark.parametrize("place", [0, 6])
def test_colour_and_transparency_are_refused(tmp_path, place) -> None:
    grey = np.repeat(voxels()[..., np.newaxis], 4, axis=-1)
    grey[..., 3] = 255
    for channel in (1, 3):
        values = grey.copy()
        values[place, 1, 1, channel] ^= 1
        folder = folder_of(tmp_path / "s", values)
        assert refusal(folder).code == "VP1164"
        assert place or refusal_at_open(folder).code == "VP1164"


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_pages_of_a_tiff_file_are_slices(tmp_path, dtype) -> None:
    values, info = read(write_pages(tmp_path / "v.tif", voxels(dtype)))
    assert np.array_equal(values, voxels(dtype))
    assert info.grid.shape_zyx == SHAPE_ZYX
    folder = tmp_path / "s"
    folder.mkdir()
    write_pages(folder / "only.tif", voxels(dtype))
    assert np.array_equal(read(folder)[0], voxels(dtype))


def test_slabs_may_be_read_in_any_order(tmp_path) -> None:
    values = voxels(shape=(40, 3, 5))
    for path in (write_pages(tmp_path / "v.tif", values), folder_of(tmp_path / "s", values)):
        with open_source(SourceSpec(path=str(path)), Path(), Silent()) as source:
            for z0, z1 in [(30, 40), (0, 1), (39, 40), (1, 38), (2, 2)]:
                assert np.array_equal(source.read_slab(z0, z1), values[z0:z1])


def test_spacing_comes_from_the_scene_alone(tmp_path) -> None:
    write(tmp_path / "1.tif", voxels()[0], XResolution=72.0, YResolution=72.0)
    _, info = read(tmp_path)
    assert info.grid.spacing_mm_zyx == (1, 1, 1)
    assert any("1 mm is assumed" in remark for remark in info.remarks)
    assert any("resolution" in remark for remark in info.remarks)
    told = SourceSpec(path=str(tmp_path), stack=StackLayout(spacing_mm_zyx=(3, 2, 0.5)))
    with open_source(told, Path(), Silent()) as source:
        assert source.info.grid.extent_mm_zyx == (3, 6, 2.5)
        assert not any("1 mm is assumed" in remark for remark in source.info.remarks)


def test_missing_numbers_are_named_and_refused_unless_the_scene_ignores_them(tmp_path) -> None:
    folder = folder_of(tmp_path / "s", voxels(), name="z{:03}")
    for z in (3, 7, 8):
        (folder / f"z{z:03}.png").unlink()
    error = refusal_at_open(folder)
    assert error.code == "VP1162"
    assert "3 picture(s) missing between z000.png and z010.png, by their numbers: 3, 7 to 8" in str(error)
    spec = SourceSpec(path=str(folder), stack=StackLayout(gaps="ignore"))
    with open_source(spec, Path(), Silent()) as source:
        assert np.array_equal(source.read_slab(0, 8), np.delete(voxels(), (3, 7, 8), axis=0))


def test_even_steps_are_no_gaps_but_remarked(tmp_path) -> None:
    for z in range(4):
        write(tmp_path / f"z{95 + 10 * z}.png", voxels()[z])
    values, info = read(tmp_path)
    assert np.array_equal(values, voxels()[:4])
    assert any("steps of 10" in remark for remark in info.remarks)


@pytest.mark.parametrize(
    "names",
    [
        ["a.png", "b.png"],
        ["z1.png", "z01.png"],
        ["z1.png", "z2.tif"],
        ["z1c1.png", "z1c2.png", "z2c1.png"],
        ["1.png", "x1.png"],
    ],
)
def test_names_that_do_not_tell_the_order_are_refused(tmp_path, names) -> None:
    for name in names:
        write(tmp_path / name, voxels()[0])
    error = refusal_at_open(tmp_path)
    assert error.code == "VP1161"
    assert any(name in str(error) for name in names)


@pytest.mark.parametrize(
    "other", [voxels()[0, :2], voxels()[0, :, :4], voxels("uint16")[0], np.zeros((3, 5, 3), np.uint8)]
)
def test_pictures_that_differ_are_refused_by_name(tmp_path, other) -> None:
    folder = folder_of(tmp_path / "s", voxels())
    write(folder / "z4.png", other)
    error = refusal_at_open(folder)
    assert error.code == "VP1163"
    assert "1 of 11" in str(error)
    assert "z0.png is 5×3" in str(error)
    assert "z4.png is" in str(error)


def test_pages_that_differ_are_refused_by_number(tmp_path) -> None:
    output = OpenImageIO.ImageOutput.create("v.tif")
    for z, width in enumerate([5, 5, 4]):
        spec = OpenImageIO.ImageSpec(width, 3, 1, "uint8")
        assert output.open(str(tmp_path / "v.tif"), spec, "AppendSubimage" if z else "Create")
        output.write_image(np.zeros((3, width, 1), np.uint8))
    output.close()
    assert "page 2 is 4×3" in str(refusal_at_open(tmp_path / "v.tif"))


def test_other_files_are_counted_and_hidden_ones_left_out(tmp_path) -> None:
    folder = folder_of(tmp_path / "s", voxels())
    (folder / "._z0.png").write_bytes(b"resource fork")
    (folder / "notes.txt").write_text("mine")
    values, info = read(folder)
    assert np.array_equal(values, voxels())
    assert any("2 other file(s)" in remark for remark in info.remarks)


def test_a_link_to_a_missing_picture_does_not_shorten_the_stack(tmp_path) -> None:
    folder_of(tmp_path, voxels())
    (tmp_path / f"z{len(voxels())}.png").symlink_to(tmp_path / "gone")
    assert code(tmp_path) == "VP1003"


def test_a_folder_with_dicom_stays_one_of_dicom(tmp_path) -> None:
    save_all(stack(), tmp_path / "dicom")
    write(tmp_path / "preview1.png", voxels()[0])
    assert read(tmp_path)[1].format == "dicom"
    with pytest.raises(VolprepError, match="VP1160"):
        open_source(SourceSpec(path=str(tmp_path / "dicom"), format="stack"), Path(), Silent())


def test_several_pages_in_several_files_are_refused(tmp_path) -> None:
    write_pages(tmp_path / "z0.tif", voxels())
    write(tmp_path / "z1.tif", voxels()[0])
    assert code(tmp_path) == "VP1166"


@pytest.mark.parametrize(
    "description",
    [
        "ImageJ=1.53\nimages=22\nslices=22\n",
        "ImageJ=1.53\nimages=11\nchannels=2\nslices=5\n",
        '<OME><Pixels SizeC="2" SizeT="1"/></OME>',
    ],
)
def test_pages_that_are_channels_or_times_or_not_all_are_refused(tmp_path, description) -> None:
    assert code(write_pages(tmp_path / "v.tif", voxels(), description)) == "VP1168"


def test_a_plain_description_is_no_reason_to_refuse(tmp_path) -> None:
    for text in ("20 \xb5m, \xe9", "ImageJ=1.53\nimages=11\nslices=11\n", "channels=5\nSizeC='3'", "<OME SizeC='1'/>"):
        assert np.array_equal(read(write_pages(tmp_path / "v.tif", voxels(), text))[0], voxels())


def test_a_description_that_is_no_utf_8_is_no_reason_to_refuse(tmp_path) -> None:
    file = write_pages(tmp_path / "v.tif", voxels()[:2], "scale in um by me")
    file.write_bytes(file.read_bytes().replace(b"in um", b"in \xb5m"))
    assert np.array_equal(read(file)[0], voxels()[:2])


def png_header(width: int, height: int) -> bytes:
    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")


@pytest.mark.parametrize("size", [(2**31 - 1, 2**31 - 1), (100_000, 100_000), (2**14, 2**14), (30_000, 1000), (0, 5)])
def test_a_tiny_png_that_declares_the_world_is_refused_before_anything_is_allocated(tmp_path, size) -> None:
    (tmp_path / "v.png").write_bytes(png_header(*size))
    assert code(tmp_path / "v.png") in ({"VP1167"} if size == (2**14, 2**14) else {"VP1165", "VP1167"})


@pytest.mark.parametrize("size", [(2**31 - 1, 2**31 - 1), (2**32 - 1, 1), (100_000, 100_000), (2**14, 2**14)])
def test_a_tiny_tiff_that_declares_the_world_is_refused_before_anything_is_allocated(tmp_path, size) -> None:
    entries = [
        (256, size[0]),
        (257, size[1]),
        (258, 8),
        (259, 1),
        (262, 1),
        (273, 8),
        (277, 1),
        (278, size[1]),
        (279, 1),
    ]
    data = b"II*\0" + struct.pack("<IH", 8, len(entries))
    data += b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in entries) + bytes(4)
    (tmp_path / "v.tif").write_bytes(data)
    assert code(tmp_path / "v.tif") in ({"VP1167"} if size == (2**14, 2**14) else {"VP1165", "VP1167"})


@pytest.mark.parametrize("target", ["first", "beyond"])
def test_a_tiff_whose_chain_of_pages_leads_back_or_beyond_the_file_is_refused(tmp_path, target) -> None:
    file = write_pages(tmp_path / "v.tif", voxels()[:1])
    data = bytearray(file.read_bytes())
    at = struct.unpack_from("<I", data, 4)[0]
    link = at + 2 + 12 * struct.unpack_from("<H", data, at)[0]
    data[link : link + 4] = data[4:8] if target == "first" else struct.pack("<I", len(data) + 100)
    file.write_bytes(data)
    assert code(file) == "VP1165"


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("suffix", [".png", ".jpg", ".exr", ".bmp", ".tif"])
def test_every_cut_of_a_picture_is_refused_or_whole(tmp_path, suffix) -> None:
    values = np.repeat(voxels(shape=(8, 6))[..., np.newaxis], 3, axis=-1) if suffix == ".bmp" else voxels(shape=(8, 6))
    kind = "half" if suffix == ".exr" else ""
    check_every_cut(write(tmp_path / f"v{suffix}", values.astype("float32") if kind else values, kind))


@pytest.mark.long
def test_every_cut_of_a_tiff_of_several_pages_is_refused(tmp_path) -> None:
    check_every_cut(write_pages(tmp_path / "v.tif", voxels()[:3]), step=2)


def test_a_real_stack_and_the_raw_file_of_the_same_scan_are_identical(scans) -> None:
    raw = gzip.decompress((scans / "engine_pair/data/engine_256x256x128_uint8.raw.gz").read_bytes())
    values, _ = read(scans / "engine_pair/png_stack")
    assert values.shape == (128, 256, 256)
    assert values.tobytes() == raw


@pytest.mark.parametrize(
    ("name", "shape_zyx"), [("fly_150x256x256", (150, 256, 256)), ("shell_225x128x128", (225, 128, 128))]
)
def test_real_tiff_files_are_read_as_another_library_reads_them(scans, name, shape_zyx) -> None:
    import tifffile

    file = scans / f"qim_microct/{name}.tif"
    values, info = read(file)
    assert info.grid.shape_zyx == shape_zyx
    assert np.array_equal(values, tifffile.imread(file))


def test_cuts_of_a_real_tiff_file_are_refused(scans, tmp_path) -> None:
    whole = (scans / "qim_microct/shell_225x128x128.tif").read_bytes()
    file = tmp_path / "v.tif"
    for percent in range(2, 100, 7):
        file.write_bytes(whole[: len(whole) * percent // 100])
        assert same_or_refused(file, np.zeros(0))


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_values_that_grow_from_white_to_black_are_refused(tmp_path, dtype) -> None:
    file = tmp_path / "a.tif"
    tifffile.imwrite(file, voxels(dtype), photometric="miniswhite")
    error = refusal_at_open(file)
    assert error.code == "VP1166"
    assert "MinIsWhite" in str(error)
    tifffile.imwrite(file, voxels(dtype), photometric="minisblack")
    assert np.array_equal(read(file)[0], voxels(dtype))


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("slice_{}", (-40, -30, -20)),
        ("{}", (-2, -1, 0)),
        ("z{}", (-5, 0, 5)),
        ("cut-{}", (1, 2, 3)),
        ("2020-0{}", (1, 2, 3)),
    ],
)
def test_the_sign_of_a_number_counts_and_a_hyphen_between_is_none(tmp_path, name, numbers) -> None:
    values = voxels("uint8")[:3]
    folder = tmp_path / "s"
    folder.mkdir()
    for page, number in zip(values, numbers, strict=True):
        write(folder / f"{name.format(number)}.png", page, "")
    np.testing.assert_array_equal(read(folder)[0], values)


def test_one_picture_of_another_name_and_size_among_eleven_is_left_out_and_remarked(tmp_path) -> None:
    folder = folder_of(tmp_path / "s", voxels())
    write(folder / "fundus.png", np.zeros((9, 9), np.uint8))
    values, info = read(folder)
    assert np.array_equal(values, voxels())
    assert any("left out" in remark and "fundus" not in remark for remark in info.remarks)
    write(folder / "fundus.png", voxels()[0])
    error = refusal_at_open(folder)
    assert (error.code, "fundus.png" in error.summary) == ("VP1161", True)


def test_a_picture_among_volumes_is_no_scan(tmp_path) -> None:
    write(tmp_path / "preview.png", voxels()[0])
    for name in ("liver.nii.gz", "spleen.nii.gz"):
        (tmp_path / name).touch()
    error = refusal_at_open(tmp_path)
    assert (error.code, "2 volume" in error.summary, "--segments" in error.remedy) == ("VP2083", True, True)
    folder_of(tmp_path, voxels())
    (tmp_path / "preview.png").unlink()
    assert np.array_equal(read(tmp_path)[0], voxels())


def with_chunk(file: Path, name: bytes, data: bytes) -> Path:
    """Add a chunk after the header of a PNG."""
    whole = file.read_bytes()
    chunk = struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    file.write_bytes(whole[:33] + chunk + whole[33:])
    return file


@pytest.mark.parametrize(("gamma", "is_said"), [(100_000, True), (55_555, True), (45_455, False)])
def test_a_gamma_that_is_not_that_of_srgb_is_said(tmp_path, gamma, is_said) -> None:
    Image.fromarray(voxels()[0]).save(tmp_path / "a.png")
    file = with_chunk(tmp_path / "a.png", b"gAMA", struct.pack(">I", gamma))
    assert any("gamma" in remark for remark in read(file)[1].remarks) == is_said


@pytest.mark.parametrize(("kind", "is_said"), [("LAB", True), ("sRGB", False)])
def test_a_colour_profile_other_than_srgb_is_said(tmp_path, kind, is_said) -> None:
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile(kind)).tobytes()
    Image.fromarray(voxels()[0]).convert("RGB").save(tmp_path / "a.tif", icc_profile=profile)
    assert any("profile" in remark for remark in read(tmp_path / "a.tif")[1].remarks) == is_said
