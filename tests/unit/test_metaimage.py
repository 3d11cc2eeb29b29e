"""MetaImage volumes: places, types, packed and detached data, and what is refused."""

import zlib
from pathlib import Path

import numpy as np
import pytest
from header_files import check_every_cut, noise, read, refusal, refusal_at_open
from hypothesis import given
from hypothesis import strategies as st

from volprep_formats.readers.metaimage import _TYPES

# In the order in which ITK writes them.
FIELDS = {
    "ObjectType": "Image",
    "NDims": "3",
    "BinaryData": "True",
    "BinaryDataByteOrderMSB": "False",
    "CompressedData": "False",
    "TransformMatrix": "1 0 0 0 1 0 0 0 1",
    "Offset": "1 2 3",
    "CenterOfRotation": "0 0 0",
    "AnatomicalOrientation": "RAI",
    "ElementSpacing": "2 3 4",
    "DimSize": "4 1 3",
    "ElementType": "MET_SHORT",
    "ElementDataFile": "LOCAL",
}


def header(without=(), **fields: str) -> bytes:
    """Header with some fields changed or left out; ElementDataFile stays last."""
    all_fields = {name: value for name, value in (FIELDS | fields).items() if name != "ElementDataFile"}
    all_fields["ElementDataFile"] = fields.get("ElementDataFile", "LOCAL")
    return "".join(f"{name} = {value}\n" for name, value in all_fields.items() if name not in without).encode()


def save(path: Path, without=(), data: bytes | None = None, **fields: str) -> Path:
    path.write_bytes(header(without, **fields) + (noise().tobytes() if data is None else data))
    return path


def packed(values: np.ndarray) -> dict:
    data = zlib.compress(values.tobytes())
    return {"data": data, "CompressedData": "True", "CompressedDataSize": str(len(data))}


@given(st.lists(st.floats(-1, 1), min_size=9, max_size=9), st.tuples(*[st.floats(0.01, 9.0)] * 3), st.booleans())
def test_every_voxel_lies_where_the_matrix_puts_it(tmp_path_factory, turn, spacing, mirrored) -> None:
    rotation = np.linalg.qr(np.array(turn).reshape(3, 3) + 2 * np.eye(3))[0]
    rotation[:, 0] *= -1 if mirrored else 1
    # The directions of the axes stand one after the other.
    told = {"TransformMatrix": rotation.T.ravel(), "ElementSpacing": spacing, "Offset": (10.0, -20.0, 300.0)}
    text = {name: " ".join(map(repr, map(float, numbers))) for name, numbers in told.items()}
    values, info = read(save(tmp_path_factory.mktemp("meta") / "v.mha", **text))
    assert np.array_equal(values, noise())
    np.testing.assert_allclose(info.grid.world_from_index[:3, :3], rotation * spacing, atol=1e-12)
    assert info.grid.origin_mm_xyz == (10.0, -20.0, 300.0)
    assert (info.format, info.remarks) == ("metaimage", ())


def test_a_file_that_itk_wrote_is_read(tmp_path) -> None:
    # SimpleITK 2.5.7: direction ((0, 0, -1), (0, 1, 0), (1, 0, 0)), spacing (1, 2, 3), origin (5, 6, 7), 0 to 23.
    (tmp_path / "itk.mha").write_bytes(
        b"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = True\n"
        b"CompressedDataSize = 44\nTransformMatrix = 0 0 1 0 1 0 -1 0 0\nOffset = 5 6 7\nCenterOfRotation = 0 0 0\n"
        b"AnatomicalOrientation = IAL\nElementSpacing = 1 2 3\nDimSize = 4 3 2\nElementType = MET_SHORT\n"
        b"ElementDataFile = LOCAL\n"
        + bytes.fromhex(
            "785e05c18501802000 00b0591880012 2ff7feac66034992d82d5667788 92ec74b93d8aead57cba1f122801 15".replace(
                " ", ""
            )
        )
    )
    values, info = read(tmp_path / "itk.mha")
    assert np.array_equal(values, np.arange(24).reshape(2, 3, 4))
    np.testing.assert_array_equal(info.grid.world_from_index, [[0, 0, -3, 5], [0, 2, 0, 6], [1, 0, 0, 7], [0, 0, 0, 1]])


