"""Legacy VTK structured points: places, types, text and binary, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
import pyvista
from header_files import check_every_cut, noise, read, refusal, refusal_at_open

from volprep_formats.readers.vtk.legacy import _TYPES

FIELDS = {
    "DATASET": "STRUCTURED_POINTS",
    "DIMENSIONS": "4 1 3",
    "SPACING": "2 3 4",
    "ORIGIN": "10 -20 300",
    "POINT_DATA": "12",
    "SCALARS": "v short 1",
    "LOOKUP_TABLE": "default",
}


def save(path: Path, without=(), data: bytes | None = None, form: str = "BINARY", title: str = "any", **fields) -> Path:
    lines = ["# vtk DataFile Version 3.0", title, form]
    lines += [f"{name} {value}" for name, value in (FIELDS | fields).items() if name not in without]
    path.write_bytes("\n".join([*lines, ""]).encode() + (noise(">i2").tobytes() if data is None else data))
    return path


def text(values: np.ndarray, form: str = "%d") -> bytes:
    return b" ".join((form % value).encode() for value in values.ravel()) + b"\n"


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("dtype", ["int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"])
def test_what_vtk_writes_is_read(tmp_path, dtype, binary) -> None:
    grid = pyvista.ImageData(dimensions=(4, 1, 3), spacing=(2, 3, 4), origin=(10, -20, 300))
    grid.point_data["v"] = noise(dtype).ravel()
    grid.point_data.active_scalars_name = "v"
    grid.save(tmp_path / "v.vtk", binary=binary)
    values, info = read(tmp_path / "v.vtk")
    assert np.array_equal(values, noise())
    assert info.format == "vtk"
    np.testing.assert_array_equal(
        info.grid.world_from_index, [[2, 0, 0, 10], [0, 3, 0, -20], [0, 0, 4, 300], [0, 0, 0, 1]]
    )
    assert any("no patient" in remark for remark in info.remarks)


@pytest.mark.parametrize("name", [*_TYPES])
def test_every_type_keeps_its_values_in_both_forms(tmp_path, name) -> None:
    big = noise(">" + _TYPES[name])
    for form, data in (("BINARY", big.tobytes()), ("ASCII", text(big))):
        values, info = read(save(tmp_path / "v.vtk", data=data, form=form, SCALARS=f"v {name}"))
        kept = {"i1": "int16", "u1": "uint8", "i2": "int16", "u2": "uint16", "f4": "float32", "f8": "float32"}
        assert info.stored_type == kept.get(_TYPES[name], "uint8")
        assert np.array_equal(values, noise())


def test_arrays_after_the_scalars_are_left_alone(tmp_path) -> None:
    more = b"\nMETADATA\nINFORMATION 0\n\nFIELD FieldData 1\nw 1 12 float\n"
    assert np.array_equal(read(save(tmp_path / "v.vtk", data=noise(">i2").tobytes() + more))[0], noise())
    assert np.array_equal(read(save(tmp_path / "v.vtk", data=text(noise()) + more, form="ASCII"))[0], noise())


def test_what_may_be_left_out_or_named_otherwise_is(tmp_path) -> None:
    _, info = read(save(tmp_path / "v.vtk", ["SPACING", "ORIGIN"]))
    np.testing.assert_array_equal(info.grid.world_from_index, np.eye(4))
    _, info = read(
        save(
            tmp_path / "v.vtk",
            ["SPACING", "POINT_DATA", "SCALARS", "LOOKUP_TABLE"],
            ASPECT_RATIO="2 3 4",
            point_data="12",
            Scalars="v short",
            lookup_table="default",
        )
    )
    assert info.grid.spacing_mm_zyx == (4, 3, 2)


@pytest.mark.parametrize(
    ("code", "fields"),
    [
        ("VP1289", {"DATASET": "POLYDATA"}),
        ("VP1140", {"DIMENSIONS": "4 3"}),
        ("VP1140", {"DIMENSIONS": "4 0 3"}),
        ("VP1140", {"DIMENSIONS": "-4 -1 3"}),
        ("VP1140", {"DIMENSIONS": "4 1 2"}),
        ("VP1140", {"POINT_DATA": "13"}),
        ("VP1140", {"POINT_DATA": "x"}),
        ("VP1140", {"ORIGIN": "0 0"}),
        ("VP1140", {"SPACING": "1 1 one"}),
        ("VP1141", {"SCALARS": "v short 3"}),
        ("VP1142", {"SCALARS": "v long"}),
        ("VP1142", {"SCALARS": "v bit"}),
        ("VP1142", {"SCALARS": "v"}),
        ("VP2021", {"SPACING": "1 0 1"}),
        ("VP2021", {"SPACING": "1 -1 1"}),
        ("VP2021", {"SPACING": "nan 1 1"}),
        ("VP2021", {"SPACING": "1 1e300 1"}),
        ("VP2021", {"ORIGIN": "inf 0 0"}),
    ],
)
def test_headers_that_cannot_be_trusted_are_refused(tmp_path, code, fields) -> None:
    assert refusal_at_open(save(tmp_path / "v.vtk", **fields)).code == code


@pytest.mark.parametrize(("code", "word"), [("VP1141", "CELL_DATA"), ("VP1142", "FIELD"), ("VP1142", "VECTORS")])
def test_other_data_than_scalars_of_the_points_are_refused(tmp_path, code, word) -> None:
    file = save(tmp_path / "v.vtk")
    for old in (b"POINT_DATA", b"SCALARS"):
        whole = file.read_bytes()
        file.write_bytes(whole.replace(old, word.encode()))
        assert refusal_at_open(file).code == code
        file.write_bytes(whole)


@pytest.mark.parametrize(
    "head",
    [
        b"# vtk DataFile Version 3.0\n",
        b"# vtk DataFile Version x\n\nBINARY\n",
        b"# vtk DataFile Version 3.0\ntitle\nbinary?\n",
        b"# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET STRUCTURED_POINTS\n",
        b"# vtk DataFile Version 3.0\ntitle\nASCII\n" + b"\n" * 2**17,
    ],
)
def test_a_header_that_is_none_is_refused(tmp_path, head) -> None:
    (tmp_path / "v.vtk").write_bytes(head)
    assert refusal_at_open(tmp_path / "v.vtk").code == "VP1140"


@pytest.mark.parametrize("form", ["BINARY", "ASCII"])
def test_declared_sizes_beyond_the_file_are_refused_before_anything_is_allocated(tmp_path, form) -> None:
    for size in (100, 65536, 2**31 - 1):
        told = {"DIMENSIONS": f"{size} {size} {size}", "POINT_DATA": str(size**3)}
        assert refusal_at_open(save(tmp_path / "v.vtk", form=form, **told)).code in {"VP1008", "VP1140"}


@pytest.mark.parametrize("data", [b"1 " * 11, b"1 " * 11 + b"1", b"1 " * 11 + b"x ", b"1 " * 11 + b"1" * 3000])
def test_text_that_ends_too_early_or_is_no_number_is_refused(tmp_path, data) -> None:
    # A number at the very end may have been cut in two.
    assert refusal(save(tmp_path / "v.vtk", data=data, form="ASCII")).code in {"VP1007", "VP1008"}


def test_every_byte_survives_as_a_colour_of_one_component(tmp_path) -> None:
    shades = np.arange(256, dtype=np.uint8)
    told = {"DIMENSIONS": "16 4 4", "POINT_DATA": "256", "COLOR_SCALARS": "v 1"}
    without = ("SCALARS", "LOOKUP_TABLE")
    for form, data in (("BINARY", shades.tobytes()), ("ASCII", text(shades / 255, "%g"))):
        values, info = read(save(tmp_path / "v.vtk", without, data, form, **told))
        assert info.stored_type == "uint8"
        assert np.array_equal(values.ravel(), shades)


@pytest.mark.parametrize("word", ["1.1", "-0.1", "nan"])
def test_colours_outside_their_range_are_refused(tmp_path, word) -> None:
    data = b"0.5 " * 11 + f"{word} ".encode()
    file = save(tmp_path / "v.vtk", ("SCALARS", "LOOKUP_TABLE"), data, "ASCII", COLOR_SCALARS="v 1")
    assert refusal(file).code == "VP1007"


def test_colours_of_several_components_are_refused(tmp_path) -> None:
    assert refusal(save(tmp_path / "v.vtk", ("SCALARS", "LOOKUP_TABLE"), COLOR_SCALARS="v 3")).code == "VP1141"
    assert refusal(save(tmp_path / "v.vtk", ("SCALARS", "LOOKUP_TABLE"), COLOR_SCALARS="v")).code == "VP1142"


def test_the_title_is_not_kept(tmp_path) -> None:
    _, info = read(save(tmp_path / "v.vtk", title="CANARY", SCALARS="CANARY short"))
    assert "CANARY" not in info.model_dump_json()


@pytest.mark.parametrize("form", ["BINARY", "ASCII"])
def test_every_cut_is_refused(tmp_path, form) -> None:
    check_every_cut(save(tmp_path / "v.vtk", data=None if form == "BINARY" else text(noise()), form=form))


@pytest.mark.parametrize("version", ["1.0", "2.0", "1"])
def test_old_files_are_read_in_lower_case_and_without_a_table(tmp_path, version) -> None:
    lines = f"# vtk DataFile Version {version}\nold\nbinary\ndataset structured_points\ndimensions 4 1 3\n"
    for table in ("", "lookup_table default\n"):
        header = f"{lines}aspect_ratio 2 3 4\norigin 10 -20 300\npoint_data 12\nscalars v short\n{table}"
        (tmp_path / "old.vtk").write_bytes(header.encode() + noise(">i2").tobytes())
        values, info = read(tmp_path / "old.vtk")
        np.testing.assert_array_equal(values, noise())
        assert info.grid.spacing_mm_zyx == (4.0, 3.0, 2.0)


def test_the_first_array_of_a_field_is_read_where_there_are_no_scalars(tmp_path) -> None:
    header = "# vtk DataFile Version 3.0\nany\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 4 1 3\nPOINT_DATA 12\n"
    for array, code in (("scan 1 12 short", None), ("scan 3 12 short", "VP1141"), ("scan 1 13 short", "VP1142")):
        file = tmp_path / "field.vtk"
        file.write_bytes(f"{header}FIELD FieldData 1\n{array}\n".encode() + noise(">i2").tobytes())
        if code is None:
            np.testing.assert_array_equal(read(file)[0], noise())
        else:
            assert refusal_at_open(file).code == code
