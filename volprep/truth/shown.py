"""Apply a transfer function to one value per pixel: the last step of all projections.

A projection has no path length, so the opacity of its value is that of a fixed length, the reference length of the
transfer function: alpha = 1 - exp(-extinction · reference).
"""

from itertools import pairwise

import numpy as np

from volprep.truth.oracle import OraclePicture
from volprep_formats.arrays import Float64Array
from volprep_formats.package.transfer_function import TransferFunction

_EPSILON = float(np.finfo(np.float64).eps)
_MOST_PER_MM = 1e9
"""Extinction above this counts as this, as in the other oracle."""


def shown_picture(
    value: Float64Array, error: Float64Array, function: TransferFunction, reference_mm: float
) -> OraclePicture:
    """Return the picture of values [height, width] that are known up to `error`; NaN is a ray that misses the box.

    The bound of a pixel is the change of the transfer function between value - error and value + error. Raises
    ValueError if the reference length is not above 0.
    """
    if not reference_mm > 0.0:
        msg = f"reference_mm is {reference_mm:g}; it must be above 0"
        raise ValueError(msg)
    hit = ~np.isnan(value)
    shown = _Shown(function, reference_mm)
    picture = OraclePicture(rgba=np.zeros((*value.shape, 4)), bound=np.zeros(value.shape))
    picture.rgba[hit] = shown.at(value[hit])
    picture.bound[hit] = shown.change(value[hit] - error[hit], value[hit] + error[hit]) + shown.rounding(value[hit])
    return picture


class _Shown:
    """Colour of a value in a transfer function, premultiplied, with the opacity of the reference length."""

    def __init__(self, function: TransferFunction, reference_mm: float) -> None:
        self._values = np.array([point.value for point in function.points])
        self._colours = np.array([point.colour for point in function.points])
        extinctions = np.minimum([point.extinction_per_mm for point in function.points], _MOST_PER_MM)
        self._depths = extinctions * reference_mm

    def at(self, values: Float64Array) -> Float64Array:
        """Return [n, RGBA] of values [n]."""
        # Of two points at one value np.interp takes the second at the value itself: the side above.
        alpha = self._alpha(np.interp(values, self._values, self._depths))
        colour = np.stack([np.interp(values, self._values, channel) for channel in self._colours.T], axis=-1)
        return np.concatenate([colour * alpha[:, None], alpha[:, None]], axis=-1)

    def change(self, low: Float64Array, high: Float64Array) -> Float64Array:
        """Bound the difference of any two values from `low` [n] to `high` [n] in any channel.

        Between two control points the opacity rises or falls, and the colour changes evenly: a premultiplied colour
        changes by at most the change of the colour times the greatest opacity, plus the change of the opacity.
        """
        total = np.zeros_like(low)
        for first, second in pairwise(range(len(self._values))):
            start, end = self._values[first], self._values[second]
            if start == end:
                total += np.where((low < start) & (start <= high), self._jump(first, second), 0.0)
                continue
            places: Float64Array = (np.clip([low, high], start, end) - start) / (end - start)
            alpha = self._alpha(self._depths[first] + places * (self._depths[second] - self._depths[first]))
            steepest = np.abs(self._colours[second] - self._colours[first]).max()
            total += steepest * (places[1] - places[0]) * alpha.max(axis=0) + np.abs(alpha[1] - alpha[0])
        return total

    def rounding(self, values: Float64Array) -> Float64Array:
        """Bound the rounding error of `at`: depths are interpolated up to some units in the last place of the most."""
        transmittance = 1.0 - self.at(values)[:, 3]
        rounding: Float64Array = 16.0 * _EPSILON * (1.0 + self._depths.max() * transmittance)
        return rounding

    def _jump(self, first: int, second: int) -> float:
        alpha = self._alpha(self._depths[[first, second]])
        rgba = np.column_stack([self._colours[[first, second]] * alpha[:, None], alpha])
        return float(np.abs(rgba[1] - rgba[0]).max())

    @staticmethod
    def _alpha(depths: Float64Array) -> Float64Array:
        alpha: Float64Array = -np.expm1(-depths)
        return alpha