@pytest.mark.parametrize("order", ["False", "True"])
@pytest.mark.parametrize("key", ["BinaryDataByteOrderMSB", "ElementByteOrderMSB"])
@pytest.mark.parametrize("is_packed", [False, True])
def test_both_byte_orders_are_read_plain_and_packed(tmp_path, order, key, is_packed) -> None:
    values = noise(">i2" if order == "True" else "<i2")
    data = packed(values) if is_packed else {"data": values.tobytes()}
    got, _ = read(save(tmp_path / "v.mha", ["BinaryDataByteOrderMSB"] * (key[0] == "E"), **{key: order}, **data))
    assert np.array_equal(got, noise())
    assert got.dtype == np.int16


@pytest.mark.parametrize("name", [*_TYPES])
def test_every_type_keeps_its_values(tmp_path, name) -> None:
    values, info = read(save(tmp_path / "v.mha", data=noise(_TYPES[name]).tobytes(), ElementType=name))
    kept = {"i1": "int16", "u1": "uint8", "i2": "int16", "u2": "uint16", "f4": "float32", "f8": "float32"}
    assert info.stored_type == kept.get(_TYPES[name], "uint8")
    assert np.array_equal(values, noise())


def test_numbers_as_text_are_read(tmp_path) -> None:
    data = b" ".join(b"%d" % value for value in noise().ravel())
    values, _ = read(save(tmp_path / "v.mha", data=data, BinaryData="False"))
    assert np.array_equal(values, noise())


@pytest.mark.parametrize("is_packed", [False, True])
def test_a_detached_data_file_is_read(tmp_path, is_packed) -> None:
    (tmp_path / "v.raw").write_bytes(packed(noise())["data"] if is_packed else noise().tobytes())
    (tmp_path / "v.mhd").write_bytes(header(ElementDataFile="v.raw", CompressedData=str(is_packed)))
    assert np.array_equal(read(tmp_path / "v.mhd")[0], noise())
    (tmp_path / "v.mhd").write_bytes((tmp_path / "v.mhd").read_bytes().rstrip(b"\n"))
    assert np.array_equal(read(tmp_path / "v.mhd")[0], noise())


@pytest.mark.parametrize("name", ["../secret", "/etc/passwd", "link", "missing", "."])
def test_a_detached_file_outside_the_folder_or_missing_is_refused(tmp_path, name) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (tmp_path / "secret").write_bytes(noise().tobytes())
    (folder / "link").symlink_to(tmp_path / "secret")
    (folder / "v.mhd").write_bytes(header(ElementDataFile=name))
    assert refusal_at_open(folder / "v.mhd").code == "VP1006"


@pytest.mark.parametrize("name", ["LIST 3D", "list x", "v%03d.raw 1", "v%03d.raw a b", ""])
def test_data_in_several_files_are_refused(tmp_path, name) -> None:
    assert refusal_at_open(save(tmp_path / "v.mhd", ElementDataFile=name)).code == "VP1122"


@pytest.mark.parametrize("value", ["LIST", "LIST 2D"])
def test_slices_in_a_file_each_are_read_from_a_list(tmp_path, value) -> None:
    names = ["c.raw", "a.raw", "b.raw"]
    for name, voxels in zip(names, noise(), strict=True):
        (tmp_path / name).write_bytes(b"head" + voxels.tobytes())
    listed = header(ElementDataFile=value, HeaderSize="4") + "\n".join(names).encode()
    (tmp_path / "v.mhd").write_bytes(listed)
    np.testing.assert_array_equal(read(tmp_path / "v.mhd")[0], noise())
    (tmp_path / "v.mhd").write_bytes(listed.replace(b"\nb.raw", b""))
    assert refusal_at_open(tmp_path / "v.mhd").code == "VP1120"
    (tmp_path / "v.mhd").write_bytes(listed.replace(b"b.raw", b"../b.raw"))
    assert refusal_at_open(tmp_path / "v.mhd").code == "VP1006"


