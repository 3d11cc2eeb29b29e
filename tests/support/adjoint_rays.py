"""A small level, a table with its slopes, and rays: for tests of adjoints of the light of rays."""

import numpy as np

from volprep.parts.levels.rays import RaySegments

SHAPE = (3, 5, 4)
SPACING = (1.5, 1.0, 0.75)
TABLE = np.column_stack([np.linspace(0.1, 0.9, 33), np.linspace(0.7, 0.2, 33), np.full(33, 0.5), np.linspace(0, 2, 33)])
SLOPES = np.ascontiguousarray(np.repeat(np.diff(TABLE[:2], axis=0) * 32, 33, axis=0))


def random_lines() -> RaySegments:
    """Return 21 rays between random points of the level."""
    generator = np.random.default_rng(2)
    extent = np.array(SHAPE[::-1]) * SPACING[::-1]
    starts, ends = generator.uniform(0, 1, (2, 21, 3)) * extent
    lengths = np.linalg.norm(ends - starts, axis=1)
    return RaySegments(starts, (ends - starts) / lengths[:, None], lengths)
