"""Decide on baked light: its resolution, its texture, and the settings that rule it out."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from volprep.parts.light.trial import MOST_TEXELS, light_model
from volprep.parts.mosaic.decision import mosaic_text
from volprep.parts.mosaic.packing import Packing, fit_mosaic, room_of
from volprep.plan.decisions import CutChoice, LightChoice
from volprep.plan.item_kinds import BAKED_LIGHT
from volprep.plan.products import LightPlan, LightTexturePlan
from volprep.plan.records import LevelPlan
from volprep.plan.room import Beside, Misfit, if_held
from volprep.scene.scene import LightFactor, LightingSettings, Scene
from volprep.scene.wishes import refuse_wishes
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.parts.light.planes import planes_in_box
from volprep_formats.package.parts.light.record import form_of
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import LAID_OVER
from volprep_formats.package.texture import MosaicLayout
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.textures.texel_formats import TextureFormat, size_bytes

KIND = "light"
"""Kind of its item of the plan."""
_FORMATS: dict[int, TextureFormat] = {2: "rg8unorm", 4: "rgba8unorm"}
"""Format of a texel, by the number of its components."""
_TECHNIQUES = frozenset(("ray-casting", "two-pass", "slabs"))
_CLASSIFICATIONS = frozenset(("lookup", "palette", "control-points"))
_NOT_TRIED = "the build measures it on the whole scan, and may choose another resolution or leave it out"
_SAMPLES_PER_TEXEL = 64
_LEAST_SAMPLES, _MOST_SAMPLES = 1 << 18, 1 << 21
_MANY_TEXELS, _MOST_OF_MANY = 1_000_000, 3 << 19
"""Of more texels, fewer places: paths are longer, and there are more equations."""


def require_light(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3240 for what light that is computed once does not go with.

    Raises VP3241 for a shadow without a light, VP3243 for light of a cut without planes.
    """
    baked, render, model = scene.lighting.baked, scene.render, light_model(scene)
    if scene.lighting.clip_aware and not scene.lighting.clip_planes:
        raise VolprepError("VP3243")
    if baked == "none" or model is None:
        return
    possible = {
        f"profile {profile.name}, which has no shaders": profile.has_shaders,
        f"profile {profile.name}, which has no textures of format {_format(model)}": if_held(_format(model), profile)
        is not None,
        f"technique {render.technique}": render.technique in _TECHNIQUES,
        f"compositing {render.compositing}": render.compositing in LAID_OVER,
        f"classification {render.classification}": render.classification in _CLASSIFICATIONS,
        "lighting.turnable, which is for light from all around": baked != "shadow" or not model.turnable,
        'channels = "rgb", as its light is white': baked != "shadow" or model.channels != "rgb",
        'lighting.turnable and channels = "rgb" together': not (model.turnable and model.channels == "rgb"),
    }
    for what, goes in possible.items():
        if not goes:
            raise VolprepError("VP3240", baked=baked, what=what)
    refuse_wishes("VP3240", scene, ("textures.compression", "[together]"), baked=baked)
    if baked == "shadow" and scene.lighting.light_mm is None:
        raise VolprepError("VP3241")


def _format(model: LightModel) -> TextureFormat:
    return _FORMATS[form_of(model).components]


def beside_level(scene: Scene, profile: DeviceProfile, level: LevelPlan, beside: Beside) -> Beside | Misfit:
    """Add the textures of light to the room that is taken beside the volume of a level."""
    z, y, x = (n * factor for n, factor in zip(level.shape_zyx, level.factors_zyx, strict=True))
    held = _held(scene, profile, (z, y, x))
    if held is None:
        return beside
    if isinstance(held, Misfit):
        return Misfit(f"its light: {held.reason}")
    return Beside(units=beside.units + 1, bytes=beside.bytes + size_bytes(held.format, held.texels_zyx))


class _Held(NamedTuple):
    """How a device class holds the light of a scene."""

    model: LightModel
    format: TextureFormat
    factor: LightFactor
    shape_zyx: tuple[int, int, int]
    mosaic: MosaicLayout | None

    @property
    def texels_zyx(self) -> tuple[int, int, int]:
        if self.mosaic is not None:
            return (1, *self.mosaic.texture_shape_yx)
        return form_of(self.model).slices_zyx(self.shape_zyx)


def _held(
    scene: Scene, profile: DeviceProfile, shape_zyx: tuple[int, int, int], tried: LightChoice | None = None
) -> _Held | Misfit | None:
    """Return the wanted resolution, or the next that the device class holds; None without light."""
    model = light_model(scene)
    texel = None if model is None else if_held(_format(model), profile)
    if model is None or texel is None:
        return None
    wanted = (tried and tried.factor) or _factor(scene.lighting, shape_zyx)
    factors: tuple[LightFactor, ...] = (1, 2, 4)
    packing = Packing(components_per_voxel=form_of(model).components)
    for factor in factors[factors.index(wanted) :]:
        light_zyx = _shape(shape_zyx, factor)
        slices_zyx = form_of(model).slices_zyx(light_zyx)
        if profile.max_3d_texture_size:
            if max(slices_zyx) <= profile.max_3d_texture_size:
                return _Held(model, texel, factor, light_zyx, None)
        elif (mosaic := fit_mosaic(slices_zyx, packing, room_of(profile))) is not None:
            return _Held(model, texel, factor, light_zyx, mosaic)
    return Misfit(f"profile {profile.name} has no texture that holds a quarter of the resolution")