@pytest.mark.parametrize(("pattern", "name"), [("v%03d.raw 1 3 1", "v{:03}.raw"), ("s%d.raw 2 6 2", "s{}.raw")])
def test_slices_in_a_file_each_are_read_by_their_pattern(tmp_path, pattern, name) -> None:
    first, last, *step = (int(word) for word in pattern.split()[1:])
    for number, page in zip(range(first, last + 1, *step), noise(), strict=True):
        (tmp_path / name.format(number)).write_bytes(b"head" + page.tobytes())
    (tmp_path / "v.mhd").write_bytes(header(ElementDataFile=pattern, HeaderSize="4"))
    assert np.array_equal(read(tmp_path / "v.mhd")[0], noise())
    (tmp_path / name.format(last)).write_bytes(b"head" + noise()[0].tobytes()[:-2])
    assert refusal_at_open(tmp_path / "v.mhd").code == "VP1008"
    (tmp_path / name.format(last)).unlink()
    assert refusal_at_open(tmp_path / "v.mhd").code == "VP1006"


def test_a_header_size_skips_the_beginning_of_the_data_file(tmp_path) -> None:
    (tmp_path / "v.raw").write_bytes(b"any header" + noise().tobytes())
    for size in ("10", "-1"):
        (tmp_path / "v.mhd").write_bytes(header(ElementDataFile="v.raw", HeaderSize=size))
        assert np.array_equal(read(tmp_path / "v.mhd")[0], noise())
    (tmp_path / "v.raw").write_bytes(b"any header" + packed(noise())["data"])
    (tmp_path / "v.mhd").write_bytes(header(ElementDataFile="v.raw", HeaderSize="10", CompressedData="True"))
    assert np.array_equal(read(tmp_path / "v.mhd")[0], noise())
    assert np.array_equal(read(save(tmp_path / "v.mha", HeaderSize="-1"))[0], noise())


@pytest.mark.parametrize(
    ("code", "fields"),
    [
        ("VP1008", {"HeaderSize": "1"}),
        ("VP1008", {"HeaderSize": "9000000000"}),
        ("VP1008", {"HeaderSize": "-1", "DimSize": "4 1 4"}),
        ("VP1122", {"HeaderSize": "-1", "CompressedData": "True"}),
        ("VP1120", {"HeaderSize": "-2"}),
        ("VP1122", {"HeaderSizePerSlice": "8"}),
    ],
)
def test_header_sizes_that_cannot_be_are_refused(tmp_path, code, fields) -> None:
    assert refusal_at_open(save(tmp_path / "v.mha", **fields)).code == code


def test_element_size_stands_in_for_a_missing_spacing(tmp_path) -> None:
    _, info = read(save(tmp_path / "v.mha", ["ElementSpacing"], ElementSize="2 3 4"))
    assert info.grid.spacing_mm_zyx == (4, 3, 2)
    _, info = read(save(tmp_path / "v.mha", ElementSize="9 9 9"))
    assert info.grid.spacing_mm_zyx == (4, 3, 2)


@pytest.mark.parametrize("name", ["Offset", "Position", "Origin"])
@pytest.mark.parametrize("matrix", ["TransformMatrix", "Orientation", "Rotation"])
def test_older_names_of_fields_are_known(tmp_path, name, matrix) -> None:
    told = {name: "7 8 9", matrix: "0 1 0 1 0 0 0 0 -1"}
    _, info = read(save(tmp_path / "v.mha", {"Offset", "TransformMatrix"} - told.keys(), **told))
    assert info.grid.origin_mm_xyz == (7, 8, 9)
    np.testing.assert_array_equal(info.grid.direction, [[0, 1, 0], [1, 0, 0], [0, 0, -1]])


@pytest.mark.parametrize(("unit", "mm"), [("um", 1e-3), ("mm", 1), ("cm", 10)])
def test_units_become_millimetres(tmp_path, unit, mm) -> None:
    _, info = read(save(tmp_path / "v.mha", DistanceUnits=unit))
    assert info.grid.spacing_mm_zyx == pytest.approx((4 * mm, 3 * mm, 2 * mm), rel=1e-15)
    assert info.grid.origin_mm_xyz == pytest.approx((mm, 2 * mm, 3 * mm), rel=1e-15)


def test_what_the_header_leaves_open_is_remarked(tmp_path) -> None:
    _, info = read(save(tmp_path / "v.mha", ["TransformMatrix", "ElementSpacing", "Offset"]))
    np.testing.assert_array_equal(info.grid.world_from_index, np.eye(4))
    assert len(info.remarks) == 3


def test_a_place_that_is_left_out_is_remarked(tmp_path) -> None:
    _, info = read(save(tmp_path / "v.mha", ["Offset"]))
    assert info.grid.origin_mm_xyz == (0, 0, 0)
    assert [remark for remark in info.remarks if "0, 0, 0" in remark]


