"""Decide on baked light: its resolution, its texture, and the settings that rule it out."""

import math
from collections.abc import Iterator
from typing import Literal

from volprep.parts.light.trial import MOST_TEXELS, light_model
from volprep.plan.decisions import LightChoice
from volprep.plan.products import LightPlan, LightTexturePlan
from volprep.plan.records import LevelPlan
from volprep.plan.room import Beside
from volprep.scene.scene import LightingSettings, Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile, TextureFormat
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.textures.gl_formats import size_bytes

KIND = "light"
"""Kind of its item of the plan."""
FORMAT: TextureFormat = "RG8"
"""Format of its texels."""
_TECHNIQUES = frozenset(("ray-casting", "two-pass", "slabs"))
_COMPOSITINGS = frozenset(("emission-absorption", "back-to-front"))
_CLASSIFICATIONS = frozenset(("lookup", "palette", "control-points"))
_NOT_TRIED = "the build measures it on the whole scan, and may choose another resolution or leave it out"
_SAMPLES_PER_TEXEL = 64
_LEAST_SAMPLES, _MOST_SAMPLES = 1 << 18, 3 << 20


def require_light(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3240 for what light that is computed once does not go with, VP3241 for a shadow without a light."""
    baked, render = scene.lighting.baked, scene.render
    if baked == "none":
        return
    possible = {
        f"profile {profile.name}, which has no 3D textures of format {FORMAT}": profile.max_3d_texture_size > 0
        and FORMAT in profile.texture_formats,
        f"technique {render.technique}": render.technique in _TECHNIQUES,
        f"compositing {render.compositing}": render.compositing in _COMPOSITINGS,
        f"classification {render.classification}": render.classification in _CLASSIFICATIONS,
        f"textures.compression {scene.textures.compression}": scene.textures.compression == "none",
        "[together]": scene.together is None,
        "[grid]": scene.grid is None,
    }
    for what, goes in possible.items():
        if not goes:
            raise VolprepError("VP3240", baked=baked, what=what)
    if baked == "shadow" and scene.lighting.light_mm is None:
        raise VolprepError("VP3241")


def beside_level(scene: Scene, level: LevelPlan, beside: Beside) -> Beside:
    """Add the texture of light to the room that is taken beside the volume of a level."""
    if scene.lighting.baked == "none":
        return beside
    z, y, x = (n * factor for n, factor in zip(level.shape_zyx, level.factors_zyx, strict=True))
    shape_zyx = _shape((z, y, x), _factor(scene.lighting, (z, y, x)))
    return Beside(units=beside.units + 1, bytes=beside.bytes + size_bytes(FORMAT, shape_zyx))


def plan_light(
    scene: Scene, grid: Grid, functions: tuple[TransferFunction, ...], tried: LightChoice | None, *, labels: bool
) -> LightPlan | None:
    """Decide the textures of light, one for each transfer function; None if the scene wants none.

    Raises VP3240 for `labels`, which have no light between voxels.
    """
    wanted, model = scene.lighting, light_model(scene)
    if model is None:
        return None
    if labels:
        raise VolprepError("VP3240", baked=wanted.baked, what="labels")
    factor = (tried and tried.factor) or _factor(wanted, grid.shape_zyx)
    shape_zyx = _shape(grid.shape_zyx, factor)
    return LightPlan(
        model=model,
        factor=factor,
        shape_zyx=shape_zyx,
        samples=sample_count(shape_zyx),
        textures=tuple(
            LightTexturePlan(
                transfer=function.name, name=f"light-{function.name}", file=f"textures/light-{function.name}.ktx2"
            )
            for function in functions
        ),
        editable=scene.editable,
    )


def sample_count(shape_zyx: tuple[int, int, int]) -> int:
    """Return the number of places that the light of so many texels is fitted to.

    On an engine of 64×128×128 voxels with 4 per voxel, fields of 2 million places differ by an RMSE of 0.007 from seed
    to seed, and by 0.026 from path tracing: more places gain little.
    """
    return min(max(_SAMPLES_PER_TEXEL * math.prod(shape_zyx), _LEAST_SAMPLES), _MOST_SAMPLES)


def light_items(plan: LightPlan | None, grid: Grid, tried: LightChoice | None) -> Iterator[PlanItem]:
    """List the decisions about baked light."""
    if plan is None:
        shape_zyx = _shape(grid.shape_zyx, 2)
        reason = tried.reason if tried else "the scene does not ask for it"
        yield PlanItem(
            name="baked light", kind=KIND, kept=False, reason=reason, size_bytes=size_bytes(FORMAT, shape_zyx)
        )
        return
    part = {2: "half", 4: "a quarter of"}[plan.factor]
    yield PlanItem(
        name="baked light",
        kind=KIND,
        kept=True,
        reason=f"{plan.model.kind}, computed once at {part} the resolution from {plan.samples} places, "
        f"{len(plan.textures)} texture{'s' if len(plan.textures) > 1 else ''} of two numbers for each texel; "
        f"for the transfer functions and the volume as they are; {tried.reason if tried else _NOT_TRIED}",
        files=tuple(texture.file for texture in plan.textures),
        size_bytes=len(plan.textures) * size_bytes(FORMAT, plan.shape_zyx),
    )


def _factor(wanted: LightingSettings, shape_zyx: tuple[int, int, int]) -> Literal[2, 4]:
    if wanted.resolution != "auto":
        return wanted.resolution
    return 2 if math.prod(_shape(shape_zyx, 2)) <= MOST_TEXELS else 4


def _shape(shape_zyx: tuple[int, int, int], factor: int) -> tuple[int, int, int]:
    z, y, x = (-(-n // factor) for n in shape_zyx)
    return z, y, x
