"""The error that a step makes: rays with fine samples, drawn in segments as shaders do it.

A ray is cut into equal segments and drawn with one sample for each, or, with pre-integrated tables, with the exact
light of a straight segment. The truth are pieces so short that shorter ones change nothing.

Where the scene lights samples, rays are lit by a headlight, whatever the light is. The angle of a surface changes
faster along a ray than its opacity: on a ball and on a masked head of 20 to 36 voxels, steps of 0.35 to 1 voxel had 3
to 6 times the error with a headlight, and the worst view of `validate` had the same.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import Compositing
from volprep.kernels import _native
from volprep.parts.programs.patch_rays import PatchRays
from volprep.plan.probe import PictureDifference, difference, worst
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Tolerance

STEP_SHARE = 0.25
"""Part of the tolerance that samples may take; codes may take a half."""
_VOXELS = (2.0, 1.4, 1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.125)
"""Steps that are tried, in voxels of the level. Half as long is four times as exact; beyond 2 a few rays do not tell
what small things samples miss."""
_BETWEEN = 4
"""Pieces of a fine sample whose light is the truth where samples are lit."""
_SEEN = 1 / 510
"""Rays of less opacity than a rounding of 8 bits do not count: many of them would make a bad step look good."""


def in_voxels(number: float) -> str:
    """Write a number of voxels."""
    return "1 voxel" if number == 1 else f"{number:.3g} voxels"


def longest_step(
    bench: "StepBench", voxel_mm: float, tolerance: Tolerance, usual: float, margin: float = 1.0
) -> tuple[float, str]:
    """Return the longest step in voxels whose error is within its part of the tolerance, and the reason.

    The sample of rays may take `margin` of that part, because some views are worse than the sample.
    Rays that see nothing are no evidence: then the step is the `usual` one.
    """
    if not bench.sees:
        return usual, "as usual: no ray of a sample sees anything, so that nothing was measured"
    limit = PictureDifference(STEP_SHARE * tolerance.rmse, STEP_SHARE * tolerance.maximum)
    part = f"a quarter of the tolerance ({limit.text})"
    beyond = ""
    for voxels in _VOXELS:
        error = bench.error(voxels * voxel_mm)
        if error.rmse <= margin * limit.rmse and error.maximum <= limit.maximum:
            return voxels, f"a sample of rays is off by {error.text}, within {part}{beyond}"
        beyond = f"; {in_voxels(voxels)} would be off by {error.text}"
    return _VOXELS[
        -1
    ], f"a sample of rays is off by {error.text}, more than {part}: no step that was tried is fine enough"


class _Case(NamedTuple):
    table: Table
    values: Float64Array  # [sample, ray]
    truth: Float64Array  # [ray, 4]
    headlight: Float64Array | None  # [sample, ray], if samples are lit


class StepBench:
    """Rays, and their light in truth."""

    def __init__(
        self, compositing: Compositing, tables: Sequence[Table], rays: PatchRays, *, is_segments: bool
    ) -> None:
        """Take transfer functions; `is_segments` says whether segments are classified, not samples."""
        self._segments = is_segments
        self._compositing = compositing
        self._fine_mm = rays.step_mm
        self._headlight = None if is_segments else rays.headlight
        self._cases: list[_Case] = []
        for table in tables:
            truth = self._truth(rays.values, table)
            seen = truth[:, 3] > _SEEN
            views = [np.flatnonzero(seen[view]) + view.start for view in rays.views]
            self._cases += [self._case(rays, table, view, truth) for view in views if len(view)]

    @property
    def sees(self) -> bool:
        """Whether any ray shows anything."""
        return bool(self._cases)

    def error(self, step_mm: float) -> PictureDifference:
        """Return the worst error of any function in any view, over the rays that show something; `sees` must hold."""
        return worst([difference(self._light(case, step_mm), case.truth) for case in self._cases])

    def _light(self, case: "_Case", step_mm: float) -> Float64Array:
        if self._segments:
            return self._segments_light(case.values, case.table, step_mm)
        return self._samples_light(case.values, case.table, step_mm, case.headlight)

    def _case(self, rays: PatchRays, table: Table, chosen: NDArray[np.intp], truth: Float64Array) -> "_Case":
        """Return chosen rays with a function, and their light in truth."""
        values = rays.values.take(chosen, axis=1)
        if self._headlight is None:
            return _Case(table, values, truth[chosen], None)
        headlight = self._headlight.take(chosen, axis=1)
        between = (np.arange(_BETWEEN * len(values)) + 0.5) / _BETWEEN
        exact = self._of_samples(_at(values, between), self._fine_mm / _BETWEEN, table, _at(headlight, between))
        return _Case(table, values, exact, headlight)

    def _truth(self, rays: Float64Array, table: Table) -> Float64Array:
        """Return the light of straight pieces between fine samples; where no such light is known, of the samples."""
        if "preintegrated" in self._compositing.classifications:
            return self._segments_light(rays, table, self._fine_mm)
        return self._compositing.rays(rays, self._fine_mm, table, "nearest")

    def _of_samples(
        self, values: Float64Array, step_mm: float, table: Table, headlight: Float64Array | None
    ) -> Float64Array:
        """Return the light of samples [sample, ray] that lie so far apart."""
        if headlight is None or self._compositing.lit_rays is None:
            return self._compositing.rays(values, step_mm, table, "nearest")
        return self._compositing.lit_rays(values, step_mm, table, "nearest", headlight)

    def _samples_light(
        self, rays: Float64Array, table: Table, step_mm: float, headlight: Float64Array | None
    ) -> Float64Array:
        count, segment_mm = self._cut(rays, step_mm)
        ends = np.linspace(0.0, len(rays), count + 1)
        middles = (ends[:-1] + ends[1:]) / 2
        shown = None if headlight is None else _at(headlight, middles)
        return self._of_samples(_at(rays, middles), segment_mm, table, shown)

    def _segments_light(self, rays: Float64Array, table: Table, step_mm: float) -> Float64Array:
        pieces, piece_mm = self._cut(rays, step_mm)
        light = np.empty((rays.shape[1], 4))
        _native.straight_light(rays, pieces, piece_mm, *table.points, light)
        return light

    def _cut(self, rays: Float64Array, step_mm: float) -> tuple[int, float]:
        """Return how many equal segments, none longer than the step, rays are cut into; and their length."""
        length_mm = len(rays) * self._fine_mm
        count = max(1, int(np.ceil(length_mm / step_mm - 1e-3)))
        return count, length_mm / count


def _at(rays: Float64Array, places: Float64Array) -> Float64Array:
    """Return the values of rays [sample, ray] at places in samples from their ends, linear between two."""
    inside = np.clip(places - 0.5, 0.0, len(rays) - 1)
    lower = np.minimum(inside.astype(np.intp), max(len(rays) - 2, 0))
    share = (inside - lower)[:, None]
    values: Float64Array = rays[lower] + share * (rays[np.minimum(lower + 1, len(rays) - 1)] - rays[lower])
    return values
