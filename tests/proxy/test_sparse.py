"""The blocks that the tree of an OpenVDB file tells of are those that its voxels tell of."""

import numpy as np
import pytest
from vdb_files import HandGrid, write_vdb_by_hand

from volprep.kernels import _native
from volprep.parts.proxy.sparse import ranges_of_tree
from volprep.parts.skip.occupancy import occupied_blocks
from volprep.parts.texels import texels_of
from volprep.plan.records import CropPlan, QuantizePlan
from volprep.scan.block_ranges import block_ranges
from volprep_formats.progress import Silent
from volprep_formats.readers.vdb.reader import open_volume
from volprep_formats.source import SourceSpec

_vdb = pytest.importorskip("volprep_formats._vdb", reason="this build has no OpenVDB")


TEXELS = {8: "R8", 16: "R16F"}


def check_same(path, block, *, bits=8, window=(0.0, 1.0), crop=None, grid=None):
    """Both ways, exactly, and at least one block of each kind where there are many."""
    with open_volume(SourceSpec(path=str(path), grid=grid), path, Silent()) as source:
        shape = source.info.grid.shape_zyx
        part = CropPlan(start_zyx=(0, 0, 0), stop_zyx=shape) if crop is None else crop(shape)
        voxels = source.read_slab(0, shape[0])[tuple(map(slice, part.start_zyx, part.stop_zyx))]
        quantize = QuantizePlan(bits=bits, window=window)
        sparse = ranges_of_tree(source, part, quantize, block, TEXELS[bits])
    codes = np.empty(voxels.shape, np.uint8 if bits == 8 else np.uint16)
    _native.quantize(np.ascontiguousarray(voxels), 1.0, 0.0, *window, codes, np.zeros(2**bits, np.uint64))
    texels = texels_of(codes, TEXELS[bits])
    dense = block_ranges(lambda z0, z1: texels[z0:z1], texels.shape, block)
    assert np.array_equal(sparse.low, dense.low)
    assert np.array_equal(sparse.high, dense.high)
    table = np.where(np.arange(256) > 20, 1.0, 0.0)
    occupied = occupied_blocks(sparse, table)
    assert np.array_equal(occupied, occupied_blocks(dense, table))
    return occupied


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", ["smoke", "sphere"])
@pytest.mark.parametrize("block", [3, 8])
def test_real_trees_tell_the_same_blocks(scans, name, block):
    occupied = check_same(scans / "vdb" / f"{name}.vdb", block, window=(-0.5, 2.0))
    assert occupied.any()


def test_a_part_of_a_tree_and_wide_codes_too(scans):
    def part(shape):
        z, y, x = shape
        return CropPlan(start_zyx=(5, 3, z // 7), stop_zyx=(z - 4, y - 9, x - 2))

    check_same(scans / "vdb" / "smoke.vdb", 8, bits=16, window=(0.0, 1.5), crop=part)


def test_sparse_voxels_over_a_background(tmp_path):
    rng = np.random.default_rng(2)
    values = np.where(rng.random((37, 41, 29)) < 0.002, rng.random((37, 41, 29)), 0.0).astype(np.float32)
    fog = _vdb.FogVolume("density", np.eye(4).tolist())
    fog.add(-11, values)
    fog.write(str(tmp_path / "fog.vdb"))
    for block in (1, 2, 7, 64):
        occupied = check_same(tmp_path / "fog.vdb", block)
        assert occupied.any()


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("corner", [(0, 0, 0), (-4096, 4096, -4096)])
def test_tiles_and_background_are_told_without_their_voxels(tmp_path, corner):
    tiles = {(0, 0, 0): 0.4, (1, 0, 0): 0.9, (0, 1, 1): 0.05}
    grid = HandGrid(tiles=tiles, background=0.02, corner_xyz=corner)
    path = write_vdb_by_hand(tmp_path / "tiles.vdb", grid)
    occupied = check_same(path, 50)
    assert 0 < occupied.mean() < 1
