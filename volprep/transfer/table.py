"""A transfer function as arrays: the one place that says what it is at a value, between points, and at a jump."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.package.transfer_function import TransferFunction


@dataclass(frozen=True)
class Table:
    """A transfer function as values and what is between them, linearly interpolated."""

    values: Float64Array
    """Physical values, ascending; two equal ones make a jump."""
    colour: Float64Array
    """Linear RGB, [value, 3]."""
    extinction_per_mm: Float64Array
    """Extinction."""
    reference_mm: float = 1.0
    """Length of the path whose opacity a value has where a picture knows no path."""
    isovalue: float | None = None
    """Physical value of the surface that is shown, if one is."""
    intensities: tuple[float, float] = (0.0, 1.0)
    """Physical values that count as the intensities 0 and 1."""

    @classmethod
    def exact(cls, function: TransferFunction) -> "Table":
        """The function itself."""
        return cls(
            np.array([point.value for point in function.points]),
            np.array([point.colour for point in function.points]),
            np.array([point.extinction_per_mm for point in function.points]),
            function.reference_mm,
            function.isovalue,
            function.intensity_range,
        )

    def at(self, values: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Colour [n, 3] and extinction per millimetre [n] at physical values [n]; at a jump the mean of both sides."""
        channels = np.column_stack([self.colour, self.extinction_per_mm])
        # The upper neighbour, as the limit from below and from above sees it; both agree where there is no jump.
        below, above = (
            self._between(channels, values, np.searchsorted(self.values, values, side=side))
            for side in ("left", "right")
        )
        mean = (below + above) / 2
        return mean[:, :3], mean[:, 3]

    def largest_extinction(self, low: float, high: float) -> float:
        """Return the largest extinction per millimetre of any value from `low` to `high`, ends included."""
        inside = self.extinction_per_mm[(self.values >= low) & (self.values <= high)]
        ends = np.interp([low, high], self.values, self.extinction_per_mm)
        return float(max(*ends, *inside))

    def resampled(self, window: tuple[float, float], entries: int) -> "Table":
        """The lookup table of `entries` texels over `window`."""
        values = np.linspace(*window, entries)
        return self._with(values)

    def around_isovalue(self) -> "Table":
        """The same function with the isovalue, and what float64 has beside it, among its values, each of them once."""
        if self.isovalue is None:
            return self
        beside = np.nextafter(self.isovalue, (-np.inf, np.inf))
        values = np.unique(np.concatenate([self.values, [beside[0], self.isovalue, beside[1]]]))
        return self._with(values)

    def _with(self, values: Float64Array) -> "Table":
        colour, extinction_per_mm = self.at(values)
        return replace(self, values=values, colour=colour, extinction_per_mm=extinction_per_mm)

    def _between(self, channels: Float64Array, values: Float64Array, upper: NDArray[np.intp]) -> Float64Array:
        last = len(self.values) - 1
        low, high = np.clip(upper - 1, 0, last), np.clip(upper, 0, last)
        distance = self.values[high] - self.values[low]
        weight = np.divide(values - self.values[low], distance, out=np.zeros_like(values), where=distance > 0)
        result: Float64Array = channels[low] + weight[:, None] * (channels[high] - channels[low])
        return result
