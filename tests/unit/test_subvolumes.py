"""Where level 0 is cut, what meets at each point of the grid, and which way leads on."""

import math
from itertools import pairwise, product

import numpy as np
import pytest

from volprep.lab.walk.walker import moves_for_view, step_from
from volprep.parts.subvolumes.cuts import boxes_zyx, cuts_along, grid_points
from volprep_formats.package.parts.subvolumes.record import Subvolume, SubvolumeGrid, ViewThresholds

VIEW = ViewThresholds()


def grid_of(shape_zyx: tuple[int, int, int], size: int) -> SubvolumeGrid:
    z, y, x = (cuts_along(n, size) for n in shape_zyx)
    count = (len(z) - 1) * (len(y) - 1) * (len(x) - 1)
    return SubvolumeGrid(
        shape_zyx=shape_zyx,
        size=size,
        cuts_zyx=(z, y, x),
        texture_format="r8unorm",
        dimension="3d",
        subvolumes=(Subvolume(minimum=0, maximum=0),) * count,
        points=grid_points((z, y, x)),
        view=VIEW,
    )


@pytest.mark.parametrize("size", [2, 3, 128])
@pytest.mark.parametrize("voxels", [1, 2, 3, 127, 128, 129, 255, 894])
def test_pieces_share_one_voxel_and_none_is_lost(voxels: int, size: int) -> None:
    cuts = cuts_along(voxels, size)
    pieces = [range(low, high + 1) for low, high in pairwise(cuts)]
    assert sorted({voxel for piece in pieces for voxel in piece}) == list(range(voxels))
    assert all(len(piece) <= size for piece in pieces)
    assert all(len(set(a) & set(b)) == 1 for a, b in pairwise(pieces))
    # No piece is there for nothing.
    assert len(pieces) == max(1, math.ceil((voxels - 1) / (size - 1)))


def test_between_any_two_neighbouring_voxels_one_piece_holds_both() -> None:
    volume = np.zeros((9, 10, 11), int)
    for box in boxes_zyx(tuple(cuts_along(n, 4) for n in volume.shape)):
        cells = tuple(slice(each.start, each.stop - 1) for each in box)
        volume[cells] += 1
    assert (volume[:-1, :-1, :-1] == 1).all()


@pytest.mark.parametrize("pieces_zyx", [(4, 4, 4), (2, 3, 5), (1, 2, 8), (1, 1, 1)], ids=str)
def test_every_kind_of_point_is_there_as_often_as_geometry_says(pieces_zyx: tuple[int, int, int]) -> None:
    r, q, p = (count + 1 for count in pieces_zyx)
    points = grid_points(tuple(tuple(range(count + 1)) for count in pieces_zyx))
    kinds = [point.kind for point in points]
    assert len(points) == p * q * r
    assert kinds.count("corner") == 8
    assert kinds.count("column edge") == 4 * (q - 2)
    assert kinds.count("edge") == 4 * (p - 2) + 4 * (r - 2)
    assert kinds.count("plane") == 2 * ((p - 2) * (q - 2) + (q - 2) * (r - 2) + (p - 2) * (r - 2))
    assert kinds.count("interior") == (p - 2) * (q - 2) * (r - 2)
    touching = {"corner": 1, "edge": 2, "column edge": 2, "plane": 4, "interior": 8}
    legal = {"corner": 3, "edge": 4, "column edge": 4, "plane": 5, "interior": 6}
    for point in points:
        assert len(point.subvolumes) == touching[point.kind]
        assert len(point.moves) == legal[point.kind]


def test_points_are_numbered_x_first_and_touch_the_pieces_beside_them() -> None:
    points = grid_points(((0, 1, 2), (0, 1, 2), (0, 1, 2)))
    # The published example: 3×3×3 points; +z from point 0 leads to 9, +x from there to 10.
    grid = grid_of((3, 3, 3), 2)
    assert step_from(grid, 0, ["+z"]) == 9
    assert step_from(grid, 9, ["+x"]) == 10
    assert points[0].subvolumes == (0,)
    assert points[0].moves == ("+x", "+y", "+z")
    assert points[13].subvolumes == tuple(range(8))
    assert points[26].subvolumes == (7,)
    assert points[5].subvolumes == (1, 3)


def test_even_cuts_are_as_many_and_differ_by_a_voxel() -> None:
    for voxels, size in ((2, 2), (45, 12), (78, 65), (100, 100), (101, 100), (1000, 7)):
        cuts = cuts_along(voxels, size, even=True)
        steps = np.diff(cuts)
        assert (cuts[0], cuts[-1], len(cuts)) == (0, voxels - 1, len(cuts_along(voxels, size)))
        assert steps.max() < size
        assert steps.max() - steps.min() <= 1


def test_no_move_leads_out_of_the_grid() -> None:
    grid = grid_of((5, 4, 7), 3)
    nz, ny, nx = (count + 1 for count in grid.counts_zyx)
    for point, direction in product(range(len(grid.points)), product((-1, 0, 1), repeat=3)):
        if direction == (0, 0, 0):
            continue
        target = step_from(grid, point, moves_for_view(direction, VIEW))
        here, there = np.transpose(np.unravel_index([point, target], (nz, ny, nx)))
        # Whoever looks along a diagonal of the grid goes along it, as far as the grid reaches.
        np.testing.assert_array_equal(there, np.clip(here + direction[::-1], 0, (nz - 1, ny - 1, nx - 1)))


def test_a_mirrored_view_gives_the_mirrored_moves() -> None:
    generator = np.random.default_rng(7)
    for direction in generator.normal(size=(500, 3)):
        for axis, name in enumerate("xyz"):
            mirrored = direction.copy()
            mirrored[axis] *= -1
            swap = {f"+{name}": f"-{name}", f"-{name}": f"+{name}"}
            expected = {swap.get(move, move) for move in moves_for_view(direction, VIEW)}
            assert set(moves_for_view(mirrored, VIEW)) == expected


def test_every_view_leads_somewhere_and_never_backwards() -> None:
    generator = np.random.default_rng(8)
    for direction in generator.normal(size=(2000, 3)):
        moves = moves_for_view(direction, VIEW)
        step = np.zeros(3)
        for move in moves:
            step["xyz".index(move[1])] += 1 if move[0] == "+" else -1
        assert moves
        cosine = step @ direction / np.linalg.norm(step) / np.linalg.norm(direction)
        # Moves along the diagonals of a cube leave no direction further away than this.
        assert cosine > math.cos(math.radians(35))
