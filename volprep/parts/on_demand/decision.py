"""Decide whether a package has its levels in bricks on demand, and how many a device holds."""

import math
from collections.abc import Iterator

from volprep.parts.case import Case
from volprep.parts.levels.decision import candidate_levels
from volprep.parts.programs.decision import VERTEX
from volprep.plan.products import OnDemandPlan
from volprep.plan.records import ChannelPlan
from volprep.plan.room import Misfit, one_channel
from volprep.scene.scene import OnDemandSettings, Scene
from volprep.scene.wishes import wish_among
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.on_demand.index import RECORD_BYTES
from volprep_formats.package.parts.on_demand.record import BrickLevel, OnDemand
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import LAID_OVER, ProgramDesign

KIND = "on-demand"
"""Kind of its item of the plan."""
_INDEX, _BRICKS = "bricks/index.bin", "bricks/bricks.bin"
_MOST_PLACES = 255
"""Bricks along an axis of the pool: places are bytes."""
POOL_SHARE = 2
"""The pool takes this part of a device's memory for textures, as pieces of sub-volumes do; the levels have the rest."""


_AUTO = OnDemandSettings(use="auto")


def settings_of(scene: Scene) -> OnDemandSettings:
    """Return the settings of the scene; without any the plan decides."""
    return scene.on_demand or _AUTO


def _unsupported(scene: Scene, profile: DeviceProfile) -> str | None:
    """Return something that a scene wants and that bricks on demand do not support; None if they support all."""
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
    wishes = ("[grid]", "[segments]", "[together]", "[colour]", "editable", "source.labels")
    return next((what for what, is_wanted in others.items() if is_wanted), None) or wish_among(scene, wishes)


def require_on_demand(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3034 if the scene insists on bricks on demand together with something that they do not support."""
    if settings_of(scene).use == "always" and (what := _unsupported(scene, profile)):
        raise VolprepError("VP3034", what=what)


def one_volume(scene: Scene, _profile: DeviceProfile, channels: int) -> Scene:
    """Return a scene of several channels without bricks on demand. Raises VP3034 if it insists on them."""
    if channels == 1:
        return scene
    if settings_of(scene).use == "always":
        raise VolprepError("VP3034", what=f"{channels} channels")
    return scene.model_copy(update={"on_demand": OnDemandSettings(use="never")})


def plan_on_demand(case: Case, finest: int) -> OnDemandPlan | Misfit:
    """Lay all levels out in bricks, or say why not; `finest` is the finest level that the device holds whole.

    Raises VP3034 if the scene insists on bricks, and the pool cannot hold the coarsest level.
    """
    settings = settings_of(case.scene)
    if settings.use == "never":
        return Misfit("the scene has several channels, or wants none")
    # Volumes that are laid out in another way have tables and programs of their own.
    other = ("[bricks]", "[proxy]", "textures.mipmaps", "textures.compression")
    what = _unsupported(case.scene, case.profile) or (settings.use == "auto" and wish_among(case.scene, other))
    if settings.use == "auto" and what:
        return Misfit(f"they do not support {what}")
    if settings.use == "auto" and finest == 0:
        return Misfit("the device holds all of level 0")
    found = _laid_out(case, settings.size)
    if isinstance(found, Misfit) and settings.use == "always":
        raise VolprepError("VP3034", what=found.reason)
    return found


def _laid_out(case: Case, size: int) -> OnDemandPlan | Misfit:
    scene, profile, bits = case.scene, case.profile, case.values.quantize.bits
    texel = one_channel(bits, profile)
    if texel is None:
        return Misfit(f"profile {profile.name}, which has no format of {bits} bits")
    levels = candidate_levels(case.channel, case.grid, 2 * size, profile, "box")
    volume_zyx = levels[0].shape_zyx
    laid = OnDemand(
        index=_INDEX,
        bricks=_BRICKS,
        size=size,
        ghost=1 if scene.render.lighting == "none" else 2,
        levels=tuple(BrickLevel(factors_zyx=level.factors_zyx) for level in levels),
        format=texel,
        places_zyx=(1, 1, 1),
    )
    count = sum(math.prod(laid.counts_zyx(level.index, volume_zyx)) for level in levels)
    most = profile.max_texture_bytes // POOL_SHARE // laid.brick_bytes
    rows = profile.max_3d_texture_size // laid.pitch
    laid = laid.model_copy(update={"places_zyx": _places(count, most, rows)})
    if min(rows, most) < 1 or laid.places < math.prod(laid.counts_zyx(len(levels) - 1, volume_zyx)):
        return Misfit(f"profile {profile.name}, whose pool does not hold the coarsest level in bricks of {size}³")
    programs = tuple(_program(function.name, scene) for function in case.functions)
    return OnDemandPlan(**{name: getattr(laid, name) for name in OnDemand.model_fields}, programs=programs)


def _places(count: int, most: int, limit: int) -> tuple[int, int, int]:
    """Return the places of a pool for `count` bricks, but at most `most`, nearly a cube."""
    limit = max(min(limit, _MOST_PLACES), 1)

    def places(side: int, rows: int) -> tuple[int, int, int]:
        return max(min(most // (side * rows), -(-count // (side * rows)), limit), 1), rows, side

    sides = range(1, min(limit, math.isqrt(max(most, 1))) + 1)
    found = (places(side, rows) for side in sides for rows in range(side, limit + 1) if side * rows <= max(most, 1))
    return max(found, key=lambda value: (min(math.prod(value), count), -sum(value), -math.prod(value)))


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


def describe_on_demand(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    """Return whether there are bricks on demand, why, and their cost."""
    found = plan.part(OnDemandPlan)
    item = PlanItem(name="bricks on demand", kind=KIND, kept=found is not None, reason="")
    if found is None:
        refused = plan_on_demand(case, plan.levels[0].index)
        if plan.levels[0].index > 0 and isinstance(refused, Misfit):
            yield item.model_copy(update={"reason": f"{refused.reason}; with them an app fetches what a view needs"})
        return
    layout = case.layout.fits[0]
    why = f"the whole scan does not fit: {layout.reason}" if isinstance(layout, Misfit) else "a part of it is enough"
    if settings_of(case.scene).use == "always":
        why = "the scene asks for them"
    counts = [math.prod(found.counts_zyx(level, plan.grid.shape_zyx)) for level in range(len(found.factors_zyx))]
    reason = (
        f"{why}; {len(found.factors_zyx)} levels in {sum(counts)} bricks of {found.size}³ voxels, {counts[0]} of them "
        f"of level 0, each of {found.brick_bytes} bytes before compression; a device holds {found.places} at a time"
    )
    files = (found.index, found.bricks, *(program.fragment for program in found.programs))
    yield item.model_copy(
        update={"reason": reason, "files": files, "size_bytes": sum(counts) * (found.brick_bytes + RECORD_BYTES)}
    )
