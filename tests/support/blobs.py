"""Soft balls and single bright voxels in an empty volume; and when two pictures of them are the same."""

import numpy as np
from tiny_packages import function

DIRECTIONS = {
    "straight": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "flipped": ((-1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "turned": ((0, 0, 1), (-1, 0, 0), (0, -1, 0)),
}
SHELLS = function(
    (40.0, (0.2, 0.4, 0.9), 0.0),
    (60.0, (0.2, 0.4, 0.9), 0.6),
    (80.0, (0.9, 0.5, 0.1), 0.0),
    (190.0, (0.9, 0.5, 0.1), 0.0),
    (230.0, (1.0, 1.0, 1.0), 3.0),
)


def blobs(seed, shape, *, bits=8):
    """A few soft balls and single bright voxels in an empty volume."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1)
    field = np.zeros(shape)
    for _ in range(3):
        distance = np.linalg.norm((grid - rng.random(3) * shape) / np.array(shape), axis=-1)
        field = np.maximum(field, np.clip(1.0 - distance / rng.uniform(0.15, 0.35), 0, 1))
    field[rng.random(shape) < 0.0005] = 1.0
    return np.rint(field * (2**bits - 1)).astype(np.uint8 if bits == 8 else np.uint16)


def check_same(one, other):
    """The pictures have the same samples; the compiler may round their positions differently in another shader.

    A mosaic's coordinates, some 400 texels, round by 2.4e-5 texels. From a single bright voxel the value falls by 1 in
    a voxel, the steepest extinction rises by 19 per mm over the whole range of values, and a segment has some 0.5 mm:
    a sample's depth is off by 2.3e-4, of four such samples by 1e-3. Nearly all pixels have none.
    """
    difference = np.abs(one - other)
    assert difference.max() < 1e-3 < 1 / 255
    assert difference.mean() < 1e-6
