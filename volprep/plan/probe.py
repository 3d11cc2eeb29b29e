"""What a choice of codes and of a lookup table costs in a picture, measured on a sample of rays.

The rays run along the axes through voxel centres, because the standard views do: what is thin along one of them may be
wide along another. Between two voxels the field is linear, so that a voxel that the
window clips moves the surfaces beside it here as it does in the renderer; labels fill their voxels.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.transfer.table import Table
from volprep_formats.package.texture import SampleFilter

Array = NDArray[np.float64]

_SAMPLES = (0.25, 0.75)
"""Positions of the samples between two voxels."""
_NOTHING = 1e-12
_CHUNK = 64
"""Slices that are composited at one time."""


@dataclass(frozen=True)
class Codes:
    """How values become texels."""

    bits: int
    """8 or 16."""
    window: tuple[float, float]
    """Physical values of the texels 0.0 and 1.0."""
    half_floats: bool = False
    """Whether codes of 16 bits become half floats."""

    def texels(self, values: Array) -> Array:
        """Round physical values to what the texture holds, from 0 to 1."""
        low, high = self.window
        largest = 2**self.bits - 1
        codes: Array = np.rint((np.clip(values, low, high) - low) / (high - low) * largest) / largest
        return codes.astype(np.float16).astype(np.float64) if self.bits == 16 and self.half_floats else codes

    def decoded(self, texels: Array) -> Array:
        """Physical values of texels."""
        low, high = self.window
        return low + texels * (high - low)


@dataclass(frozen=True)
class PictureError:
    """Difference of two pictures, premultiplied linear values from 0 to 1."""

    rmse: float
    """Root mean square over all rays and channels."""
    maximum: float
    """Largest difference of one channel of one ray."""

    @property
    def text(self) -> str:
        """The numbers for people."""
        # Below this it is the rounding of double precision, which says nothing about codes.
        if self.maximum < _NOTHING:
            return "nothing"
        return f"RMSE {self.rmse:.2g}, {self.maximum:.2g} at most"


def picture(columns: Array, spacing_mm: float, table: Table, between: SampleFilter = "linear") -> Array:
    """Colour and opacity of rays, [ray, 4], premultiplied; `columns` are physical values at voxels, [voxel, ray].

    `between` says what is between two voxels: labels are not mixed.
    """
    result = np.zeros((columns.shape[1], 4))
    transmittance = np.ones(columns.shape[1])
    for samples, step_mm in _segments(columns, spacing_mm, between):
        kept = np.exp(-step_mm * np.interp(samples, table.values, table.extinction_per_mm))
        before = transmittance * np.cumprod(np.vstack([np.ones(len(transmittance)), kept]), axis=0)
        weight = before[:-1] - before[1:]
        for channel in range(3):
            result[:, channel] += (weight * np.interp(samples, table.values, table.colour[:, channel])).sum(axis=0)
        transmittance = before[-1]
    result[:, 3] = 1.0 - transmittance
    return result


def difference(one: Array, other: Array) -> PictureError:
    """Compare two pictures."""
    error = one - other
    return PictureError(rmse=float(np.sqrt(np.mean(error**2))), maximum=float(np.abs(error).max()))


def difference_of_views(one: Sequence[Array], other: Sequence[Array]) -> PictureError:
    """Compare pictures along several axes: the worst counts, as the worst view does."""
    return worst([difference(*pair) for pair in zip(one, other, strict=True)])


def worst(errors: Sequence[PictureError]) -> PictureError:
    """Return the largest of each number."""
    return PictureError(max(error.rmse for error in errors), max(error.maximum for error in errors))


def _segments(columns: Array, spacing_mm: float, between: SampleFilter) -> Iterator[tuple[Array, float]]:
    """Samples along the rays, front to back, [sample, ray], with the length that each stands for."""
    if between == "nearest":
        yield from ((columns[z0 : z0 + _CHUNK], spacing_mm) for z0 in range(0, len(columns), _CHUNK))
        return
    # Half a voxel lies outside the first and the last centre; the field is constant there.
    yield columns[:1], spacing_mm / 2
    for z0 in range(0, len(columns) - 1, _CHUNK):
        lower = columns[z0 : z0 + _CHUNK][: len(columns) - 1 - z0]
        upper = columns[z0 + 1 : z0 + _CHUNK + 1]
        inside = [lower + t * (upper - lower) for t in _SAMPLES]
        yield np.stack(inside, axis=1).reshape(-1, columns.shape[1]), spacing_mm / len(_SAMPLES)
    yield columns[-1:], spacing_mm / 2
