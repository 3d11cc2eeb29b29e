"""Which levels a package holds and in which layout: as fine as the device class allows, beside tables and normals."""

import math
from dataclasses import dataclass

from volprep.parts.bricks.decision import Bricks, as_bricks
from volprep.parts.classification.decision import CLASSIFIED_BITS, tables_bytes
from volprep.parts.levels.decision import candidate_levels, filter_of, fit_level
from volprep.parts.normals.decision import beside_level, wanted_normals
from volprep.parts.programs.decision import passes_before
from volprep.parts.texture.mipmaps import in_one_texture, mipmap_levels
from volprep.parts.values.decision import ValueChoice
from volprep.plan.records import LevelPlan, VolumePlan
from volprep.plan.room import Beside, Misfit
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.textures.block_formats import CompressedFormat


@dataclass(frozen=True)
class Layout:
    """Levels and their textures."""

    profile: DeviceProfile
    """The class of devices as far as levels are concerned: compressed ones have no 3D textures."""
    beside: Beside
    """What each level is sampled beside."""
    candidates: list[LevelPlan]
    """Levels that there could be."""
    fits: list[VolumePlan | Misfit]
    """How the device class can hold each of them."""
    levels: tuple[LevelPlan, ...]
    """Levels that the package holds, finest first."""
    volumes: tuple[VolumePlan, ...]
    """Their textures."""


def lay_out(  # noqa: PLR0917 - the channel, the device class, and what was decided before
    channel: str,
    scene: Scene,
    profile: DeviceProfile,
    grid: Grid,
    values: ValueChoice,
    form: CompressedFormat | None,
) -> Layout:
    """Lay the levels of a channel out, compressed in `form` if there is one.

    Raises VP3022 when the profile holds no level.
    """
    # Devices compress no 3D textures, so that compressed levels, and what is sampled beside them, are mosaics.
    layouts = profile if form is None else profile.model_copy(update={"max_3d_texture_size": 0})
    list_levels = mipmap_levels if scene.textures.mipmaps else candidate_levels
    candidates = list_levels(channel, grid, scene.pyramid.coarsest_longest_axis, layouts, filter_of(scene))
    table_bytes = tables_bytes(scene.render, profile, values.entries)
    units = (1 if table_bytes else 0) + passes_before(scene.render.technique, scene.lighting.shadows)
    beside = Beside(units=units, bytes=table_bytes)
    bits = CLASSIFIED_BITS if scene.render.classification == "preclassified" else values.quantize.bits
    with_normals = [beside_level(beside, level, wanted_normals(scene), layouts) for level in candidates]
    fits = [
        others
        if isinstance(others, Misfit)
        else fit_level(level, bits, layouts, others, scene.mosaic, form, values.quantize.filter)
        for level, others in zip(candidates, with_normals, strict=True)
    ]
    if scene.textures.mipmaps:
        fits = in_one_texture(fits, candidates, profile, beside)
    if scene.bricks is not None:
        kinds = Bricks(scene.bricks, values.quantize.filter, keep_empty=scene.crop == "none")
        fits = [as_bricks(level, bits, layouts, beside, kinds) for level in candidates]
    levels, volumes = _kept(candidates, fits, profile)
    return Layout(layouts, beside, candidates, fits, levels, volumes)


def _kept(
    candidates: list[LevelPlan], fits: list[VolumePlan | Misfit], profile: DeviceProfile
) -> tuple[tuple[LevelPlan, ...], tuple[VolumePlan, ...]]:
    """Take every level that fits as a 3D texture; as mosaics the finest, and each with an eighth of the voxels."""
    fitting = [(level, fit) for level, fit in zip(candidates, fits, strict=True) if isinstance(fit, VolumePlan)]
    if not fitting:
        coarsest = fits[-1]
        assert isinstance(coarsest, Misfit)  # noqa: S101 - what is not a VolumePlan
        raise VolprepError("VP3022", profile=profile.name, level=candidates[-1].index, reason=coarsest.reason)
    kept = fitting[:1]
    for level, volume in fitting[1:]:
        if volume.mosaic is None or math.prod(level.factors_zyx) >= 8 * math.prod(kept[-1][0].factors_zyx):
            kept.append((level, volume))
    return tuple(level for level, _ in kept), tuple(volume for _, volume in kept)
