"""Light from the viewer on samples of rays: the cosine of ray and gradient, from central differences.

Gradients need six more samples for each. Only samples that show something, and that are not hidden, get them: on a
lit head one in seven.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.parts.headlight import softened_cosine
from volprep.parts.levels.rays import RaySamples, RaySegments, sample_at
from volprep.scan.slabs import RawVolume
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.parts.normals.record import HalvedAxes
from volprep_formats.package.texture import SampleFilter

_HIDDEN_DEPTH = 14.0
"""Optical depth behind which nothing changes a picture: a millionth of the light is left."""
_LONGEST_STEP = 2
"""Voxels. A sample this far behind hidden ones counts still: long steps look less deep."""


BorderSlopes = Callable[[RaySegments, NDArray[np.intp], NDArray[np.bool_]], Float64Array]
"""Returns the slopes of borders of segments [xyz, sample], in codes per millimetre, at the wanted samples: takes the
pieces of rays that these are on, how many each piece has, and which of all samples they are."""


@dataclass(frozen=True)
class Shown:
    """Visible samples: all samples if there are no `tables`."""

    tables: Sequence[Table]
    """Transfer functions; a sample that one of them shows counts."""
    window: tuple[float, float]
    """Physical values of the code 0 and the largest."""

    def samples(self, along: RaySamples, per_voxel: int) -> NDArray[np.bool_]:
        """Return which samples need light [n]; rays have `per_voxel` samples for each voxel."""
        if not self.tables:
            return np.ones(len(along.values), np.bool_)
        least, most = self._extinctions(round(1.0 / along.scale))
        code = along.values.astype(np.intp)
        shown = most[code] > 0.0
        shown[1:] |= shown[:-1]
        shown[:-1] |= shown[1:]
        counts = np.diff(along.offsets)
        depth = least[code] * np.repeat(along.lengths_mm / counts, counts)
        so_far = np.concatenate([[0.0], np.cumsum(depth)])
        begin = np.repeat(along.offsets[:-1], counts)
        before = np.maximum(np.arange(len(code)) - _LONGEST_STEP * per_voxel, begin)
        found: NDArray[np.bool_] = shown & (so_far[before] - so_far[begin] < _HIDDEN_DEPTH)
        return found

    def _extinctions(self, largest: int) -> tuple[Float64Array, Float64Array]:
        """Return the least extinction of all tables between each code and the next one, and the most of any."""
        first, last = self.window
        width = last - first or 1.0  # all codes of a scan of one value are the same
        codes = np.linspace(first, last, largest + 1)
        least, most = np.full(largest + 1, np.inf), np.zeros(largest + 1)
        for table in self.tables:
            at_codes = np.interp(codes, table.values, table.extinction_per_mm)
            following = np.append(at_codes[1:], at_codes[-1])
            lower, upper = np.minimum(at_codes, following), np.maximum(at_codes, following)
            place = np.clip((table.values - first) / width * largest, 0, largest)
            # A control point on a code belongs to both sides.
            for side in (np.floor(place), np.maximum(np.ceil(place) - 1, 0)):
                np.minimum.at(lower, side.astype(np.intp), table.extinction_per_mm)
                np.maximum.at(upper, side.astype(np.intp), table.extinction_per_mm)
            least, most = np.minimum(least, lower), np.maximum(most, upper)
        return least, most


def headlight(  # noqa: PLR0917 - a volume, rays through it, and their visible samples
    volume: RawVolume,
    spacing_mm_zyx: tuple[float, float, float],
    lines: RaySegments,
    along: RaySamples,
    wanted: NDArray[np.bool_],
    soft_per_mm: float,
    between: SampleFilter = "linear",
    *,
    halved_zyx: HalvedAxes = (False, False, False),
    borders: BorderSlopes | None = None,
) -> Float64Array:
    """Return the light at each sample: the cosine of ray and gradient, nearly 1 where slopes are below `soft_per_mm`.

    Differences are of values one voxel to each side, along `halved_zyx` half a voxel. In the outer half voxels they are
    those at the centres of the outer voxels, as in shaders. `borders` are added to them. Samples that are not `wanted`
    have 1.
    """
    result = np.ones(len(along.values))
    if not wanted.any():
        return result
    extent_mm_xyz = np.array([n * mm for n, mm in zip(volume.shape_zyx, spacing_mm_zyx, strict=True)])[::-1]
    pieces, counts = _pieces(lines, along, wanted, (np.array(spacing_mm_zyx[::-1]) / 2, extent_mm_xyz))
    apart_mm_zyx = [mm / 2 if halved else mm for mm, halved in zip(spacing_mm_zyx, halved_zyx, strict=True)]
    # To each side along x, y and z, the side of larger coordinates first.
    steps_mm = [sign * step_mm for step_mm in np.diag(apart_mm_zyx[::-1]) for sign in (1, -1)]
    beside = [RaySegments(pieces.starts_mm_xyz + step, pieces.directions_xyz, pieces.lengths_mm) for step in steps_mm]
    around = sample_at(volume, spacing_mm_zyx, RaySegments.joined(beside), np.tile(counts, len(beside)), between)
    values = around.values.reshape(len(beside), -1).astype(np.float64)
    added = np.zeros((3, values.shape[1])) if borders is None else borders(pieces, counts, wanted)
    forward, squared = np.zeros(values.shape[1]), np.zeros(values.shape[1])
    for axis, apart_mm in enumerate(apart_mm_zyx[::-1]):
        slope = (values[2 * axis] - values[2 * axis + 1]) * (around.scale / (2 * apart_mm)) + added[axis]
        forward += slope * np.repeat(pieces.directions_xyz[:, axis], counts)
        squared += slope**2
    result[wanted] = softened_cosine(forward, squared, soft_per_mm)
    return result


def _pieces(
    lines: RaySegments, along: RaySamples, wanted: NDArray[np.bool_], box_mm_xyz: tuple[Float64Array, Float64Array]
) -> tuple[RaySegments, NDArray[np.intp]]:
    """Return the pieces of rays whose samples are wanted, and how many samples each has.

    `box_mm_xyz` is half a voxel and the extent of the volume. Samples in the outer half voxels are pieces of their own,
    moved to the centres of the outer voxels.
    """
    half_mm, extent_mm = box_mm_xyz
    counts = np.diff(along.offsets)
    (number,) = np.nonzero(wanted)
    ray = np.repeat(np.arange(len(counts)), counts)[number]
    segment_mm = (along.lengths_mm / counts)[ray]
    middles_mm = (number - along.offsets[ray] + 0.5) * segment_mm
    places = lines.starts_mm_xyz[ray] + middles_mm[:, None] * lines.directions_xyz[ray]
    inner = np.clip(places, half_mm, extent_mm - half_mm)
    is_outer = (inner != places).any(axis=1)
    begins = np.ones(len(number), np.bool_)
    begins[1:] = (np.diff(number) > 1) | (np.diff(ray) > 0) | is_outer[1:] | is_outer[:-1]
    (first,) = np.nonzero(begins)
    samples = np.diff(first, append=len(number))
    directions_xyz = lines.directions_xyz[ray[first]]
    starts_mm_xyz = inner[first] - (0.5 * segment_mm[first])[:, None] * directions_xyz
    return RaySegments(starts_mm_xyz, directions_xyz, samples * segment_mm[first]), samples