def plan_light(
    scene: Scene,
    profile: DeviceProfile,
    grid: Grid,
    functions: tuple[TransferFunction, ...],
    tried: LightChoice | None,
    *,
    labels: bool,
) -> LightPlan | None:
    """Decide the textures of light of each transfer function; None if the scene wants none.

    Raises VP3240 for `labels`, which have no light between voxels.
    """
    held = _held(scene, profile, grid.shape_zyx, tried)
    if held is None:
        return None
    if labels:
        raise VolprepError("VP3240", baked=scene.lighting.baked, what="labels")
    assert isinstance(held, _Held)  # noqa: S101 - `beside_level` has found that it fits
    asked = scene.lighting.clip_aware and (tried is None or tried.cut is None or tried.cut.kept)
    return LightPlan(
        model=held.model,
        factor=held.factor,
        shape_zyx=held.shape_zyx,
        format=held.format,
        mosaic=held.mosaic,
        samples=sample_count(held.shape_zyx),
        planes=planes_in_box(scene.lighting.clip_planes, grid) if asked else (),
        textures=tuple(
            LightTexturePlan(transfer=function.name, is_of_a_cut=is_of_a_cut, name=name, file=f"textures/{name}.ktx2")
            for function in functions
            for is_of_a_cut, name in (
                (False, f"light-{function.name}"),
                *([(True, f"cut-light-{function.name}")] if asked else []),
            )
        ),
        editable=scene.editable,
    )


def sample_count(shape_zyx: tuple[int, int, int]) -> int:
    """Return the number of places that the light of so many texels is fitted to.

    On an engine of 64×128×128 voxels with 4 per voxel, twice the places gain about 1 dB up to two million, which give
    34.7 dB. 256³ voxels are to take a minute on two cores.
    """
    texels = math.prod(shape_zyx)
    most = _MOST_SAMPLES if texels <= _MANY_TEXELS else _MOST_OF_MANY
    return min(max(_SAMPLES_PER_TEXEL * texels, _LEAST_SAMPLES), most)


def light_items(plan: LightPlan | None, scene: Scene, grid: Grid, tried: LightChoice | None) -> Iterator[PlanItem]:
    """List the decisions about baked light."""
    if tried is not None and tried.remark:
        kept = plan is not None
        yield PlanItem(name="error of baked light", kind=BAKED_LIGHT, kept=kept, reason=tried.remark)
    if plan is None:
        reason = tried.reason if tried else "the scene does not ask for it"
        size = size_bytes(_FORMATS[2], _shape(grid.shape_zyx, 2))
        yield PlanItem(name="baked light", kind=KIND, kept=False, reason=reason, size_bytes=size)
        return
    part = {1: "all of", 2: "half", 4: "a quarter of"}[plan.factor]
    whole = [texture for texture in plan.textures if not texture.is_of_a_cut]
    count = len(whole)
    layout = "" if plan.mosaic is None else f" as a {mosaic_text(plan.mosaic)}"
    yield PlanItem(
        name="baked light",
        kind=KIND,
        kept=True,
        reason=f"{plan.model.kind}, computed once at {part} the resolution from {plan.samples} places, "
        f"{count} texture{'s' if count > 1 else ''} of {plan.format}{layout}; {_held_text(plan.model)}; "
        f"for the transfer functions and the volume as they are; {tried.reason if tried else _NOT_TRIED}"
        f"{_coarser_text(plan, scene, tried, grid)}",
        files=tuple(texture.file for texture in whole),
        size_bytes=count * size_bytes(plan.format, plan.texels_zyx),
    )
    if scene.lighting.clip_aware:
        yield _item_of_the_cut(plan, tried.cut if tried else None, count)


def _item_of_the_cut(plan: LightPlan, tried: CutChoice | None, count: int) -> PlanItem:
    files = tuple(texture.file for texture in plan.textures if texture.is_of_a_cut)
    reason = _NOT_TRIED if tried is None else tried.reason
    if plan.planes:
        by = f"{len(plan.planes)} plane{'s' if len(plan.planes) > 1 else ''}"
        reason = f"light of the volume cut by {by}, which an app takes if exactly these cut it; {reason}"
    return PlanItem(
        name="baked light of the cut",
        kind=KIND,
        kept=bool(files),
        reason=reason,
        files=files,
        size_bytes=count * size_bytes(plan.format, plan.texels_zyx),
    )


def _held_text(model: LightModel) -> str:
    if model.turnable:
        suns = "; suns shine from half of the sky" if model.suns else ""
        return f"an app may turn it: four environments, for four times the bytes and two to three times the time{suns}"
    if model.channels == "rgb":
        return "in the colours of two lights that make white, for twice the bytes of a brightness"
    return "its brightness only"


def _coarser_text(plan: LightPlan, scene: Scene, tried: LightChoice | None, grid: Grid) -> str:
    """Explain a coarser texture than wanted; empty if the device class holds the wanted one."""
    wanted = (tried and tried.factor) or _factor(scene.lighting, grid.shape_zyx)
    return "" if plan.factor == wanted else "; no texture of the device class holds more"


def _factor(wanted: LightingSettings, shape_zyx: tuple[int, int, int]) -> LightFactor:
    if wanted.resolution != "auto":
        return wanted.resolution
    return 2 if math.prod(_shape(shape_zyx, 2)) <= MOST_TEXELS else 4


def _shape(shape_zyx: tuple[int, int, int], factor: int) -> tuple[int, int, int]:
    z, y, x = (-(-n // factor) for n in shape_zyx)
    return z, y, x
