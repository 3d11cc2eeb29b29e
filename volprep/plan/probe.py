"""Picture error of a choice of codes and of a lookup table, measured on a sample of rays.

The rays run along the axes through voxel centres, because the standard views do: a structure that is thin along one of
them may be wide along another. Between two voxels the field is linear, so that a voxel that the window clips moves the
surfaces beside it here as it does in the renderer; labels fill their voxels.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep.truth.seen import seen_pixels
from volprep_formats.arrays import Float64Array

SHARE = 0.5
"""Part of the scene's tolerance that the codes may use; the rest is for the level, the step and the arithmetic."""
_NOTHING = 1e-12


@dataclass(frozen=True)
class Quantizer:
    """How values become texels."""

    bits: int
    """8 or 16."""
    window: tuple[float, float]
    """Physical values of the texels 0.0 and 1.0."""
    half_floats: bool = False
    """Whether codes of 16 bits become half floats."""

    def texels(self, values: Float64Array) -> Float64Array:
        """Round physical values to the values of the texture, from 0 to 1."""
        low, high = self.window
        largest = 2**self.bits - 1
        codes: Float64Array = np.rint((np.clip(values, low, high) - low) / (high - low) * largest) / largest
        return codes.astype(np.float16).astype(np.float64) if self.bits == 16 and self.half_floats else codes

    def decoded(self, texels: Float64Array) -> Float64Array:
        """Physical values of texels."""
        low, high = self.window
        return low + texels * (high - low)


@dataclass(frozen=True)
class PictureDifference:
    """Difference of two pictures, premultiplied linear values from 0 to 1."""

    rmse: float
    """Root mean square over seen rays and channels."""
    maximum: float
    """Largest difference of one channel of one ray."""

    @property
    def text(self) -> str:
        """The numbers for people."""
        # Below this it is the rounding of double precision, which says nothing about codes.
        if self.maximum < _NOTHING:
            return "nothing"
        return f"RMSE {self.rmse:.2g}, {self.maximum:.2g} at most"


def difference(one: Float64Array, other: Float64Array, weights: Float64Array | None = None) -> PictureDifference:
    """Compare two pictures [..., 4] over seen rays. Others are no evidence: they would make any error look small.

    `weights` [...] of the rays count in the mean; they are equal if absent.
    """
    seen = seen_pixels(one, other)
    error = one[seen] - other[seen]
    if not error.size:
        return PictureDifference(0.0, 0.0)
    squares = np.average((error**2).mean(axis=-1), weights=None if weights is None else weights[seen])
    return PictureDifference(rmse=float(np.sqrt(squares)), maximum=float(np.abs(error).max()))


def difference_of_views(one: Sequence[Float64Array], other: Sequence[Float64Array]) -> PictureDifference:
    """Compare pictures along several axes: the worst counts, as the worst view does."""
    return worst([difference(*pair) for pair in zip(one, other, strict=True)])


def worst(errors: Sequence[PictureDifference]) -> PictureDifference:
    """Return the largest of each number."""
    return PictureDifference(max(error.rmse for error in errors), max(error.maximum for error in errors))
