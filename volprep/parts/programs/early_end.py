"""Early ray termination: whether rays end where they are opaque enough, from how many samples lie behind that.

Each sample then asks whether it is the last one, which costs time too. Loops of OpenGL ES 2.0 ask by a break. It was
measured on six scans with 15 transfer functions, llvmpipe: where 0 to 12 % of the samples lay behind, pictures took 2
to 20 % longer with it; 15 % were even; 22 to 63 % made pictures without it take 1.1 to 2.4 times as long. Loops of
OpenGL ES 3.0 ask in their condition, which costs next to nothing: 3 % were even, 14 % made pictures without it take 1.3
times as long (tests/papers/savings.py).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep.scene.scene import Scene
from volprep.techniques import TECHNIQUES
from volprep.transfer.rays import segments
from volprep.transfer.table import Table
from volprep_formats.arrays import Float64Array
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import Api
from volprep_formats.package.texture import SampleFilter
from volprep_formats.package.transfer_function import TransferFunction

AUTO_CUTOFF = 0.998
"""Opacity at which rays end unless the scene says another: no pixel is off by more than half a step of 8 bits."""
LEAST_SHARE: dict[Api, float] = {"es2.0": 0.15, "es3.0": 0.05}
"""Part of the samples that must lie behind it, where there are shaders."""
_ITEM = "early ray termination"


@dataclass(frozen=True)
class EarlyEnd:
    """What is known of rays that end early, of one channel or of several."""

    opacity: float
    """Bound on the opacity of any ray."""
    behind: float
    """Part of the samples that lie behind the point where a ray passes the cutoff."""
    least: float
    """Part of the samples from which on it pays."""

    def cutoff(self, scene: Scene) -> float | None:
        """Return the opacity at which rays end; None if they run to their end."""
        if _never(scene) is not None:
            return None
        cutoff = cutoff_of(scene)
        if scene.editable:
            return cutoff if cutoff < 1.0 else None
        pays = scene.render.opacity_cutoff != "auto" or self.behind >= self.least
        return cutoff if self.opacity > cutoff and pays else None


def cutoff_of(scene: Scene) -> float:
    """Return the opacity at which rays of a scene would end."""
    wanted = scene.render.opacity_cutoff
    return AUTO_CUTOFF if wanted == "auto" else wanted


def most(found: Sequence[EarlyEnd]) -> EarlyEnd:
    """Return what holds for all channels together: what the most opaque of them gains counts."""
    return EarlyEnd(
        max(each.opacity for each in found), max(each.behind for each in found), min(each.least for each in found)
    )


def opaque_share(
    functions: Sequence[TransferFunction],
    rays_zyx: Sequence[Float64Array],
    spacing_mm_zyx: Sequence[float],
    between: SampleFilter,
    cutoff: float,
) -> float:
    """Return the largest share, over transfer functions, of samples behind the point where rays pass a cutoff.

    `rays_zyx` are physical values along each axis, [voxel, ray]; rays go both ways.
    """
    return max(_share(Table.exact(each), rays_zyx, spacing_mm_zyx, between, cutoff) for each in functions)


def _share(
    table: Table,
    rays_zyx: Sequence[Float64Array],
    spacing_mm_zyx: Sequence[float],
    between: SampleFilter,
    cutoff: float,
) -> float:
    enough = -math.log1p(-cutoff) if cutoff < 1.0 else math.inf
    behind = samples = 0
    for rays, spacing_mm in zip(rays_zyx, spacing_mm_zyx, strict=True):
        for columns in (rays, rays[::-1]):
            depth = np.zeros(columns.shape[1])
            for values, step_mm in segments(columns, spacing_mm, between):
                extinction = np.interp(values, table.values, table.extinction_per_mm)
                depths = depth + np.cumsum(extinction * step_mm, axis=0)
                behind += int((depths > enough).sum())
                samples += depths.size
                depth = depths[-1]
    return behind / max(samples, 1)


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
        return PlanItem(name=_ITEM, kept=False, reason=reason)
    wanted = cutoff_of(scene)
    reason = (
        f"the most opaque values, along the whole diagonal, give opacity {found.opacity:.6g}; rays may end at "
        f"{wanted:g}; {found.behind:.1%} of the samples of rays lie behind that"
    )
    if cutoff is None and found.opacity > wanted:
        reason = f"{reason}; below {found.least:.0%} it costs more time than it saves"
    if scene.editable:
        reason = f"{reason}, and users may edit transfer functions"
    return PlanItem(name=_ITEM, kept=cutoff is not None, reason=reason)
