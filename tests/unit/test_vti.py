"""VTK image data in XML: places, all ways to write the numbers, and what is refused."""

import base64
import struct
from pathlib import Path

import numpy as np
import pytest
import pyvista
from header_files import check_every_cut, noise, read, refusal, refusal_at_open
from hypothesis import given
from hypothesis import strategies as st
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

from volprep_formats.readers.vtk.vti import _TYPES


def image(values_zyx: np.ndarray, **placed) -> pyvista.ImageData:
    grid = pyvista.ImageData(dimensions=values_zyx.shape[::-1], **placed)
    grid.point_data["v"] = values_zyx.ravel()
    return grid


FORMS = ("ascii", "inline", "inline zlib", "raw", "raw zlib", "base64", "base64 zlib")


def save(path: Path, grid: pyvista.ImageData, form: str = "raw", header_bits: int = 32, *, big: bool = False) -> Path:
    """Written by VTK itself, in blocks that are small enough to make several."""
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    if form == "ascii":
        writer.SetDataModeToAscii()
    elif form.startswith("inline"):
        writer.SetDataModeToBinary()
    else:
        writer.SetDataModeToAppended()
        writer.SetEncodeAppendedData(form.startswith("base64"))
    if form.endswith("zlib"):
        writer.SetCompressorTypeToZLib()
    else:
        writer.SetCompressorTypeToNone()
    writer.SetBlockSize(2048)
    writer.SetHeaderType(header_bits)
    if big:
        writer.SetByteOrderToBigEndian()
    assert writer.Write() == 1
    return path


def edited(path: Path, old: str, new: str) -> Path:
    data = path.read_bytes()
    assert data.count(old.encode()) >= 1, old
    path.write_bytes(data.replace(old.encode(), new.encode()))
    return path


@given(st.lists(st.floats(-1, 1), min_size=9, max_size=9), st.tuples(*[st.floats(0.01, 9.0)] * 3), st.booleans())
def test_every_voxel_lies_where_the_direction_puts_it(tmp_path_factory, turn, spacing, mirrored) -> None:
    rotation = np.linalg.qr(np.array(turn).reshape(3, 3) + 2 * np.eye(3))[0]
    rotation[:, 0] *= -1 if mirrored else 1
    grid = image(noise(), spacing=spacing, origin=(10, -20, 300))
    grid.direction_matrix = rotation
    values, info = read(save(tmp_path_factory.mktemp("vti") / "v.vti", grid))
    assert np.array_equal(values, noise())
    # VTK writes six digits after the first.
    np.testing.assert_allclose(info.grid.world_from_index[:3, :3], rotation * spacing, atol=1e-4)
    np.testing.assert_allclose(info.grid.origin_mm_xyz, (10, -20, 300), atol=1e-9)
    assert info.format == "vti"
    assert any("no patient" in remark for remark in info.remarks)


def test_an_extent_that_does_not_begin_at_zero_moves_the_first_voxel(tmp_path) -> None:
    grid = image(noise(), spacing=(2, 3, 4), origin=(10, 20, 30))
    grid.direction_matrix = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    place = np.array(grid.points[0])
    grid.extent = (5, 8, -1, -1, 2, 4)
    _, info = read(save(tmp_path / "v.vti", grid))
    moved = np.array(pyvista.read(tmp_path / "v.vti").points[0])
    np.testing.assert_allclose(info.grid.origin_mm_xyz, moved, atol=1e-6)
    assert not np.allclose(moved, place)


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("bits", [32, 64])
@pytest.mark.parametrize("form", FORMS)
def test_all_ways_to_write_numbers_give_the_same_voxels(tmp_path, form, bits, big) -> None:
    values = np.random.default_rng(5).integers(-300, 300, (11, 13, 17)).astype(np.int16)
    got, info = read(save(tmp_path / "v.vti", image(values), form, bits, big=big))
    assert info.stored_type == "int16"
    assert np.array_equal(got, values)


