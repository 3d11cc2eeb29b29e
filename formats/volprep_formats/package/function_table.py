"""Transfer functions as arrays: the one definition of their values at points, between points and at jumps."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.package.transfer_function import TransferFunction


@dataclass(frozen=True)
class Table:
    """A transfer function sampled at ascending values, linearly interpolated in between."""

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

    @property
    def points(self) -> tuple[Float64Array, Float64Array, Float64Array]:
        """Values, colours and extinctions as native kernels take control points: each in C order."""
        return self.values, np.ascontiguousarray(self.colour), np.ascontiguousarray(self.extinction_per_mm)

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

    def with_entries(self, values: Float64Array, entries: Float64Array) -> "Table":
        """Return the function described by a level's own entries [n, 4] (colour, extinction) at ascending values [n].

        The change relative to this function is linear between entries; at a jump it goes from the change of the entry
        below to that of the entry above. Values that this function makes fully transparent stay transparent, up to the
        same value.
        """
        is_jump = np.diff(self.values, prepend=-np.inf) == 0.0
        jumps = np.unique(self.values[is_jump])
        jumps = jumps[(jumps > values[0]) & (jumps < values[-1])]
        # An entry at a jump is of neither side.
        between = ~np.isin(values, jumps)
        values, changes = values[between], (entries - np.column_stack(self.at(values)))[between]
        below = np.maximum(np.searchsorted(values, jumps) - 1, 0)
        # The upper side of a jump lies beside it while values must be different.
        above = np.nextafter(jumps, np.inf)
        at = np.concatenate([values, jumps, above])
        order = np.argsort(at)
        changes = np.concatenate([changes, changes[below], changes[np.minimum(below + 1, len(values) - 1)]])[order]
        apart = replace(self, values=np.where(is_jump, np.nextafter(self.values, np.inf), self.values))
        knots = np.union1d(values, apart.values[(apart.values > values[0]) & (apart.values < values[-1])])
        own = np.column_stack(apart.at(knots))
        found = own + np.column_stack([np.interp(knots, at[order], value) for value in changes.T])
        return replace(
            self,
            values=np.where(np.isin(knots, above), np.nextafter(knots, -np.inf), knots),
            colour=np.ascontiguousarray(np.clip(found[:, :3], 0.0, 1.0)),
            extinction_per_mm=np.where(own[:, 3] == 0.0, 0.0, np.maximum(found[:, 3], 0.0)),
        )

    def around_isovalue(self) -> "Table":
        """Return the same function with the isovalue and the float64 numbers beside it among its values, each once."""
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
        # Beside a wall of 1e9 that sum would lose a haze of 0.01.
        result[weight == 1.0] = channels[high][weight == 1.0]
        return result
