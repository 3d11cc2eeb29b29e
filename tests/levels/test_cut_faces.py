"""Rays straight at faces of the box that cut through something."""

import numpy as np
import pytest

from volprep.parts.levels.appearance import SeenBlocks
from volprep.parts.levels.cut_faces import cut_face_lines, cut_face_voxels
from volprep_formats.grid import Grid

SHAPE = (12, 16, 20)
SPACING = (1.5, 1.0, 0.75)
FACTORS = (1, 2, 2)


def blocks_of(*seen):
    """Blocks of two voxels."""
    blocks = np.zeros([n // 2 for n in SHAPE], np.bool_)
    for part in seen:
        blocks[part] = True
    return SeenBlocks(blocks, 2)


@pytest.mark.parametrize(("axis", "is_last"), [(0, False), (0, True), (1, True), (2, False)])
def test_rays_enter_where_a_block_at_a_face_is_seen(axis, is_last) -> None:
    part = [slice(2, 4)] * 3
    part[axis] = slice(-1, None) if is_last else slice(0, 1)
    blocks = blocks_of(tuple(part))
    lines = cut_face_lines(Grid.of(SHAPE, SPACING), blocks, FACTORS, 5, seed=1)
    voxels = 16 / np.prod([f for each, f in enumerate(FACTORS) if each != axis])
    assert cut_face_voxels(blocks, FACTORS) == voxels
    assert len(lines.lengths_mm) == 5 * voxels
    starts = lines.starts_mm_xyz[:, ::-1] / SPACING
    np.testing.assert_allclose(starts[:, axis], SHAPE[axis] if is_last else 0, atol=1e-9)
    across = np.delete(starts, axis, axis=1)
    assert ((across >= 4) & (across <= 8)).all()
    assert across.std(axis=0).min() > 0.5
    inwards = lines.directions_xyz[:, 2 - axis] * (-1 if is_last else 1)
    assert (inwards > 0.9).all()
    np.testing.assert_allclose(np.linalg.norm(lines.directions_xyz, axis=1), 1.0)


def test_what_ends_before_the_faces_has_no_rays() -> None:
    blocks = blocks_of((slice(1, -1), slice(1, -1), slice(1, -1)))
    assert cut_face_voxels(blocks, FACTORS) == 0
    assert len(cut_face_lines(Grid.of(SHAPE, SPACING), blocks, FACTORS, 5, seed=1).lengths_mm) == 0