def test_an_inline_volume_may_be_larger_than_any_tag(tmp_path) -> None:
    values = np.random.default_rng(6).integers(0, 256, (100, 120, 140)).astype(np.uint8)
    assert np.array_equal(read(save(tmp_path / "v.vti", image(values), "inline"))[0], values)


@pytest.mark.parametrize("form", ["ascii", "raw", "base64 zlib"])
@pytest.mark.parametrize("name", [*_TYPES])
def test_every_type_keeps_its_values(tmp_path, name, form) -> None:
    values, info = read(save(tmp_path / "v.vti", image(noise(_TYPES[name])), form))
    kept = {"i1": "int16", "u1": "uint8", "i2": "int16", "u2": "uint16", "f4": "float32", "f8": "float32"}
    assert info.stored_type == kept.get(_TYPES[name], "uint8")
    assert np.array_equal(values, noise())


@pytest.mark.parametrize("form", ["raw", "base64 zlib", "inline"])
def test_the_array_that_is_marked_as_scalars_is_read(tmp_path, form) -> None:
    grid = image(noise())
    grid.point_data["a"] = np.zeros(12, np.float32)
    grid.point_data["w"] = noise("uint8").ravel() + 1
    grid.cell_data["c"] = np.zeros(grid.n_cells)
    grid.point_data.active_scalars_name = "w"
    values, _ = read(save(tmp_path / "v.vti", grid, form))
    assert np.array_equal(values, noise() + 1)


def test_several_arrays_of_which_none_is_marked_are_refused_by_name(tmp_path) -> None:
    grid = image(noise())
    grid.point_data["w"] = noise().ravel()
    file = edited(save(tmp_path / "v.vti", grid), ' Scalars="v"', "")
    error = refusal_at_open(file)
    assert error.code == "VP1141"
    assert "'v', 'w'" in str(error)


def test_a_single_array_needs_no_mark(tmp_path) -> None:
    file = save(tmp_path / "v.vti", image(noise()), "inline")
    assert np.array_equal(read(edited(file, ' Scalars="v"', ""))[0], noise())


def test_arrays_that_are_no_scalars_of_the_points_are_refused(tmp_path) -> None:
    grid = pyvista.ImageData(dimensions=(3, 3, 3))
    assert refusal_at_open(save(tmp_path / "none.vti", grid)).code == "VP1141"
    grid.cell_data["c"] = np.arange(8.0)
    error = refusal_at_open(save(tmp_path / "cells.vti", grid))
    assert error.code == "VP1141"
    assert "cells" in str(error)
    grid.point_data["colour"] = np.zeros((27, 3), np.uint8)
    grid.point_data.active_scalars_name = "colour"
    error = refusal_at_open(save(tmp_path / "colour.vti", grid))
    assert error.code == "VP1141"
    assert "3 components" in str(error)


