"""Features that frames of a time series may have, and the settings that keep still voxels still.

One plan holds for all frames. A feature that depends on the voxels of one frame is left out, or refused.
"""

from collections.abc import Iterator
from math import prod

from volprep.compositing import COMPOSITINGS
from volprep.parts.case import Case
from volprep.plan.products import FramesPlan
from volprep.plan.records import ChannelPlan
from volprep.scene.scene import Scene
from volprep.scene.wishes import refuse_any, refuse_wishes
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.textures.texel_formats import BYTES_PER_TEXEL

KIND = "frames"
"""Kind of its item of the plan."""
_FIXED: frozenset[LevelFilter] = frozenset(
    {"nearest", "bilinear", "two-step-bilinear", "box", "binomial", "gaussian", "lanczos3", "least-squares"}
)
"""Filters that make a texel from the voxels around it alone. A fit reaches four texels far."""
_EXTREMA: frozenset[LevelFilter] = frozenset({"minimum", "maximum"})
"""The same, for projections only."""
_FOR_ONE_VOLUME = (
    "[bricks]",
    "[grid]",
    "[segments]",
    "[proxy]",
    "[colour]",
    "editable",
    "skip.ranges",
    "fidelity",
    "source.labels",
    "source.mask",
    "lighting.baked",
    "textures.compression",
    "textures.flatten",
    "textures.mipmaps",
)
"""Wishes that are met by the voxels of one volume."""


def with_fixed_filter(scene: Scene, _profile: DeviceProfile, _channels: int) -> Scene:
    """Return the scene of a series with a filter of levels that gives voxels that stay the same the same texels."""
    if scene.source.frames is None or scene.pyramid.filter != "auto":
        return scene
    # Classified voxels: box means were worse than box means of values that are classified then (0.019 of 0.009).
    means: LevelFilter = "least-squares" if scene.render.classification == "preclassified" else "box"
    fixed = next(iter(_extrema(scene)), means)
    return scene.model_copy(update={"pyramid": scene.pyramid.model_copy(update={"filter": fixed})})


def require_possible(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3073 if a series is to have something that is made for one volume."""
    if scene.source.frames is None:
        return
    refuse_wishes("VP3073", scene, _FOR_ONE_VOLUME)
    others = {
        f"profile {profile.name}, which has no shaders": not profile.has_shaders,
        "[normals] that no program reads": scene.normals is not None and scene.render.lighting == "none",
        'source.nan = "outside"': scene.source.nan == "outside",
        f'pyramid.filter = "{scene.pyramid.filter}", which depends on the data': (
            scene.pyramid.filter not in _FIXED | _extrema(scene)
        ),
    }
    refuse_any("VP3073", others)


def _extrema(scene: Scene) -> frozenset[LevelFilter]:
    """Return the filter that keeps the values that a projection shows, if the scene draws one."""
    return _EXTREMA.intersection(COMPOSITINGS[scene.render.compositing].level_filters)


def plan_frames(case: Case) -> FramesPlan | None:
    """Return the frames of a series; None for one volume."""
    return FramesPlan(frames=case.frames) if case.frames else None


def describe_frames(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    """Yield the item about the frames. Its files are known when they have been made."""
    found = plan.part(FramesPlan)
    if found is None:
        return
    times = [frame.time_s for frame in found.frames if frame.time_s is not None]
    when = f" from {times[0]:.6g} to {times[-1]:.6g} s" if times else ""
    size = sum(BYTES_PER_TEXEL[volume.format] * prod(volume.shape_zyx) for volume in plan.own_volumes)
    later = len(found.frames) - 1
    repeated = later + 1 - len(case.measured.digests or {case.measured.sha256})
    reason = (
        f"{len(found.frames)} frames{when}, {size} bytes of voxels each; {repeated} of {later} later ones repeat an "
        f"earlier one; one window, step and program for all; a texture that stays the same is held once"
    )
    yield PlanItem(name="frames", kind=KIND, kept=True, reason=reason, size_bytes=size * (later - repeated))
