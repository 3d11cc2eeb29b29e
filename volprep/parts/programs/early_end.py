"""Early ray termination: whether rays end where they are opaque enough, from how many samples lie behind that.

Each sample then asks whether it is the last one, which costs time too. It was measured on six scans with 15 transfer
functions, llvmpipe: where 0 to 12 % of the samples lay behind, pictures took 2 to 20 % longer with it; 15 % were even;
22 to 63 % made pictures without it take 1.1 to 2.4 times as long.

A sample that is lit costs more, so that fewer of them behind pay. Measured on three scans (engine, head, shell;
llvmpipe, time of the processor): a sample that shows something costs 2.4 to 5.0 times that of an unlit sample more
with a headlight on normals that are held, 6.5 to 14 on differences that the shader takes; a light with a place costs
3.4 to 17 more. Where rays beside each other show something at different places, all of them wait, so that the least of
the numbers is counted.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep.parts.case import Case
from volprep.scene.scene import Scene
from volprep.techniques import TECHNIQUES
from volprep.transfer.rays import segments
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.texture import SampleFilter
from volprep_formats.package.transfer_function import TransferFunction

AUTO_CUTOFF = 0.998
"""Default opacity cutoff of rays: no pixel is off by more than half a step of 8 bits."""
LEAST_SHARE = 0.15
"""Part of the samples that must lie behind it, where none is lit."""
_QUESTION = LEAST_SHARE / (1.0 - LEAST_SHARE)
"""Cost of the opacity test, in samples without light: if this fraction of the samples lies behind, testing the others
costs as much as it saves."""
_LIT_BY_HELD, _LIT_BY_SLOPES = 2.4, 6.5
"""Cost of lighting a visible sample, in samples without light: with stored normals, and with differences of values."""
KIND = "early-end"
"""Kind of its item of the plan."""


@dataclass(frozen=True)
class EarlyEnd:
    """Early ray termination of one channel or of several."""

    opacity: float
    """Bound on the opacity of any ray."""
    behind: float
    """Part of the samples that lie behind the point where a ray passes the cutoff."""
    saved: float
    """Cost of these samples, in samples without light, divided by the number of all samples."""

    @property
    def pays(self) -> bool:
        """Whether the samples saved outweigh the cost of the test."""
        return self.saved >= _QUESTION * (1.0 - self.behind)

    def cutoff(self, scene: Scene) -> float | None:
        """Return the opacity cutoff of rays; None if they run to their end."""
        if _never(scene) is not None:
            return None
        cutoff = cutoff_of(scene)
        if scene.editable:
            return cutoff if cutoff < 1.0 else None
        pays = scene.render.opacity_cutoff != "auto" or self.pays
        return cutoff if self.opacity > cutoff and pays else None


def cutoff_of(scene: Scene) -> float:
    """Return the opacity cutoff that the rays of a scene would have."""
    wanted = scene.render.opacity_cutoff
    return AUTO_CUTOFF if wanted == "auto" else wanted


def most(found: Sequence[EarlyEnd]) -> EarlyEnd:
    """Return what holds for all channels together: what the most opaque of them gains counts."""
    return EarlyEnd(
        max(ending.opacity for ending in found),
        max(ending.behind for ending in found),
        max(ending.saved for ending in found),
    )


def early_end_of(case: Case) -> EarlyEnd:
    """Return the early end of the rays of one channel."""
    quantize = case.values.quantize
    # Rounding to a code, and to an entry of the lookup table, may reach a little beyond the values of the source.
    first, last = quantize.window
    slack = (last - first) * (1 / 255 + 1 / (case.values.entries - 1))
    low, high = case.measured.statistics.minimum - slack, case.measured.statistics.maximum + slack
    # The largest extinction of any value of the source, along the whole diagonal.
    largest_per_mm = max(Table.exact(function).largest_extinction(low, high) for function in case.functions)
    opacity = 1.0 - math.exp(-largest_per_mm * math.hypot(*case.grid.extent_mm_zyx))
    spacing_mm_zyx, cutoff = case.info.grid.spacing_mm_zyx, cutoff_of(case.scene)
    rays_zyx, light = case.measured.rays_zyx, light_cost(case.scene)
    behind = behind_cutoff(case.functions, rays_zyx, spacing_mm_zyx, quantize.filter, cutoff, light)
    return EarlyEnd(opacity, *behind)


def light_cost(scene: Scene) -> float:
    """Return the cost of light, in samples without light, for a visible sample."""
    if scene.render.lighting == "none":
        return 0.0
    return _LIT_BY_HELD if scene.lighting.normals == "volume" else _LIT_BY_SLOPES


def behind_cutoff(  # noqa: PLR0917 - rays and their parameters
    functions: Sequence[TransferFunction],
    rays_zyx: Sequence[Float64Array],
    spacing_mm_zyx: Sequence[float],
    between: SampleFilter,
    cutoff: float,
    light: float,
) -> tuple[float, float]:
    """Return the largest `behind` and the largest `saved` of `EarlyEnd`, each over all transfer functions.

    `rays_zyx` are physical values along each axis, [voxel, ray]; rays go both ways. `light` is the result of
    `light_cost`.
    """
    shares = [
        _shares(Table.exact(function), rays_zyx, spacing_mm_zyx, between, cutoff, light) for function in functions
    ]
    return max(behind for behind, _ in shares), max(saved for _, saved in shares)


def _shares(  # noqa: PLR0917 - as above
    table: Table,
    rays_zyx: Sequence[Float64Array],
    spacing_mm_zyx: Sequence[float],
    between: SampleFilter,
    cutoff: float,
    light: float,
) -> tuple[float, float]:
    enough = -math.log1p(-cutoff) if cutoff < 1.0 else math.inf
    behind = shown = samples = 0
    for rays, spacing_mm in zip(rays_zyx, spacing_mm_zyx, strict=True):
        for columns in (rays, rays[::-1]):
            depth = np.zeros(columns.shape[1])
            for values, step_mm in segments(columns, spacing_mm, between):
                extinction = np.interp(values, table.values, table.extinction_per_mm)
                depths = depth + np.cumsum(extinction * step_mm, axis=0)
                hidden = depths > enough
                behind += int(hidden.sum())
                shown += int((hidden & (extinction > 0.0)).sum())
                samples += depths.size
                depth = depths[-1]
    return behind / max(samples, 1), (behind + light * shown) / max(samples, 1)


def _never(scene: Scene) -> str | None:
    if not COMPOSITINGS[scene.render.compositing].ends_early:
        return f"with compositing {scene.render.compositing} every sample of a ray may count"
    if not TECHNIQUES[scene.render.technique].loops:
        return f"with technique {scene.render.technique} a fragment takes one sample"
    return None


def describe_early_end(found: EarlyEnd, cutoff: float | None, scene: Scene) -> PlanItem:
    """Return whether rays end early, and why."""
    reason = _never(scene)
    if reason is not None:
        return PlanItem(name="early ray termination", kind=KIND, kept=False, reason=reason)
    wanted = cutoff_of(scene)
    reason = (
        f"the most opaque values, along the whole diagonal, give opacity {found.opacity:.6g}; rays may end at "
        f"{wanted:g}; {found.behind:.1%} of the samples of rays lie behind that"
    )
    if light_cost(scene) > 0.0:
        reason = f"{reason}, which cost as much as {found.saved:.1%} without light"
    if cutoff is None and found.opacity > wanted:
        reason = f"{reason}; testing each sample costs more time than that"
    if scene.editable:
        reason = f"{reason}, and users may edit transfer functions"
    return PlanItem(name="early ray termination", kind=KIND, kept=cutoff is not None, reason=reason)
