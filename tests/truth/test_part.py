"""The true picture of a part of a volume: parts side by side make the picture of the whole."""

from itertools import pairwise

import numpy as np
import pytest
from tiny_packages import function

from volprep.compositing import COMPOSITINGS
from volprep.truth.camera import standard_views, view_from
from volprep.truth.oracle import OraclePicture
from volprep.truth.part import picture_of_part
from volprep.truth.projection import projected_values
from volprep.truth.volume import Medium, Volume
from volprep_formats.grid import Grid

HW = (20, 26)
GRID = Grid.of((7, 9, 11), (1.7, 1.0, 0.8))
CODES = np.random.default_rng(4).integers(0, 256, GRID.shape_zyx).astype(np.uint8)
FUNCTION = function((60.0, (0.9, 0.1, 0.0), 0.0), (255.0, (0.1, 0.8, 1.0), 0.6), name="ramp")
EXTENT = np.array(GRID.extent_mm_zyx[::-1])
CUTS = [(0.0, 2.6, 5.2, EXTENT[0]), (0.0, 3.5, 4.0, EXTENT[1]), (0.0, 4.1, EXTENT[2])]
CAMERAS = {
    **{f"{name}-orthographic": view for name, view in standard_views(GRID).items()},
    **{f"{name}-perspective": view for name, view in standard_views(GRID, "perspective").items()},
    "near": view_from(GRID, (-2.0, 3.0, 20.0), "perspective"),
}


VOLUME = Volume(CODES, GRID)


def draw(volume, matrix, shape_hw):
    return COMPOSITINGS["emission-absorption"].oracle([Medium(volume, FUNCTION)], matrix, shape_hw)


def part(matrix, low, high, how=draw):
    return picture_of_part(how, VOLUME, matrix, HW, (np.array(low), np.array(high)))


@pytest.mark.parametrize("name", CAMERAS)
def test_a_part_that_is_the_whole_has_its_picture(name):
    matrix = CAMERAS[name].box_from_clip(GRID, HW[1] / HW[0])
    whole, found = draw(VOLUME, matrix, HW), part(matrix, np.zeros(3), EXTENT)
    assert whole.rgba[..., 3].max() > 0.5
    assert (np.abs(found.rgba - whole.rgba).max(axis=-1) <= found.bound + whole.bound + 1e-12).all()


@pytest.mark.parametrize(
    "name", ["anterior-left-orthographic", "anterior-right-perspective", "left-perspective", "near"]
)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_parts_behind_each_other_make_the_picture_of_the_whole(name, axis):
    camera = CAMERAS[name]
    matrix = camera.box_from_clip(GRID, HW[1] / HW[0])
    slabs = []
    for low, high in pairwise(CUTS[axis]):
        ends = np.stack([np.zeros(3), EXTENT])
        ends[:, axis] = low, high
        slabs.append(part(matrix, *ends))
    # Slabs have an order for each ray: with the axis, or against it.
    forth, back = (composited([slab.rgba for slab in order]) for order in (slabs, slabs[::-1]))
    whole = draw(VOLUME, matrix, HW)
    bound = whole.bound + sum(slab.bound for slab in slabs) + 1e-12
    errors = np.minimum(np.abs(forth - whole.rgba).max(axis=-1), np.abs(back - whole.rgba).max(axis=-1))
    assert whole.rgba[..., 3].max() > 0.5
    assert (errors <= bound).all()


def composited(pictures):
    total = np.zeros((*HW, 4))
    for picture in pictures:
        total += (1 - total[..., 3:]) * picture
    return total


def test_the_greatest_value_of_all_parts_is_that_of_the_whole():
    matrix = CAMERAS["anterior-left-orthographic"].box_from_clip(GRID, HW[1] / HW[0])

    def values(volume, camera, shape_hw):
        value, error = projected_values("maximum", volume, camera, shape_hw)
        rgba = np.zeros((*shape_hw, 4))
        rgba[..., 0] = np.nan_to_num(value)
        return OraclePicture(rgba, np.nan_to_num(error))

    whole = values(VOLUME, matrix, HW).rgba[..., 0]
    greatest = np.zeros(HW)
    for x0, x1 in pairwise(CUTS[0]):
        for y0, y1 in pairwise(CUTS[1]):
            for z0, z1 in pairwise(CUTS[2]):
                found = part(matrix, (x0, y0, z0), (x1, y1, z1), values).rgba[..., 0]
                assert found.max() > 0
                greatest = np.maximum(greatest, found)
    np.testing.assert_allclose(greatest, whole, atol=1e-9)


def test_a_part_beside_a_ray_is_not_seen():
    matrix = CAMERAS["left-orthographic"].box_from_clip(GRID, HW[1] / HW[0])
    low, high = (1.0, 2.0, 3.0), (2.0, 4.0, 6.0)
    found = part(matrix, low, high).rgba[..., 3] > 0
    near = np.stack(np.meshgrid(*[np.arange(n) for n in HW], indexing="ij"), axis=-1)
    clip = np.stack(
        [(2 * near[..., 1] + 1) / HW[1] - 1, 1 - (2 * near[..., 0] + 1) / HW[0], -np.ones(HW), np.ones(HW)], axis=-1
    )
    places = clip @ matrix.T
    expected = ((places[..., 1:3] > low[1:]) & (places[..., 1:3] < high[1:])).all(axis=-1)
    assert expected.any()
    assert np.array_equal(found, expected)