@pytest.mark.parametrize(
    ("code", "old", "new"),
    [
        ("VP1289", 'type="ImageData"', 'type="PolyData"'),
        ("VP1142", 'byte_order="LittleEndian"', 'byte_order="Middle"'),
        ("VP1142", 'header_type="UInt32"', 'header_type="UInt16"'),
        ("VP1142", 'header_type="UInt32"', 'compressor="vtkLZ4DataCompressor"'),
        ("VP1142", 'encoding="raw"', 'encoding="hex"'),
        ("VP1142", 'format="appended"', 'format="binaries"'),
        ("VP1142", 'type="Int16"', 'type="String"'),
        ("VP1142", 'offset="0"', 'offset="-8"'),
        ("VP1140", 'Extent="0 3 0 0 0 2"', 'Extent="0 3 0 0 2 0"'),
        ("VP1140", 'Extent="0 3 0 0 0 2"', 'Extent="0 3 0 0 0"'),
        ("VP1140", 'Extent="0 3 0 0 0 2"', 'Extent="0 3 0 0 0 99999999999999"'),
        ("VP1140", 'Piece Extent="0 3 0 0 0 2"', 'Piece Extent="0 3 0 0 0 1"'),
        ("VP1140", 'Origin="0 0 0"', 'Origin="0 0"'),
        ("VP1140", "   _", "   -"),
        ("VP1140", '<?xml version="1.0"?>', "<!DOCTYPE VTKFile>"),
        ("VP2021", 'Spacing="1 1 1"', 'Spacing="1 -1 1"'),
        ("VP2021", 'Spacing="1 1 1"', 'Spacing="1 nan 1"'),
        ("VP2021", 'Spacing="1 1 1"', 'Spacing="1 1e300 1"'),
        ("VP2021", 'Origin="0 0 0"', 'Origin="0 inf 0"'),
        ("VP2020", 'Direction="1 0 0 0 1 0', 'Direction="1 0.6 0 0 0.8 0'),
        ("VP2021", 'Direction="1 0 0', 'Direction="1 0.1 0'),
        ("VP2021", 'Direction="1 0 0', 'Direction="2 0 0'),
        ("VP2021", 'Direction="1 0 0', 'Direction="nan 0 0'),
        ("VP2021", 'Direction="1 0 0', 'Direction="0 0 0'),
        ("VP1141", 'Scalars="v"', 'Scalars="w"'),
        ("VP1008", 'offset="0"', 'offset="999999"'),
        ("VP1008", 'type="Int16"', 'type="Int32"'),
    ],
)
def test_headers_that_cannot_be_trusted_are_refused(tmp_path, code, old, new) -> None:
    file = save(tmp_path / "v.vti", image(noise()))
    if old.startswith("<?xml"):
        file.write_bytes(f"{old}\n".encode() + file.read_bytes())
    assert refusal_at_open(edited(file, old, new)).code == code


def test_several_pieces_and_images_are_refused(tmp_path) -> None:
    file = save(tmp_path / "v.vti", image(noise()), "inline")
    whole = file.read_text()
    piece = whole[whole.index("<Piece") : whole.index("</Piece>") + 8]
    file.write_text(whole.replace(piece, piece * 2))
    assert refusal_at_open(file).code == "VP1142"
    picture = whole[whole.index("<ImageData") : whole.index("</ImageData>") + 12]
    file.write_text(whole.replace(picture, picture * 2))
    assert refusal_at_open(file).code == "VP1140"


@pytest.mark.parametrize(
    "text",
    [
        "<VTKFile",
        "<VTKFile></VTK>",
        '<VTKFile type="ImageData"><a>',
        '<VTKFile type="ImageData">' + "<a/>" * 10_001 + "</VTKFile>",
        '<VTKFile type="' + "x" * 2**22 + '"/>',
        "<VTKFile>" + "<a>" * 20_000,
    ],
)
def test_xml_that_is_broken_or_without_end_is_refused(tmp_path, text) -> None:
    (tmp_path / "v.vti").write_text(text)
    assert refusal_at_open(tmp_path / "v.vti").code == "VP1140"


def test_entities_that_grow_without_end_are_refused(tmp_path) -> None:
    lol = "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 10))
    text = f'<!DOCTYPE VTKFile [<!ENTITY l0 "lol">{lol}]><VTKFile type="&l9;"/>'
    (tmp_path / "v.vti").write_text(text)
    assert refusal_at_open(tmp_path / "v.vti").code == "VP1140"


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("last", [2, 30_000, 2_147_483_646])
def test_declared_sizes_beyond_the_file_are_refused_before_anything_is_allocated(tmp_path, form, last) -> None:
    file = save(tmp_path / "v.vti", image(noise(shape_zyx=(2, 3, 4))), form)
    edited(file, 'Extent="0 3 0 2 0 1"', f'Extent="0 {last} 0 {last} 0 {last}"')
    error = refusal(file) if last == 2 else refusal_at_open(file)
    assert error.code == "VP1008"


