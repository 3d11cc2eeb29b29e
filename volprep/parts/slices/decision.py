"""Stacks of slices: the plan of a package for devices that draw textured polygons and have no shaders."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from volprep.parts.levels.decision import candidate_levels, filter_of
from volprep.parts.slices.atlases import fit_atlases, layouts, slice_shape_yx
from volprep.plan.item_kinds import LEVEL
from volprep.plan.products import SlicesPlan, SliceStackPlan, SliceTexturePlan
from volprep.plan.records import ChannelPlan, LevelPlan
from volprep.plan.room import Misfit
from volprep.plan.shape_text import shape_text
from volprep.scene.scene import Scene, SceneRender, SliceSettings
from volprep.scene.wishes import refuse_any, wish_among
from volprep.transfer.palette import best_palette
from volprep.transfer.preclassified import code_colours
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.slices.record import AXES
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import LAID_OVER
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.textures.paletted import ENTRIES, PALETTE_BYTES
from volprep_formats.textures.texel_formats import BYTES_PER_TEXEL, PALETTED, TextureFormat

_BY_SHADERS = ("render.lighting", "[normals]", "[proxy]", "[bricks]", "textures.mipmaps", "skip.ranges")
"""Wishes that need shaders."""


def with_slices(scene: Scene, _profile: DeviceProfile, channels: int) -> Scene:
    """Return the scene as slices need it: if palettes are replaced, all values have codes, and all codes an entry.

    Raises VP1244 for several channels, and VP3080 for palettes that cannot be replaced.
    """
    if channels > 1:
        raise VolprepError("VP1244", path=scene.name, what="stacks of slices")
    if not scene.editable:
        return scene
    settings = scene.slices or SliceSettings()
    frozen = {
        f"lab.slices.form {settings.form}": settings.form != "palette",
        f"lab.slices.palette_entries {settings.palette_entries}": settings.palette_entries < ENTRIES,
    }
    refuse_any("VP3080", frozen)
    return scene.model_copy(update={"crop": "none"})


def refuse_slices(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3060 where a scene asks for slices, and its profile has shaders."""
    if scene.slices is not None:
        raise VolprepError("VP3060", problem=f"profile {profile.name} has shaders, which draw a whole volume")


@dataclass(frozen=True)
class SlicesChoice:
    """The stacks of slices of a channel, and the levels that do not fit."""

    level: LevelPlan
    """Level that is drawn."""
    slices: SlicesPlan
    """Its stacks."""
    misfits: tuple[tuple[LevelPlan, Misfit], ...]
    """Finer levels, and why they do not fit."""
    settings: SliceSettings
    """The settings of the scene."""

    @property
    def distance_mm(self) -> float:
        """Least distance of two slices."""
        return min(stack.distance_mm for stack in self.slices.stacks)


def plan_of_slices(
    channel: str, scene: Scene, profile: DeviceProfile, grid: Grid, functions: tuple[TransferFunction, ...]
) -> SlicesChoice:
    """Decide which level becomes stacks of slices, on a device class without shaders.

    Raises VP3060 for what needs shaders and for a form that the profile does not have, VP3022 when no level fits.
    """
    settings = scene.slices or SliceSettings()
    texel = _texel(scene, settings, profile)
    made_by = filter_of(scene)
    if made_by == "auto":
        # Voxels are classified before anything is between them. Levels fitted to values between voxels look worse:
        # engine and shell at half resolution, views along the axes: 1.1 to 1.9 times the error of box.
        made_by = "box"
    candidates = candidate_levels(channel, grid, scene.pyramid.coarsest_longest_axis, profile, made_by)
    fits = [_fitted(level, grid, settings, texel, profile, functions, editable=scene.editable) for level in candidates]
    found = next((pair for pair in zip(candidates, fits, strict=True) if isinstance(pair[1], SlicesPlan)), None)
    misfits = [fit for fit in fits if isinstance(fit, Misfit)]
    if found is None:
        reason = misfits[-1].reason
        raise VolprepError("VP3022", profile=profile.name, level=candidates[-1].index, reason=reason)
    level, slices = found
    assert isinstance(slices, SlicesPlan)  # noqa: S101 - what `found` was chosen by
    return SlicesChoice(level, slices, tuple(zip(candidates, misfits, strict=False)), settings)


