"""Light at single places by path tracing, which the path tracer's pictures and fields of light are compared with."""

import numpy as np

from volprep.kernels import _native
from volprep.truth.path_traced import LitVolume
from volprep_formats.arrays import Float64Array


def traced_places(
    lit: LitVolume, places_mm_xyz: Float64Array, paths: int, seed: int = 1
) -> tuple[Float64Array, Float64Array]:
    """Return the light [n, 3] at places [n, 3] in box space, and the variances [n, 3] of these means.

    Errors as `traced_picture`.
    """
    places = np.ascontiguousarray(places_mm_xyz, dtype=np.float64)
    light, variance = np.empty_like(places), np.empty_like(places)
    _native.trace_places(**lit.native(), places_mm_xyz=places, paths=paths, seed=seed, light=light, variance=variance)
    return light, variance
