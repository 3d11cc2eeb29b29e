"""Normals: which textures hold them, in which format, and how much room they take beside the volume."""

import math
from collections.abc import Iterator

from volprep.plan.records import LevelPlan, NormalsPlan, NormalTexturePlan, VolumePlan
from volprep.plan.room import Beside, first_of
from volprep.render.gl_formats import BYTES_PER_TEXEL
from volprep.scene import NormalSettings, Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.normals import NormalCode
from volprep_formats.package.profile import DeviceProfile, TextureFormat

# Formats of the code alone, and with the length of the gradient in one channel more.
_FORMATS: dict[NormalCode, tuple[tuple[TextureFormat, ...], tuple[TextureFormat, ...]]] = {
    "biased8": (("RGB8",), ("RGBA8",)),
    "snorm8": (("RGB8_SNORM",), ("RGBA8_SNORM",)),
    "oct8": (("RG8", "LUMINANCE_ALPHA8"), ("RGB8",)),
    "oct12": (("RGB8",), ("RGBA8",)),
}
_WHY = {
    "forward": "the cheapest, half a voxel off",
    "central": "the sharpest, and the noisiest",
    "thesis": "on noise as good as Sobel's, and truer on clean data",
    "sobel": "the best on noise",
    "isotropic": "the truest on clean data",
}


def wanted_normals(scene: Scene) -> NormalSettings | None:
    """Give what the scene wants of normals: what it says, or the default where its lighting needs them."""
    return scene.normals or (NormalSettings() if scene.render.lighting != "none" else None)


def normal_format(settings: NormalSettings, profile: DeviceProfile) -> TextureFormat:
    """Format of a texel. Raises VP3050 where the profile has none, VP3051 where it has no 3D textures."""
    if profile.max_3d_texture_size == 0:
        raise VolprepError("VP3051", profile=profile.name)
    formats = _FORMATS[settings.code][settings.magnitude]
    texel = first_of(formats, profile)
    if texel is None:
        raise VolprepError(
            "VP3050",
            profile=profile.name,
            coded=settings.code,
            needed=" or ".join(formats),
            known=", ".join(profile.texture_formats),
        )
    return texel


def beside_level(beside: Beside, level: LevelPlan, settings: NormalSettings | None, profile: DeviceProfile) -> Beside:
    """Add the normals of a level to what is sampled beside its volume."""
    if settings is None:
        return beside
    size = math.prod(level.shape_zyx) * BYTES_PER_TEXEL[normal_format(settings, profile)]
    return Beside(units=beside.units + 1, bytes=beside.bytes + size)


def plan_normals(
    settings: NormalSettings | None, profile: DeviceProfile, volumes: tuple[VolumePlan, ...]
) -> NormalsPlan | None:
    """Decide the textures: one for each level that the package holds."""
    if settings is None:
        return None
    texel = normal_format(settings, profile)
    return NormalsPlan(
        kernel=settings.kernel,
        code=settings.code,
        space=settings.space,
        magnitude=settings.magnitude,
        format=texel,
        filter="linear" if settings.code in {"biased8", "snorm8"} else "nearest",
        textures=tuple(
            NormalTexturePlan(
                level=volume.level,
                name=f"normals-{volume.level}",
                file=f"textures/normals-{volume.level}.ktx2",
                shape_zyx=volume.shape_zyx,
            )
            for volume in volumes
        ),
    )


def normal_items(normals: NormalsPlan | None, scene: Scene, levels: tuple[LevelPlan, ...]) -> Iterator[PlanItem]:
    """List what was decided about normals."""
    voxels = sum(math.prod(level.shape_zyx) for level in levels)
    if normals is None:
        yield PlanItem(
            name="normals",
            kept=False,
            reason="no lighting in the scene: no shader reads a normal",
            size_bytes=3 * voxels,
        )
        return
    use = "no shader reads them: the scene wants them as data"
    if scene.render.lighting != "none":
        use = f"for lighting by a {scene.render.lighting}"
    axes = "the volume's axes, as shaders have positions" if normals.space == "box" else "the patient's axes"
    yield PlanItem(
        name="normals",
        kept=True,
        reason=f"{use}; {normals.kernel} differences ({_WHY[normals.kernel]}), code {normals.code} as "
        f"{normals.format}, along {axes}",
        files=tuple(texture.file for texture in normals.textures),
        size_bytes=voxels * BYTES_PER_TEXEL[normals.format],
    )
    yield PlanItem(
        name="lengths of gradients",
        kept=normals.magnitude,
        reason="in the last channel of the normals, as the scene wants"
        if normals.magnitude
        else "the scene does not want them: normals.magnitude is false",
        size_bytes=0 if normals.magnitude else voxels,
    )
