"""Normals: which textures hold them, in which format, and how much room they take beside the volume.

Without 3D textures they are mosaics of one slice in a texel, with the components side by side: filtering across an edge
of a tile would give a wrong normal, so positions are clamped as in mosaics of values, without gutters.
"""

import math
from collections.abc import Iterator

from volprep.parts.mosaic.decision import MOST_TEXTURES, mosaic_of, mosaic_text, part_names
from volprep.parts.mosaic.packing import Packing
from volprep.plan.products import NormalsPlan, NormalTexturePlan
from volprep.plan.records import LevelPlan
from volprep.plan.room import Beside, Misfit
from volprep.scene.scene import NormalSettings, Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.normals.record import DIRECTION_BYTES, FILTERED_CODES, NormalCode
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import MosaicLayout
from volprep_formats.textures.texel_formats import TextureFormat, size_bytes

KIND = "normals"
"""Kind of its item of the plan."""
_FORMATS: dict[NormalCode, TextureFormat] = {
    "biased8": "rgb8unorm",
    "snorm8": "rgb8snorm",
    "oct8": "rg8unorm",
    "oct12": "rgb8unorm",
}
_WHY = {
    "forward": "the cheapest, but shifted by half a voxel",
    "central": "the sharpest and the noisiest",
    "thesis": "as good as sobel on noise, and more accurate on clean data",
    "sobel": "the best on noise",
    "isotropic": "the most accurate on clean data",
}


def wanted_normals(scene: Scene) -> NormalSettings | None:
    """Return the settings of normals: the scene's, the default if its lighting needs them, else None."""
    return scene.lit_normals or scene.normals


def normal_format(settings: NormalSettings, profile: DeviceProfile) -> TextureFormat:
    """Format of a texel. Raises VP3050 where the profile has none."""
    texel = _FORMATS[settings.code]
    if texel not in profile.texture_formats:
        raise VolprepError(
            "VP3050", profile=profile.name, coded=settings.code, needed=texel, known=", ".join(profile.texture_formats)
        )
    return texel


def beside_level(
    beside: Beside, level: LevelPlan, settings: NormalSettings | None, profile: DeviceProfile
) -> Beside | Misfit:
    """Add the normals of a level to the textures sampled beside its volume, or return why they do not fit."""
    if settings is None:
        return beside
    fit = _fitted(level, settings, profile, beside)
    if isinstance(fit, Misfit):
        return Misfit(f"its normals: {fit.reason}")
    size = _size_bytes(fit, normal_format(settings, profile))
    return Beside(units=beside.units + len(fit.files), bytes=beside.bytes + size)


def _fitted(
    level: LevelPlan, settings: NormalSettings, profile: DeviceProfile, beside: Beside
) -> NormalTexturePlan | Misfit:
    """Lay out the normals of a level as a 3D texture, or as a mosaic that leaves the volume a texture unit."""
    name = f"normals-{level.name}"
    if profile.max_3d_texture_size:
        return _texture(level, (name,), None)
    units = min(profile.texture_units - beside.units - 1, MOST_TEXTURES)
    if units < 1:
        return Misfit(f"the volume and its table take all {profile.texture_units} texture units")
    packing = Packing(components_per_voxel=DIRECTION_BYTES[settings.code])
    layout = mosaic_of(level, packing, units, profile)
    if isinstance(layout, Misfit):
        return layout
    return _texture(level, part_names(name, layout.textures), layout)


def _texture(level: LevelPlan, names: tuple[str, ...], layout: MosaicLayout | None) -> NormalTexturePlan:
    return NormalTexturePlan(
        level=level.index,
        names=names,
        files=tuple(f"textures/{name}.ktx2" for name in names),
        shape_zyx=level.shape_zyx if layout is None else (1, *layout.texture_shape_yx),
        mosaic=layout,
        channels=(level.channel,),
    )


def _size_bytes(texture: NormalTexturePlan, texel: TextureFormat) -> int:
    return size_bytes(texel, texture.shape_zyx) * len(texture.files)


def plan_normals(
    settings: NormalSettings | None,
    profile: DeviceProfile,
    levels: tuple[LevelPlan, ...],
    beside: Beside,
    *,
    labels: bool = False,
) -> NormalsPlan | None:
    """Decide the textures of each level that the package holds. `beside_level` has found that they fit.

    Normals of `labels` are constant in their voxels, as labels are.
    """
    if settings is None:
        return None
    texel = normal_format(settings, profile)
    fits = [_fitted(level, settings, profile, beside) for level in levels]
    return NormalsPlan(
        kernel=settings.kernel,
        code=settings.code,
        format=texel,
        filter="linear" if settings.code in FILTERED_CODES and not labels else "nearest",
        textures=tuple(fit for fit in fits if isinstance(fit, NormalTexturePlan)),
    )


def normal_items(normals: NormalsPlan | None, scene: Scene, levels: tuple[LevelPlan, ...]) -> Iterator[PlanItem]:
    """List the decisions about normals."""
    if normals is None:
        yield PlanItem(
            name="normals",
            kind=KIND,
            kept=False,
            reason="the scene has no lighting, so no shader reads a normal"
            if scene.render.lighting == "none"
            else f"as the scene asks, shaders take {scene.lighting.normals} differences of the values themselves",
            size_bytes=3 * sum(math.prod(level.shape_zyx) for level in levels),
        )
        return
    of_what = " of the extinction of labels" if scene.source.labels else ""
    use = "no shader reads them; the scene wants them as data"
    if scene.lit_normals is not None:
        use = f"for lighting with a {scene.render.lighting}"
    layout = normals.textures[0].mosaic
    form = "" if layout is None else f", level {levels[0].index} as a {mosaic_text(layout)}"
    yield PlanItem(
        name="normals",
        kind=KIND,
        kept=True,
        reason=f"{use}; {normals.kernel} differences{of_what} ({_WHY[normals.kernel]}), code {normals.code} as "
        f"{normals.format}{form}, along the volume's axes, in which shaders have positions",
        files=tuple(file for texture in normals.textures for file in texture.files),
        size_bytes=sum(_size_bytes(texture, normals.format) for texture in normals.textures),
    )
