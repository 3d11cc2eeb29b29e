"""Order of light that was computed once, in the cells of its field: the fit and the picture, without noise of paths."""

from pathlib import Path

import numpy as np
from order_bench import Falling, rmse
from order_scans import EXTENT_MM_ZYX, field, grid_of, transfer
from scene_builds import view_of

from volprep.parts.light import solve
from volprep.parts.light.solve import LightField
from volprep.parts.light.trial import baked_field
from volprep.truth.phantoms import sampled
from volprep.truth.refined import refined_picture
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid

SHAPE_ZYX = (32, 32, 32)
CURVE = np.array([[60.0, 220.0], [0.0, 1.0]])
PIXELS = 24
_CELLS = (8, 4, 2)
_PLACES = 1 << 17
_SMOOTH = 1e-4
_TOLERANCE = 1e-4


def light(box_mm: np.ndarray) -> Float64Array:
    """Return the two numbers [n, 2] of a light that is known everywhere: it falls towards one side, in waves."""
    x, y, z = np.moveaxis(box_mm, -1, 0)
    first = 0.3 + 0.6 * np.exp(-0.15 * (x + y)) + 0.1 * np.sin(0.6 * z + 0.3 * x)
    return np.stack([first, 0.2 + 0.1 * np.cos(0.5 * y - 0.4 * z)], axis=-1)


def by_cell(_folder: Path) -> Falling:
    """Errors of pictures with fields of ever smaller cells, fitted to places where the light is known."""
    grid = grid_of(SHAPE_ZYX)
    volume = sampled(field, grid).astype(np.float32)
    exact = _exact(grid_of((96, 96, 96)))
    places = np.random.default_rng(28).uniform(0.0, EXTENT_MM_ZYX[::-1], (_PLACES, 3))
    values = field(places)
    numbers = light(places)
    known = numbers[:, 0] + np.interp(values, *CURVE) * numbers[:, 1]
    samples = solve._Samples(
        np.column_stack([places, values]).astype(np.float32),
        np.repeat(known[:, None], 3, axis=1).astype(np.float32),
        np.ones(_PLACES, np.float32),
        np.zeros(_PLACES, np.float32),
    )
    truth = _drawn(volume, grid, exact)
    errors = [rmse(_drawn(volume, grid, _fitted(grid, cell, samples)), truth) for cell in _CELLS]
    return Falling(_CELLS, errors)


def _exact(fine: Grid) -> LightField:
    """Return the light itself, on cells a sixth of the smallest."""
    z, y, x = (np.linspace(0.0, mm, n) for n, mm in zip(fine.shape_zyx, fine.extent_mm_zyx, strict=True))
    nodes = np.stack(np.broadcast_arrays(x, y[:, None], z[:, None, None]), axis=-1)
    per_mm_zyx = [(n - 1) / mm for n, mm in zip(fine.shape_zyx, fine.extent_mm_zyx, strict=True)]
    texels = light(nodes)[..., None].astype(np.float32)
    return LightField(texels, CURVE, (per_mm_zyx[2], per_mm_zyx[1], per_mm_zyx[0]), 1, 0.0, 0.0)


def _fitted(grid: Grid, cell: int, samples: solve._Samples) -> LightField:
    z, y, x = (n // cell + 1 for n in grid.shape_zyx)
    per_z, per_y, per_x = ((n - 1) / mm for n, mm in zip((z, y, x), grid.extent_mm_zyx, strict=True))
    nodes = solve._NodeGrid((z, y, x), (per_x, per_y, per_z))
    sums = solve._Sums(nodes, CURVE, samples)
    sums.add(samples)
    texels, _ = sums.solved(_SMOOTH, nodes.dark(1), _TOLERANCE)
    return LightField(texels, CURVE, nodes.nodes_per_mm_xyz, _PLACES, _SMOOTH, 0.0)


def _drawn(volume: np.ndarray, grid: Grid, baked: LightField) -> Float64Array:
    camera = view_of(grid, "anterior-left")
    function = transfer().resolved()
    return refined_picture(
        Volume(volume, grid), function, camera, (PIXELS, PIXELS), 1e-5, baked=baked_field(baked, grid)
    ).rgba
