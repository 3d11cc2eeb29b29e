"""Media whose sum is a colour volume, so that the oracle of several media integrates it exactly.

A colour volume emits light e and absorbs with an extinction t, both trilinear fields: the integral of e exp(-∫ t). The
oracle knows media that emit a colour times their extinction. Red of colour (k, 0, 0) with the extinction r / k emits r;
green and blue likewise; and a black medium absorbs the rest, t - (r + g + b) / k, which is not negative where light is
at most the extinction of its voxel. All four are trilinear again.
"""

from collections.abc import Sequence

import numpy as np

from volprep.truth.volume import Medium, Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint

_LIGHT = 4096.0
"""k: 3 would be enough for texels whose light is at most their extinction. Compressed blocks mix texels, and may leave
light in voxels that are nearly clear: there black is 0, and the extinction is too large by at most 3 / k of that light.
"""


def media_of_colour(channels: Sequence[Medium]) -> list[Medium]:
    """Return the media of the channels red, green, blue and opacity of a colour volume."""
    largest_per_mm = channels[-1].transfer_function.points[-1].extinction_per_mm
    red, green, blue, opacity = (_physical(channel) for channel in channels)
    black = np.maximum(opacity - (red + green + blue) / _LIGHT, 0.0)
    lights = np.eye(4, 3) * _LIGHT
    scales = (1 / _LIGHT, 1 / _LIGHT, 1 / _LIGHT, 1.0)
    return [
        Medium(
            Volume(values.astype(np.float32), channel.volume.grid),
            _line(channel.transfer_function.name, light, scale * largest_per_mm),
        )
        for channel, values, light, scale in zip(channels, (red, green, blue, black), lights, scales, strict=True)
    ]


def _physical(channel: Medium) -> Float64Array:
    volume = channel.volume
    return volume.slope * volume.stored.astype(np.float64) + volume.intercept


def _line(name: str, light: Float64Array, per_mm: float) -> TransferFunction:
    """Return the function with the extinction value · per_mm. Colours of functions in packages end at 1."""
    red, green, blue = light.tolist()
    points = (
        TransferPoint.model_construct(value=value, colour=(red, green, blue), extinction_per_mm=value * per_mm)
        for value in (0.0, 1.0)
    )
    return TransferFunction.model_construct(name=name, points=tuple(points))
