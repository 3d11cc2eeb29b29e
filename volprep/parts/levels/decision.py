"""Candidate levels of a pyramid, and the filter that makes them."""

import math
from typing import Literal

from volprep.compositing import COMPOSITINGS
from volprep.parts.levels.reduce import LABEL_FILTERS
from volprep.plan.records import LevelPlan
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import WITH_TABLES

_NEARLY_EQUAL = math.sqrt(2)
"""Spacings closer than this are halved together: of two axes the one that stays behind is never the finer one."""
_EXTREMA: frozenset[LevelFilter] = frozenset({"minimum", "maximum", "raised"})
"""Filters that move all values to one side. Tables that levels have of their own make up for it."""
_MOST_VOXELS_OF_A_BLOCK = 2**21
"""Kernels that need a block whole, such as the median's, take no larger ones."""


def filter_of(scene: Scene) -> Literal["auto"] | LevelFilter:
    """Return the filter that makes the coarser levels.

    Raises VP3024 for one that would put values between labels, VP3044 for one of classified voxels where none are,
    VP3285 for extrema that would be drawn as if they were the scan's values.
    """
    labels = scene.source.labels
    wanted = scene.pyramid.filter
    filters = COMPOSITINGS[scene.render.compositing].level_filters
    if wanted == "transmittance" and scene.render.classification != "preclassified":
        raise VolprepError("VP3044")
    own_tables = scene.render.decided_classification in WITH_TABLES and scene.segments is None
    # Baked light counts on the values of the scan.
    evened = wanted in filters if filters else own_tables and scene.lighting.baked == "none"
    if wanted in _EXTREMA and not evened:
        raise VolprepError("VP3285", filter=wanted)
    if wanted == "auto":
        return "mode" if labels else filters[0] if len(filters) == 1 else "auto"
    if labels and wanted not in LABEL_FILTERS:
        raise VolprepError("VP3024", filter=wanted, possible=", ".join(sorted(LABEL_FILTERS)))
    return wanted


def candidate_levels(
    channel: str,
    grid: Grid,
    coarsest_longest_axis: int,
    profile: DeviceProfile,
    made_by: Literal["auto"] | LevelFilter = "auto",
) -> list[LevelPlan]:
    """List the levels from level 0 down to the first whose longest axis has at most so many voxels.

    It ends earlier if a voxel of the next level would cover more than 2^21 voxels. Each halves those axes of the one
    before whose spacing is nearly the smallest, so that voxels come closer to cubes; odd sizes round up. The few slices
    of a thin stack are kept: to mix them saves little, and changes which one is seen. Where levels are mosaics only the
    longest of these axes is halved: the package holds one level, and the finest that fits loses less when the steps
    between levels are small.
    """
    factors = (1, 1, 1)
    levels: list[LevelPlan] = []
    while True:
        z, y, x = (-(-n // f) for n, f in zip(grid.shape_zyx, factors, strict=True))
        index = len(levels)
        levels.append(
            LevelPlan(
                channel=channel,
                index=index,
                factors_zyx=factors,
                shape_zyx=(z, y, x),
                filter=made_by if index else "none",
            )
        )
        if max(z, y, x) <= coarsest_longest_axis:
            return levels
        factors = _halved(grid, factors, (z, y, x), one_axis=profile.max_3d_texture_size == 0)
        if math.prod(factors) > _MOST_VOXELS_OF_A_BLOCK:
            return levels


def _halved(
    grid: Grid, factors: tuple[int, int, int], shape: tuple[int, int, int], *, one_axis: bool
) -> tuple[int, int, int]:
    spacing = [f * h for f, h in zip(factors, grid.spacing_mm_zyx, strict=True)]
    # An axis of one voxel cannot get coarser.
    longer = [axis for axis in range(3) if shape[axis] > 1]
    if grid.is_thin_stack and grid.thin_axis is not None:
        longer = [axis for axis in longer if axis != 2 - grid.thin_axis] or longer
    limit = min(spacing[axis] for axis in longer) * _NEARLY_EQUAL
    axes = [axis for axis in longer if spacing[axis] <= limit]
    if one_axis:
        axes = [max(axes, key=lambda axis: shape[axis])]
    z, y, x = (f * 2 if axis in axes else f for axis, f in enumerate(factors))
    return z, y, x