def test_the_intensity_function_is_kept_beside_the_stored_values(tmp_path) -> None:
    told = {"ElementToIntensityFunctionSlope": "0.5", "ElementToIntensityFunctionOffset": "-10"}
    values, info = read(save(tmp_path / "v.mha", **told))
    assert (info.slope, info.intercept) == (0.5, -10.0)
    assert np.array_equal(values, noise())


@pytest.mark.parametrize(
    ("code", "fields"),
    [
        ("VP1120", {"NDims": "x"}),
        ("VP1120", {"NDims": "-1"}),
        ("VP1308", {"NDims": "2", "DimSize": "4 3"}),
        ("VP1121", {"NDims": "2"}),
        ("VP1121", {"NDims": "4", "DimSize": "4 1 3 2"}),
        ("VP1121", {"ElementNumberOfChannels": "3"}),
        ("VP1120", {"DimSize": "4 3"}),
        ("VP1120", {"DimSize": "4 -1 3"}),
        ("VP1120", {"DimSize": "4 0 3"}),
        ("VP1120", {"DimSize": "4 1 1_0"}),
        ("VP1120", {"DimSize": "4 1 99999999999999999999999"}),
        ("VP1122", {"ElementType": "MET_LONG"}),
        ("VP1122", {"ElementType": "MET_UCHAR_ARRAY"}),
        ("VP1120", {"CompressedData": "perhaps"}),
        ("VP1120", {"TransformMatrix": "1 0 0 0 1 0"}),
        ("VP1120", {"Offset": "1 2 zero"}),
        ("VP1120", {"DistanceUnits": "parsec"}),
        ("VP1120", {"ElementToIntensityFunctionSlope": "0"}),
        ("VP1120", {"ElementToIntensityFunctionOffset": "nan"}),
        ("VP2020", {"TransformMatrix": "1 0 0 0.1 0.995 0 0 0 1"}),
        ("VP2021", {"TransformMatrix": "0 0 0 0 0 0 0 0 0"}),
        ("VP2021", {"TransformMatrix": "1 0 0 0 2 0 0 0 1"}),
        ("VP2021", {"TransformMatrix": "1 0 0 0 nan 0 0 0 1"}),
        ("VP2021", {"ElementSpacing": "1 -1 1"}),
        ("VP2021", {"ElementSpacing": "1 0 1"}),
        ("VP2021", {"ElementSpacing": "1 1e300 1"}),
        ("VP2021", {"ElementSpacing": "1 1.7e308 inf"}),
        ("VP2021", {"ElementSpacing": "1 1.7e308 1", "DistanceUnits": "cm"}),
        ("VP2021", {"Offset": "0 inf 0"}),
    ],
)
def test_headers_that_cannot_be_trusted_are_refused(tmp_path, code, fields) -> None:
    assert refusal_at_open(save(tmp_path / "v.mha", **fields)).code == code


@pytest.mark.parametrize(
    "head",
    [
        b"NDims = 3",
        b"NDims = 3\nDimSize = 1 1 1\n",
        b"NDims = 3\nno field\nElementDataFile = LOCAL\n",
        b"NDims = 3\nNDims = 3\nElementDataFile = LOCAL\n",
        b"NDims = 3\nComment =" + b"#" * 2**21 + b"\nElementDataFile = LOCAL\n",
    ],
)
def test_a_header_that_is_none_is_refused(tmp_path, head) -> None:
    (tmp_path / "v.mha").write_bytes(head)
    assert refusal_at_open(tmp_path / "v.mha").code == "VP1120"


def test_a_tiny_header_that_declares_the_world_is_refused_before_anything_is_allocated(tmp_path) -> None:
    file = tmp_path / "v.mha"
    for size in ("65536 65536 65536", "2147483647 2147483647 2147483647", "4294967296 4294967296 1", "100000 100000 1"):
        for kind in ("CompressedData = True", "BinaryData = False", "BinaryData = True"):
            file.write_text(f"NDims = 3\nDimSize = {size}\nElementType = MET_DOUBLE\n{kind}\nElementDataFile = LOCAL\n")
            assert refusal_at_open(file).code in {"VP1008", "VP1120"}


