"""Decide whether a package has its levels in bricks on demand, and how many a device holds."""

import math
from collections.abc import Iterator, Sequence

from volprep.parts.case import Case
from volprep.parts.levels.decision import candidate_levels
from volprep.parts.programs.decision import VERTEX
from volprep.plan.products import OnDemandPlan
from volprep.plan.records import ChannelPlan, LevelPlan
from volprep.plan.room import one_channel
from volprep.plan.shape_text import shape_text
from volprep.scene.scene import Scene
from volprep.scene.wishes import refuse_any, refuse_wishes
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.on_demand.record import BrickLevel, OnDemand
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import LAID_OVER, ProgramDesign

KIND = "on-demand"
"""Kind of its item of the plan."""
_INDEX, _BRICKS = "bricks/index.bin", "bricks/bricks.bin"
_MOST_PLACES = 255
"""Bricks along an axis of the pool: places are bytes."""
_POOL_SHARE = 2
"""The pool takes this part of a device's memory for textures, as pieces of sub-volumes do; the levels have the rest."""


def require_on_demand(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3034 if the scene wants bricks on demand together with something that they do not support."""
    if scene.on_demand is None:
        return
    render = scene.render
    others = {
        f"profile {profile.name}, which has no 3D textures of OpenGL ES 3.0": profile.graphics.dialect == "es100"
        or not profile.max_3d_texture_size,
        f"compositing {render.compositing}": render.compositing not in LAID_OVER,
        f"technique {render.technique}": render.technique != "ray-casting",
        f"classification {render.classification}": render.classification in {"preclassified", "colour"},
        f"lighting {render.lighting}": render.lighting not in {"none", "headlight"},
        f"normals {scene.lighting.normals}": render.lighting != "none" and scene.lighting.normals == "volume",
        f"baked light {scene.lighting.baked}": scene.lighting.baked != "none",
        "frames of a time series": scene.source.frames is not None,
    }
    refuse_any("VP3034", others)
    refuse_wishes("VP3034", scene, ("[grid]", "[segments]", "[together]", "[colour]", "editable", "source.labels"))


def one_volume(scene: Scene, _profile: DeviceProfile, channels: int) -> Scene:
    """Raise VP3034 for bricks on demand of several channels."""
    if scene.on_demand is not None and channels > 1:
        raise VolprepError("VP3034", what=f"{channels} channels")
    return scene


def levels_on_demand(case: Case) -> Sequence[LevelPlan]:
    """Return all levels of a channel, down to one of at most two bricks along each axis."""
    wanted = case.scene.on_demand
    return () if wanted is None else candidate_levels(case.channel, case.grid, 2 * wanted.size, case.profile, "box")


def plan_on_demand(
    scene: Scene, profile: DeviceProfile, levels: Sequence[LevelPlan], bits: int, pictures: tuple[str, ...]
) -> OnDemandPlan | None:
    """Lay out levels in bricks. Raises VP3034 where the pool cannot hold the coarsest one."""
    texel = one_channel(bits, profile)
    if scene.on_demand is None:
        return None
    volume_zyx = levels[0].shape_zyx
    if texel is None:
        raise VolprepError("VP3034", what=f"profile {profile.name}, which has no format of {bits} bits")
    laid = OnDemand(
        index=_INDEX,
        bricks=_BRICKS,
        size=scene.on_demand.size,
        ghost=1 if scene.render.lighting == "none" else 2,
        levels=tuple(BrickLevel(factors_zyx=level.factors_zyx) for level in levels),
        format=texel,
        places_zyx=(1, 1, 1),
    )
    count = sum(math.prod(laid.counts_zyx(level.index, volume_zyx)) for level in levels)
    most = profile.max_texture_bytes // _POOL_SHARE // laid.brick_bytes
    laid = laid.model_copy(update={"places_zyx": _places(count, most, profile.max_3d_texture_size // laid.pitch)})
    if laid.places < math.prod(laid.counts_zyx(len(levels) - 1, volume_zyx)):
        raise VolprepError("VP3034", what=f"profile {profile.name}, whose pool of {laid.places} bricks is too small")
    programs = tuple(_program(picture, scene) for picture in pictures)
    return OnDemandPlan(**{name: getattr(laid, name) for name in OnDemand.model_fields}, programs=programs)


def _places(count: int, most: int, limit: int) -> tuple[int, int, int]:
    """Return the places of a pool for `count` bricks, but at most `most`, nearly a cube."""
    limit = max(min(limit, _MOST_PLACES), 1)

    def places(side: int, rows: int) -> tuple[int, int, int]:
        return max(min(most // (side * rows), -(-count // (side * rows)), limit), 1), rows, side

    sides = range(1, min(limit, math.isqrt(max(most, 1))) + 1)
    found = (places(side, rows) for side in sides for rows in range(side, limit + 1) if side * rows <= max(most, 1))
    return max(found, key=lambda each: (min(math.prod(each), count), -sum(each), -math.prod(each)))


def _program(picture: str, scene: Scene) -> ProgramDesign:
    name = f"on-demand-{picture}"
    return ProgramDesign(
        name=name,
        sampling="on-demand",
        compositing=scene.render.compositing,
        classification=scene.render.classification,
        lighting=scene.render.lighting,
        normals_from="volume" if scene.render.lighting == "none" else scene.lighting.normals,
        light=None,
        baked=False,
        vertex=VERTEX,
        fragment=f"shaders/{name}.frag",
        levels=(0,),
        transfer=picture,
    )


def describe_on_demand(plan: ChannelPlan) -> Iterator[PlanItem]:
    """Return whether there are bricks on demand, and why."""
    found = plan.part(OnDemandPlan)
    if found is None:
        if plan.levels[0].index > 0:
            reason = "the scene has no table [on_demand]; with it an app fetches the parts of level 0 that it shows"
            yield PlanItem(name="bricks on demand", kind=KIND, kept=False, reason=reason)
        return
    counts = shape_text(found.counts_zyx(0, plan.grid.shape_zyx))
    yield PlanItem(
        name="bricks on demand",
        kind=KIND,
        kept=True,
        reason=f"the scene asks for them: {len(found.factors_zyx)} levels, the finest of {counts} bricks of "
        f"{found.size}³ voxels; a device holds {found.places} at a time, in {found.places * found.brick_bytes} bytes",
        files=(found.index, found.bricks, *(program.fragment for program in found.programs)),
    )
