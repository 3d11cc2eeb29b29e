"""Light for an environment that an app turns: the light of four environments, fitted one after the other.

The four are as bright as 1 + w · t in the direction w, with t the corners of a tetrahedron, and span all environments
that change like a cosine (volprep_formats/package/parts/light/environment.py). No light is negative, so all four are
fitted and coded as any other light. Places and random numbers are the same for each.
"""

from dataclasses import replace

import numpy as np

from volprep.parts.light.kept import KeptSamples
from volprep.parts.light.solve import LightField, solve_field
from volprep.truth.path_traced import LitVolume
from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.light.environment import CORNERS
from volprep_formats.progress import Progress

_AT_ONCE = 3
"""Environments that one set of paths estimates: one for each of red, green and blue."""


def solve_turnable(
    lit: LitVolume,
    factor: int,
    count: int,
    progress: Progress,
    kept: KeptSamples | None = None,
    *,
    curve: Float64Array | None = None,
) -> LightField:
    """Fit a field of four channels, one for each environment. Arguments as `solve_field`."""
    fields = [
        solve_field(_under(lit, CORNERS[first : first + _AT_ONCE]), factor, count, progress, kept, curve=curve)
        for first in range(0, len(CORNERS), _AT_ONCE)
    ]
    texels = np.concatenate([field.texels for field in fields], axis=4)
    return replace(fields[0], texels=texels, residual=max(field.residual for field in fields))


def _under(lit: LitVolume, corners: Float64Array) -> LitVolume:
    """Return a volume with an environment for each channel."""
    environment = np.zeros((4, _AT_ONCE))
    environment[0, : len(corners)] = 1.0
    environment[1:, : len(corners)] = corners.T
    channels = "rgb" if len(corners) > 1 else "luminance"
    # A luminance is the same in all channels.
    if channels == "luminance":
        environment = np.repeat(environment[:, :1], 3, axis=1)
    return replace(lit, model=lit.model.model_copy(update={"channels": channels}), environment=environment)
