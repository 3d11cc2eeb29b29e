"""Integral tables as a package holds them: sums of the transfer function from the lowest value on.

The mean of the function over all values between the two ends of a ray segment is a difference of two sums, divided by
the difference of the values. A sum is a whole number of 32 bits, in the four bytes of a texel, and shaders subtract
bytes, which is exact. Between two entries the function counts as constant, with its mean: a segment within two entries
has exactly that mean, and needs no quotient of small differences.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array, UInt8Array

LARGEST_SUM = 2**32 - 1
"""The sum of extinction over the whole window."""
LEAST_ENTRIES = 1e-3
"""Ends that are nearer to each other than this part of the distance of two entries count as one value."""


@dataclass(frozen=True)
class IntegralTable:
    """Sums of colour times extinction and of extinction, as whole numbers."""

    ends: tuple[float, float]
    """Physical values of the first and the last entry; beyond them the sums go on as between the two outermost ones."""
    sums: Float64Array
    """[entry, 4]: sums up to the entry of red, green and blue times extinction, and of extinction; 0 to LARGEST_SUM."""
    mean_per_mm: float
    """Extinction of a segment over all entries whose sum grows by LARGEST_SUM."""

    @classmethod
    def of_texels(cls, texels: NDArray[np.generic], ends: tuple[float, float], mean_per_mm: float) -> "IntegralTable":
        """Decode the texels that a package holds, [1, 4, entry, RGBA]."""
        sums = texels[0].astype(np.float64) @ (256.0 ** np.arange(4))
        return cls(ends, np.ascontiguousarray(sums.T), mean_per_mm)

    @property
    def texels(self) -> UInt8Array:
        """Texels [1, 4, entry, RGBA]: rows are red, green, blue and extinction, bytes of a sum the lowest first."""
        whole = np.ascontiguousarray(self.sums.T, dtype="<u4")
        return whole.view(np.uint8).reshape(1, 4, len(self.sums), 4)

    @property
    def between(self) -> tuple[Float64Array, Float64Array]:
        """Mean colours [entry - 1, 3] and extinctions per millimetre [entry - 1] between entries."""
        return self._medium(np.diff(self.sums, axis=0))

    @property
    def steps(self) -> tuple[Float64Array, Float64Array, Float64Array]:
        """The function that a segment between two entries sees, as points: values, colours, extinctions."""
        values = np.linspace(*self.ends, len(self.sums)).repeat(2)[1:-1]
        colour, extinction = self.between
        colour, extinction = colour.repeat(2, axis=0), extinction.repeat(2)
        # Points that lie on the line of their neighbours cost the oracle time, and say nothing.
        medium = np.column_stack([colour, extinction])
        same = (medium[1:] == medium[:-1]).all(axis=1)
        kept = ~np.append(False, same) | ~np.append(same, False)
        return values[kept], colour[kept], extinction[kept]

    def at(self, front: Float64Array, back: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Colour [..., 3] and mean extinction [...] of segments between physical values."""
        last = len(self.sums) - 1
        low, high = self.ends
        places = [(value - low) / (high - low) * last for value in (front, back)]
        entries = [np.clip(np.floor(place), 0, last - 1).astype(np.intp) for place in places]
        shares = [place - entry for place, entry in zip(places, entries, strict=True)]
        slopes = [self.sums[entry + 1] - self.sums[entry] for entry in entries]
        width = places[1] - places[0]
        grown = self.sums[entries[1]] - self.sums[entries[0]]
        grown = grown + shares[1][..., None] * slopes[1] - shares[0][..., None] * slopes[0]
        is_point = (np.abs(width) < LEAST_ENTRIES) | (entries[0] == entries[1])
        mean = np.where(
            is_point[..., None], (slopes[0] + slopes[1]) / 2, grown / np.where(is_point, 1.0, width)[..., None]
        )
        return self._medium(mean)

    def _medium(self, grown: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Return colour and extinction of what sums grow by over the distance of two entries."""
        per_mm = self.mean_per_mm * (len(self.sums) - 1) / LARGEST_SUM
        return grown[..., :3] / np.maximum(grown[..., 3:], 0.5), grown[..., 3] * per_mm
