"""Decide which levels a package holds, and in which layout: the finest that the device class has room for."""

import math

from volprep.parts.bricks.decision import Bricks, as_bricks
from volprep.parts.case import Case
from volprep.parts.classification.decision import CLASSIFIED_BITS, tables_bytes
from volprep.parts.levels.decision import candidate_levels, filter_of
from volprep.parts.mosaic.decision import as_compressed_mosaic, as_mosaic
from volprep.parts.on_demand.decision import POOL_SHARE, plan_on_demand
from volprep.parts.programs.decision import passes_before, ray_casters
from volprep.parts.texture.mipmaps import in_one_texture, mipmap_levels
from volprep.plan.decisions import Layout
from volprep.plan.products import OnDemandPlan
from volprep.plan.records import LevelPlan, VolumePlan
from volprep.plan.room import Beside, Misfit, one_channel, texture_bytes, too_large
from volprep.plan.shape_text import shape_text
from volprep.scene.scene import MosaicSettings
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import Rays
from volprep_formats.package.texture import SampleFilter
from volprep_formats.textures.block_formats import CompressedFormat


def fit_level(  # noqa: PLR0917 - the level, the device class, and the settings
    level: LevelPlan,
    bits: int,
    profile: DeviceProfile,
    beside: Beside,
    wanted: MosaicSettings,
    compression: CompressedFormat | None = None,
    between: SampleFilter = "linear",
) -> VolumePlan | Misfit:
    """Lay a level out as the device class can hold it, beside other textures, or say why not.

    `between` says how it is sampled.
    """
    if compression is not None:
        return as_compressed_mosaic(level, compression, profile, beside, wanted.gutter)
    if not profile.max_3d_texture_size:
        return as_mosaic(level, bits, profile, beside, wanted, between)
    volume = _as_texture3d(level, bits, profile, between)
    return volume if isinstance(volume, Misfit) else too_large(volume, profile, beside) or volume


def _as_texture3d(level: LevelPlan, bits: int, profile: DeviceProfile, between: SampleFilter) -> VolumePlan | Misfit:
    texel = one_channel(bits, profile)
    if texel is None:
        return Misfit(f"profile {profile.name} has no format of one channel and {bits} bits")
    if max(level.shape_zyx) > profile.max_3d_texture_size:
        return Misfit(
            f"{shape_text(level.shape_zyx)} voxels, but 3D textures of profile {profile.name} have at most "
            f"{profile.max_3d_texture_size} along an axis"
        )
    name = f"volume-{level.name}"
    return VolumePlan(
        level=level.index,
        names=(name,),
        files=(f"textures/{name}.ktx2",),
        format=texel,
        shape_zyx=level.shape_zyx,
        mosaic=None,
        channels=(level.channel,),
        filter=between,
    )


def lay_out(case: Case, form: CompressedFormat | None) -> Layout:
    """Lay the levels of a channel out beside the textures of other parts, compressed if `form` is given.

    Raises VP3022 if the profile holds no level, VP3024, VP3044 and VP3071 for wishes that do not go together.
    """
    scene, profile, values = case.scene, case.profile, case.values
    # Devices compress no 3D textures, so compressed levels, and the textures sampled beside them, are mosaics.
    layouts = profile if form is None else profile.model_copy(update={"max_3d_texture_size": 0})
    list_levels = mipmap_levels if scene.textures.mipmaps else candidate_levels
    listed = list_levels(case.channel, case.grid, scene.pyramid.coarsest_longest_axis, layouts, filter_of(scene))
    refine = scene.pyramid.refine
    candidates = [
        level.model_copy(update={"refine": refine, "lit": refine != "none" and level.filter in {"auto", "refined"}})
        for level in listed
    ]
    table_bytes = tables_bytes(scene.render, profile, values.entries)
    rays: tuple[Rays, ...] = ("box",) if scene.proxy is None else ("box", "mesh")
    passes = max(passes_before(scene.render.technique, scene.lighting.shadows, ray) for ray in rays)
    units = (1 if table_bytes else 0) + passes
    beside = Beside(units=units, bytes=table_bytes)
    bits = CLASSIFIED_BITS if scene.render.classification in {"preclassified", "colour"} else values.quantize.bits
    rooms = [_beside(case, layouts, level, beside) for level in candidates]
    fits = [
        room
        if isinstance(room, Misfit)
        else fit_level(level, bits, layouts, room, scene.mosaic, form, values.quantize.filter)
        for level, room in zip(candidates, rooms, strict=True)
    ]
    if scene.textures.mipmaps:
        fits = in_one_texture(fits, candidates, profile, beside)
    if scene.bricks is not None:
        kinds = Bricks(scene.bricks, scene.mosaic.order, values.quantize.filter, keep_empty=scene.crop == "none")
        fits = [as_bricks(level, bits, layouts, beside, kinds) for level in candidates]
    levels, volumes = _kept(candidates, fits, profile)
    if isinstance(plan_on_demand(case, levels[0].index), OnDemandPlan):
        fits = [_beside_pool(fit, profile) for fit in fits]
        levels, volumes = _kept(candidates, fits, profile)
    programs = tuple(program for function in case.shown_alone for program in ray_casters(function.name, volumes, scene))
    return Layout(layouts, beside, candidates, fits, levels, volumes, programs)


def _beside(case: Case, layouts: DeviceProfile, level: LevelPlan, beside: Beside) -> Beside | Misfit:
    """Return the room that everything else takes beside a level."""
    for neighbour in case.neighbours:
        room = neighbour(case.scene, layouts, level, beside)
        if isinstance(room, Misfit):
            return room
        beside = room
    return beside


def _beside_pool(fit: VolumePlan | Misfit, profile: DeviceProfile) -> VolumePlan | Misfit:
    """Return a level if it has room beside the pool of bricks on demand."""
    most = profile.max_texture_bytes - profile.max_texture_bytes // POOL_SHARE
    if isinstance(fit, Misfit) or texture_bytes(fit) <= most:
        return fit
    return Misfit(f"{texture_bytes(fit)} bytes, and beside the pool of bricks on demand there are {most}")


def _kept(
    candidates: list[LevelPlan], fits: list[VolumePlan | Misfit], profile: DeviceProfile
) -> tuple[tuple[LevelPlan, ...], tuple[VolumePlan, ...]]:
    """Take every level that fits as a 3D texture; as mosaics the finest, and each with an eighth of the voxels."""
    fitting = [(level, fit) for level, fit in zip(candidates, fits, strict=True) if isinstance(fit, VolumePlan)]
    if not fitting:
        coarsest = fits[-1]
        assert isinstance(coarsest, Misfit)  # noqa: S101 - the alternative is a VolumePlan
        raise VolprepError("VP3022", profile=profile.name, level=candidates[-1].index, reason=coarsest.reason)
    kept = fitting[:1]
    for level, volume in fitting[1:]:
        if volume.mosaic is None or math.prod(level.factors_zyx) >= 8 * math.prod(kept[-1][0].factors_zyx):
            kept.append((level, volume))
    return tuple(level for level, _ in kept), tuple(volume for _, volume in kept)