@pytest.mark.parametrize(
    "words",
    [(0, 2048, 0), (1, 0, 0), (2**32 - 1, 2048, 24), (1, 24, 25), (3, 12, 0), (1, 24, 0, 2**32 - 1), (2, 12, 0, 10)],
)
@pytest.mark.parametrize("form", ["raw zlib", "base64 zlib"])
def test_tables_of_blocks_that_lie_are_refused(tmp_path, words, form) -> None:
    file = save(tmp_path / "v.vti", image(noise()), form)
    data = file.read_bytes()
    start = data.index(b"_", data.index(b"<AppendedData")) + 1
    table = struct.pack(f"<{len(words)}I", *words)
    if form == "base64 zlib":
        old = bytearray(base64.b64decode(data[start : start + 24]))
        old[: len(table)] = table
        table = base64.b64encode(bytes(old))
    file.write_bytes(data[:start] + table + data[start + len(table) :])
    if words == (2, 12, 0, 10):  # a table that could be right, but its blocks are not
        assert refusal(file).code in {"VP1005", "VP1008"}
    else:
        assert refusal_at_open(file).code == ("VP1142" if words[0] > 2**22 else "VP1008")


def test_a_block_that_unpacks_to_more_than_it_says_is_refused(tmp_path) -> None:
    values = noise(shape_zyx=(40, 30, 20))
    file = save(tmp_path / "v.vti", image(values), "raw zlib")
    data = bytearray(file.read_bytes())
    start = data.index(b"_", data.index(b"<AppendedData")) + 1
    count, block, last = struct.unpack("<3I", data[start : start + 12])
    assert count > 2
    # Each block one voxel shorter, the last one longer by as many: the sum is right, and no block is.
    data[start : start + 12] = struct.pack("<3I", count, block - 2, last + 2 * (count - 1))
    file.write_bytes(data)
    assert refusal(file).code == "VP1005"


def test_base64_that_is_padded_before_its_end_is_refused(tmp_path) -> None:
    file = save(tmp_path / "v.vti", image(noise("uint8", (64, 64, 64))), "inline")
    data = bytearray(file.read_bytes())
    place = data.index(b"\n", data.index(b"<DataArray")) + 1
    place += len(data[place:]) - len(data[place:].lstrip())
    # At the end of a piece, where the decoder itself sees nothing wrong.
    data[place + 2**18 - 4 : place + 2**18] = b"AA=="
    file.write_bytes(data)
    assert refusal(file).code == "VP1005"


def test_base64_that_is_none_is_refused(tmp_path) -> None:
    file = save(tmp_path / "v.vti", image(noise()), "inline")
    data = bytearray(file.read_bytes())
    place = data.index(b">", data.index(b"<DataArray")) + 30
    data[place] = ord("!")
    file.write_bytes(data)
    assert refusal(file).code == "VP1005"


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("form", FORMS)
def test_a_cut_anywhere_is_refused_or_harmless(tmp_path, form) -> None:
    check_every_cut(save(tmp_path / "v.vti", image(noise()), form), step=2)


def test_an_oblique_head_survives_the_way_through_vtk(scans, tmp_path) -> None:
    values, info = read(scans / "flair_pair" / "FLAIR.nii.gz")
    spacing, origin = info.grid.spacing_mm_zyx[::-1], info.grid.origin_mm_xyz
    grid = image(values, spacing=spacing, origin=origin)
    grid.direction_matrix = np.array(info.grid.direction)
    got, got_info = read(save(tmp_path / "head.vti", grid, "raw zlib"))
    assert np.array_equal(got, values)
    # VTK writes the direction with six digits: 5e-7 over 160 mm.
    np.testing.assert_allclose(got_info.grid.world_from_index, info.grid.world_from_index, rtol=0, atol=1e-5)