@pytest.mark.parametrize("extra", [-1, 1])
@pytest.mark.parametrize("form", ["plain", "packed", "text"])
def test_data_that_are_not_of_the_declared_size_are_refused(tmp_path, form, extra) -> None:
    values = np.zeros(12 + extra, np.int16)
    told = {"plain": {"data": values.tobytes()}, "packed": packed(values), "text": {"data": b"0 " * len(values)}}
    file = save(tmp_path / "v.mha", BinaryData=str(form != "text"), **told[form])
    assert refusal(file).code == "VP1008"


def test_bytes_after_a_packed_stream_and_damage_in_it_are_refused(tmp_path) -> None:
    told = packed(noise())
    assert refusal(save(tmp_path / "v.mha", **(told | {"data": told["data"] + b"x"}))).code == "VP1008"
    assert refusal(save(tmp_path / "v.mha", **(told | {"data": told["data"][:-1] + b"x"}))).code == "VP1005"
    assert refusal(save(tmp_path / "v.mha", **(told | {"data": told["data"][:-1]}))).code in {"VP1005", "VP1008"}


def test_a_large_packed_volume_is_read_piece_by_piece_in_any_order(tmp_path) -> None:
    from volprep_formats.progress import Silent
    from volprep_formats.readers import open_source
    from volprep_formats.source import SourceSpec

    values = np.random.default_rng(0).integers(0, 3, (40, 100, 100)).astype(np.int16)
    file = save(tmp_path / "v.mha", DimSize="100 100 40", **packed(values))
    with open_source(SourceSpec(path=str(file)), Path(), Silent()) as source:
        for z0, z1 in [(30, 40), (0, 1), (35, 40), (1, 40), (2, 2)]:
            assert np.array_equal(source.read_slab(z0, z1), values[z0:z1])


def test_nothing_that_could_name_a_patient_is_kept(tmp_path) -> None:
    _, info = read(save(tmp_path / "v.mha", Comment="CANARY", Name="CANARY", PatientName="CANARY"))
    assert "CANARY" not in info.model_dump_json()


@pytest.mark.parametrize("is_packed", [False, True])
def test_every_cut_is_refused(tmp_path, is_packed) -> None:
    check_every_cut(save(tmp_path / "v.mha", **(packed(noise()) if is_packed else {})))


@pytest.mark.parametrize("is_packed", [False, True])
@pytest.mark.parametrize("beside", [False, True])
def test_one_of_several_volumes_or_channels_is_read(tmp_path, beside, is_packed) -> None:
    several = np.stack([noise(), noise() + 100, noise() + 200], axis=3 if beside else 0)
    told = {"ElementNumberOfChannels": "3"}
    if not beside:
        told = {
            "NDims": "4",
            "DimSize": "4 1 3 3",
            "ElementSpacing": "2 3 4 0.5",
            "Offset": "1 2 3 0",
            "TransformMatrix": "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1",
        }
    told |= {"CompressedData": str(is_packed)}
    data = several.tobytes()
    file = save(tmp_path / "v.mha", data=zlib.compress(data) if is_packed else data, **told)
    for volume in (1, 2, 3):
        values, _ = read(file, volume=volume)
        assert np.array_equal(values, noise() + 100 * (volume - 1))
    for wanted, code in ((4, "VP1021"), (None, "VP1121")):
        assert refusal_at_open(file, volume=wanted).code == code


def test_a_fourth_axis_of_one_value_is_dropped(tmp_path) -> None:
    told = {"NDims": "4", "DimSize": "4 1 3 1", "ElementSpacing": "2 3 4 1"}
    told |= {"Offset": "1 2 3 0", "TransformMatrix": "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"}
    values, info = read(save(tmp_path / "v.mha", **told))
    assert np.array_equal(values, noise())
    assert (info.grid.spacing_mm_zyx, info.grid.origin_mm_xyz) == ((4, 3, 2), (1, 2, 3))


@pytest.mark.parametrize("name", ["C:\\Users\\DOE JANE\\v.raw", "sub\\v.raw", "\\\\server\\scans\\v.raw"])
def test_a_data_file_with_a_path_of_windows_is_found_beside_the_header(tmp_path, name) -> None:
    (tmp_path / "v.raw").write_bytes(noise().tobytes())
    (tmp_path / "v.mhd").write_bytes(header(ElementDataFile=name))
    values, _ = read(tmp_path / "v.mhd")
    assert np.array_equal(values, noise())
