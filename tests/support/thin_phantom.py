"""A small volume of thin things: a body, a shell one voxel thick, vessels of one and two voxels, specks."""

import numpy as np

from volprep_formats.grid import Grid
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint

SHAPE_ZYX = (49, 62, 55)
SPACING_MM_ZYX = (1.0, 0.9, 1.0)
GRID = Grid.of(SHAPE_ZYX, SPACING_MM_ZYX)


def thin_things() -> np.ndarray:
    """Give codes, uint8 [z, y, x]: body about 90, shell and vessels about 200, and noise."""
    rng = np.random.default_rng(11)
    z, y, x = np.meshgrid(*(np.arange(n) * h for n, h in zip(SHAPE_ZYX, SPACING_MM_ZYX, strict=True)), indexing="ij")
    distance = np.sqrt(((z - 24) / 1.1) ** 2 + (y - 27) ** 2 + (x - 27) ** 2)
    codes = np.where(distance < 19, 90.0, 8.0)
    codes[np.abs(distance - 22) < 0.6] = 205
    for k in range(7):
        phase = 2 * np.pi * k / 7
        path_y = 27 + 13 * np.cos(phase + z / 9)
        path_x = 27 + 13 * np.sin(phase + z / 9)
        codes[np.hypot(y - path_y, x - path_x) < (0.7 if k % 2 else 1.2)] = 190 + 5 * k
    return np.clip(np.rint(codes + rng.normal(0, 3, SHAPE_ZYX)), 0, 255).astype(np.uint8)


def function(name: str, *points: tuple[float, tuple[float, float, float], float]) -> TransferFunction:
    """Make a transfer function of values, linear colours and extinctions."""
    made = (TransferPoint(value=value, colour=colour, extinction_per_mm=tau) for value, colour, tau in points)
    return TransferFunction(name=name, points=tuple(made))


VEIL = function(
    "veil",
    (40, (0.2, 0.3, 0.6), 0.0),
    (90, (0.4, 0.5, 0.8), 0.006),
    (150, (0.9, 0.4, 0.2), 0.1),
    (220, (1, 0.9, 0.6), 0.7),
)
SOLID = function("solid", (60, (0.3, 0.2, 0.1), 0.0), (120, (0.8, 0.6, 0.4), 0.5), (200, (1.0, 0.95, 0.8), 1.5))
