"""Damaged OpenVDB files: each is checked before OpenVDB reads it, so that it neither crashes nor needs much memory."""

import struct
from pathlib import Path

import pytest
from header_files import read, refusal_at_open
from long_runs import share_of
from vdb_files import TILE, HandGrid, write_vdb_by_hand
from write_anew import write_anew

from .mutations import assert_survives, outcome, prefixes
from .subjects import VDB, read_volume, sound_file

pytest.importorskip("volprep_formats._vdb", reason="this build has no OpenVDB")

pytestmark = pytest.mark.usefixtures("kept_workers")

COUNT = share_of(2000)


@pytest.fixture(scope="module")
def sound() -> bytes:
    return sound_file(VDB)


@pytest.mark.longer
def test_damaged_files_are_read_or_refused_with_a_code(sound, tmp_path) -> None:
    outcomes = assert_survives(sound, ".vdb", read_volume, tmp_path, count=COUNT, seed=3)
    assert outcomes.total() == COUNT
    assert outcomes["VP1200"] > COUNT / 2
    assert not {"VP1270", "VP1271", "VP1272", "VP1273"} & outcomes.keys()


def test_every_beginning_of_a_file_is_refused(sound, tmp_path) -> None:
    file = tmp_path / "cut.vdb"
    for data in prefixes(sound, most=300):
        write_anew(file, data)
        assert outcome(file, read_volume, f"prefix {len(data)}") in {"VP1200", "VP1002"}


def test_every_hundredth_of_a_real_file_is_refused(scans: Path, tmp_path) -> None:
    whole = (scans / "vdb" / "sphere.vdb").read_bytes()
    file = tmp_path / "cut.vdb"
    for percent in range(1, 100):
        write_anew(file, whole[: len(whole) * percent // 100])
        assert outcome(file, read_volume, f"{percent} %") == "VP1200"


ZIP, BLOSC = 1, 4
BLOCK_BYTES = 4 * 32**3


@pytest.mark.parametrize("compression", [ZIP, BLOSC])
def test_blocks_that_are_not_compressed_are_read_though_others_could_be(tmp_path, compression) -> None:
    values, _ = read(write_vdb_by_hand(tmp_path / "v.vdb", HandGrid({(0, 0, 0): 3.0}, compression=compression)))
    assert values.shape == (TILE, TILE, TILE)
    assert (values == 3.0).all()


# OpenVDB 10 reads as many bytes as the file says into a buffer of BLOCK_BYTES, whatever their number.
@pytest.mark.parametrize("compression", [ZIP, BLOSC])
@pytest.mark.parametrize("said_bytes", [BLOCK_BYTES + 2**26, BLOCK_BYTES + 1, BLOCK_BYTES - 1, 2**63 - 1])
def test_a_block_that_is_larger_than_its_node_overwrites_nothing(tmp_path, compression, said_bytes) -> None:
    grid = HandGrid({(0, 0, 0): 3.0}, compression=compression, said_bytes=said_bytes)
    path = write_vdb_by_hand(tmp_path / "v.vdb", grid)
    path.write_bytes(path.read_bytes() + bytes(2**22))  # enough to write over what is not the node's
    error = refusal_at_open(path)
    assert (error.code, "says that it has another size" in str(error)) == ("VP1200", True)


@pytest.mark.parametrize("corner", [1, -1, 2048, 4097, 2**31 - 1])
def test_a_node_that_does_not_lie_where_nodes_do_is_refused(tmp_path, corner) -> None:
    error = refusal_at_open(
        write_vdb_by_hand(tmp_path / "v.vdb", HandGrid({(0, 0, 0): 3.0}, corner_xyz=(0, corner, 0)))
    )
    assert (error.code, "does not lie where nodes do" in str(error)) == ("VP1200", True)


def with_root(folder: Path, tiles: bytes, tile_count: int, child_count: int = 0) -> Path:
    """A file whose root has these tiles and no node."""
    path = write_vdb_by_hand(folder / "v.vdb", HandGrid({}, background=2.5))
    data = path.read_bytes()
    root = struct.pack("<ifII", 1, 2.5, 0, 0)
    at = data.index(root)
    # The two ends of the grid stand before its body.
    begin = data.index(struct.pack("<q", len(data))) - 8
    end = struct.pack("<q", len(data) + len(tiles))
    changed = data[:at] + struct.pack("<ifII", 1, 2.5, tile_count, child_count) + tiles
    path.write_bytes(changed[: begin + 8] + end + end + changed[begin + 24 :])
    return path


def tile(*corner_xyz: int, active: int = 1) -> bytes:
    return struct.pack("<iiifB", *corner_xyz, 7.0, active)


def test_a_tile_of_the_root_is_taken_for_voxels(tmp_path) -> None:
    error = refusal_at_open(with_root(tmp_path, tile(0, 0, 4096), 1))
    assert (error.code, "4096×4096×4096" in str(error)) == ("VP1205", True)


@pytest.mark.parametrize(
    ("tiles", "counts", "said"),
    [
        (tile(0, 0, 0) + tile(0, 0, 0), (2, 0), "two nodes lie at the same place"),
        (tile(0, 0, 0, active=2), (1, 0), "neither active nor inactive"),
        (tile(0, 0, 0), (2**32 - 1, 0), "longer than its remaining bytes"),
        (tile(0, 0, 0), (1, 2**32 - 1), "longer than its remaining bytes"),
    ],
    ids=["twice", "active", "tiles", "children"],
)
def test_a_root_that_contradicts_itself_is_refused(tmp_path, tiles, counts, said) -> None:
    error = refusal_at_open(with_root(tmp_path, tiles, *counts))
    assert (error.code, said in str(error)) == ("VP1200", True)


@pytest.mark.parametrize("length", [2**32 - 1, 2**31, 2**27])
@pytest.mark.parametrize("text", [b"density", b"Tree_float_5_4_3", b"class", b"string", b"fog volume", b"AffineMap"])
def test_no_room_is_made_for_a_text_that_is_longer_than_the_file(tmp_path, text, length) -> None:
    path = write_vdb_by_hand(tmp_path / "v.vdb", HandGrid({(0, 0, 0): 3.0}))
    said = struct.pack("<I", len(text)) + text
    data = path.read_bytes()
    assert data.count(said) == 1
    path.write_bytes(data.replace(said, struct.pack("<I", length) + text))
    error = refusal_at_open(path)
    assert (error.code, "longer than its remaining bytes" in str(error)) == ("VP1200", True)


def test_a_text_that_is_no_text_is_shown_without_its_bytes(tmp_path) -> None:
    path = write_vdb_by_hand(tmp_path / "v.vdb", HandGrid({(0, 0, 0): 3.0}))
    path.write_bytes(path.read_bytes().replace(b"AffineMap", b"\xff\x1b[31m\nap"))
    error = refusal_at_open(path)
    assert (error.code, "\x1b" in str(error)) == ("VP1200", False)
    assert "??[31m?ap" in str(error)


def test_a_grid_whose_name_is_no_text_is_read(tmp_path) -> None:
    path = write_vdb_by_hand(tmp_path / "v.vdb", HandGrid({(0, 0, 0): 3.0}))
    path.write_bytes(path.read_bytes().replace(b"density", b"dens\xff\xfey"))
    values, _ = read(path)
    assert (values == 3.0).all()