def _texel(scene: Scene, settings: SliceSettings, profile: DeviceProfile) -> TextureFormat:
    needs = {
        f"compositing {scene.render.compositing}": scene.render.compositing not in LAID_OVER,
        "[grid]": scene.must_be_cut,
        f"skip.kind {scene.skip.kind}": scene.skip.kind not in {"auto", "none"},
        f"technique {scene.render.technique}": scene.render.technique != SceneRender().technique,
        f"classification {scene.render.classification}": scene.render.classification != SceneRender().classification,
    }
    what = wish_among(scene, _BY_SHADERS) or next((name for name, wanted in needs.items() if wanted), None)
    if what is not None:
        raise VolprepError("VP3060", problem=f"profile {profile.name} has no shaders, and {what} needs them")
    if scene.source.labels and settings.layers > 1:
        raise VolprepError("VP3060", problem="lab.slices.layers mixes slices, and labels have nothing between them")
    if len(set(settings.stacks)) < len(settings.stacks):
        raise VolprepError("VP3060", problem="lab.slices.stacks names an axis twice")
    texel: TextureFormat = "rgba8unorm" if settings.form == "rgba" else PALETTED
    if texel not in profile.texture_formats:
        raise VolprepError("VP3060", problem=f"profile {profile.name} has no textures of the format {texel}")
    return texel


def _fitted(  # noqa: PLR0917 - the level, the device class, and the settings
    level: LevelPlan,
    grid: Grid,
    settings: SliceSettings,
    texel: TextureFormat,
    profile: DeviceProfile,
    functions: tuple[TransferFunction, ...],
    *,
    editable: bool,
) -> SlicesPlan | Misfit:
    spacing_mm = grid.coarser(level.factors_zyx).spacing_mm_zyx if level.index else grid.spacing_mm_zyx
    stacks: list[SliceStackPlan] = []
    for function in functions:
        for axis in sorted(settings.stacks):
            shape = slice_shape_yx(level.shape_zyx, axis)
            slices = level.shape_zyx[AXES[axis]]
            atlases = fit_atlases(shape, slices, profile.max_texture_size, square=profile.square)
            if atlases is None:
                largest = profile.max_texture_size
                return Misfit(f"slices of {shape[1]}×{shape[0]} voxels, but textures have {largest}×{largest} texels")
            textures = tuple(
                SliceTexturePlan(
                    name=(name := f"slices-{function.name}-{axis}-{part}"),
                    file=f"slices/{name}.{'ktx2' if settings.form == 'rgba' else 'pal8'}",
                    shape_yx=atlas.shape_yx,
                    layout=layout,
                )
                for part, (atlas, layout) in enumerate(layouts(atlases, axis, level.shape_zyx, settings.layers))
            )
            distance_mm = spacing_mm[AXES[axis]] / settings.layers
            stacks.append(SliceStackPlan(transfer=function.name, distance_mm=distance_mm, textures=textures))
    plan = SlicesPlan(
        level=level.index,
        format=texel,
        palette_entries=settings.palette_entries,
        stacks=tuple(stacks),
        editable=editable,
    )
    size = sum(stack_bytes(stack, texel) for stack in stacks[: len(settings.stacks)])
    if size > profile.max_texture_bytes:
        return Misfit(
            f"{len(settings.stacks)} stacks of slices take {size} bytes, more than the {profile.max_texture_bytes} "
            f"that profile {profile.name} has for textures"
        )
    return plan


def stack_bytes(stack: SliceStackPlan, texel: TextureFormat) -> int:
    """Size of the textures of a stack."""
    palettes = PALETTE_BYTES * len(stack.textures) if texel == PALETTED else 0
    return _texels(stack) * BYTES_PER_TEXEL[texel] + palettes


def _texels(stack: SliceStackPlan) -> int:
    return sum(math.prod(texture.shape_yx) for texture in stack.textures)


def describe_slices(plan: ChannelPlan, choice: SlicesChoice) -> Iterator[PlanItem]:
    """List the decisions about levels and stacks of slices."""
    slices, settings = choice.slices, choice.settings
    for level, misfit in choice.misfits:
        size = math.prod(level.shape_zyx) * len(settings.stacks) * BYTES_PER_TEXEL[slices.format]
        yield PlanItem(
            name=f"level {level.index}",
            kind=LEVEL,
            level=level.index,
            kept=False,
            reason=misfit.reason,
            size_bytes=size,
        )
    held = choice.level
    yield PlanItem(
        name=f"level {held.index}",
        kind=LEVEL,
        level=held.index,
        kept=True,
        reason=f"{shape_text(held.shape_zyx)} voxels, the finest whose stacks of slices fit",
    )
    functions = {function.name: function for function in plan.transfer_functions}
    for stack in slices.stacks:
        yield _stack_item(plan, slices, stack, functions[stack.transfer])
    for axis in sorted(AXES.keys() - set(settings.stacks)):
        size = math.prod(held.shape_zyx) * BYTES_PER_TEXEL[slices.format]
        reason = "the scene does not ask for them: along this axis a viewer sees other slices from the side"
        yield PlanItem(name=f"slices across {axis}", kind="slices", kept=False, reason=reason, size_bytes=size)
    yield PlanItem(
        name="shaders",
        kind="shaders",
        kept=False,
        reason=f"profile {plan.profile.name} has no shaders: it blends textured polygons",
    )


def _stack_item(plan: ChannelPlan, slices: SlicesPlan, stack: SliceStackPlan, function: TransferFunction) -> PlanItem:
    layout = stack.textures[0].layout
    count = sum(texture.layout.slices for texture in stack.textures)
    rows, columns = layout.slice_shape_yx
    wasted = 1 - count * rows * columns / _texels(stack)
    sizes = ", ".join(f"{texture.shape_yx[1]}×{texture.shape_yx[0]}" for texture in stack.textures)
    return PlanItem(
        name=f"slices of {stack.transfer} across {layout.axis}",
        kind="slices",
        transfer=stack.transfer,
        kept=True,
        reason=f"{count} slices of {columns}×{rows} voxels, {stack.distance_mm * layout.layers:.4g} mm apart"
        f"{'' if layout.layers == 1 else f', each drawn in {layout.layers} polygons'}, in textures of {sizes}: "
        f"{wasted:.1%} of the texels stay empty; with one texture for each slice it would be "
        f"{1 - rows * columns / (_rounded(rows) * _rounded(columns)):.1%}; {_colours(plan, slices, stack, function)}; "
        f"{_oblique(plan, stack, function)}",
        files=tuple(texture.file for texture in stack.textures),
        size_bytes=stack_bytes(stack, slices.format),
    )


def _rounded(voxels: int) -> int:
    return 1 << (voxels - 1).bit_length()


def _colours(plan: ChannelPlan, slices: SlicesPlan, stack: SliceStackPlan, function: TransferFunction) -> str:
    if slices.format == "rgba8unorm":
        return "four bytes a voxel"
    if slices.editable:
        return "texels are codes and entry j of the palette is the colour of code j, so that an edit replaces 1 kB"
    colours = code_colours(function, plan.quantize.window, stack.distance_mm)
    palette = best_palette(colours, slices.palette_entries)
    if palette.maximum == 0.0:
        return f"a palette of {len(palette.colours)} colours holds the colour of every code"
    return (
        f"a palette of {len(palette.colours)} colours is off by at most {palette.maximum * 255:.3g}/255 over all codes"
    )


def _oblique(plan: ChannelPlan, stack: SliceStackPlan, function: TransferFunction) -> str:
    """Return the opacity of one slice for a ray at 45°, whose way is longer, for the densest code."""
    texels = code_colours(function, plan.quantize.window, stack.distance_mm)
    opacity = float(texels[:, 3].max()) / 255
    longer = 1 - (1 - opacity) ** math.sqrt(2)
    # Polygons at an angle are drawn brighter, as far as no texel passes 1.
    drawn = min(opacity * math.sqrt(2), 1.0)
    return (
        f"opacities are exact for rays along {stack.textures[0].layout.axis}; at 45° the densest texel should have "
        f"{longer:.3g}, but is drawn with {drawn:.3g}"
    )
