"""Which channels share the texels of one texture, so that one fetch gives the values of all of them.

They are separate data, side by side in a texel, not slices of one volume as in a mosaic of four channels. OpenGL ES 2.0
has no texels of red and green alone: two channels are luminance and alpha there, which take half of the memory that
RGBA would, and lose nothing, because both are fetched as they are.

A software driver draws two channels together 1.3 times faster when they share texels, and four 1.6 to 1.9 times, but
one of four alone in 1.1 to 1.4 times the time (tests/benchmarks/bench_channels.py): so channels share texels where they
are drawn together.
"""

from collections.abc import Iterator, Sequence
from typing import get_args

from volprep.parts.compression.decision import COLOUR_FORM
from volprep.parts.mosaic.decision import MOST_TEXTURES, mosaic_of, mosaic_text, part_names
from volprep.parts.mosaic.packing import Packing
from volprep.parts.texture.mipmaps import in_one_texture
from volprep.plan.decisions import Packed
from volprep.plan.products import NormalsPlan
from volprep.plan.records import ChannelPlan, LevelPlan, VolumePlan
from volprep.plan.room import Beside, Misfit, if_held, texture_bytes, too_large
from volprep.scene.scene import Compression, Scene
from volprep_formats.package.manifest import PlanItem
from volprep_formats.textures.block_formats import BLOCKS
from volprep_formats.textures.texel_formats import SRGB, TextureFormat, size_bytes

_FORMATS: dict[int, TextureFormat] = {2: "rg8unorm", 3: "rgb8unorm", 4: "rgba8unorm"}
_MOST = 4
"""Components of a texel."""


def pack_channels(plans: Sequence[ChannelPlan], scene: Scene, together: Sequence[str]) -> Packed:
    """Put channels into common texels where that is wanted and possible.

    `together` names the channels that are drawn into one picture.
    """
    wanted = scene.textures.channels
    group = [plan for plan in plans if wanted != "auto" or plan.channel in together]
    names = tuple(plan.channel for plan in group)
    apart = sum(texture_bytes(volume) for plan in (group or plans) for volume in plan.volumes)
    reason = "the scene keeps them apart" if wanted == "apart" else next(_obstacles(group, scene), None)
    volumes = [] if reason else [_packed(group, level, names, scene.mosaic.gutter) for level in group[0].levels]
    if volumes and scene.textures.mipmaps:
        levels, profile = group[0].levels, group[0].profile
        volumes = in_one_texture(volumes, levels, profile, _beside(group, levels[0].index))
    misfit = next((volume for volume in volumes if isinstance(volume, Misfit)), None)
    if reason or misfit is not None:
        reason = reason or f"packed they do not fit: {misfit.reason if misfit else ''}"
        item = PlanItem(name="packed channels", kind="packed-channels", kept=False, reason=reason, size_bytes=apart)
        return Packed((), reason, (item,) if len(plans) > 1 else ())
    made = tuple(volume for volume in volumes if isinstance(volume, VolumePlan))
    layout = "3D texture" if made[0].mosaic is None else mosaic_text(made[0].mosaic)
    reason = f"one fetch from a {made[0].format} {layout} gives {', '.join(names)}; apart they take {apart} bytes"
    item = PlanItem(
        name="packed channels",
        kind="packed-channels",
        kept=True,
        reason=reason,
        files=tuple(dict.fromkeys(file for volume in made for file in volume.files)),
        size_bytes=sum(texture_bytes(volume) for volume in made),
    )
    return Packed(made, reason, (item,))


def _obstacles(group: Sequence[ChannelPlan], scene: Scene) -> Iterator[str]:
    """Return the reasons why channels cannot share texels, the most important first. Each assumes the ones before."""
    if len(group) < 2:
        yield "each program draws one channel, and would fetch the others in vain"
    if len({plan.grid for plan in group}) > 1:
        yield "they lie on several grids"
    if len(group) > _MOST:
        yield f"a texel has {_MOST} components, and there are {len(group)} channels"
    if scene.textures.compression in get_args(Compression) and scene.colour is None:
        yield "compressed texels hold one channel"
    differences = {
        "bits": {str(plan.quantize.bits) for plan in group},
        "levels": {", ".join(str(level.index) for level in plan.levels) for plan in group},
    }
    for what, found in differences.items():
        if len(found) > 1:
            yield f"their {what} differ: {' and '.join(sorted(found))}"
    if any(volume.bricks is not None for plan in group for volume in plan.volumes):
        yield "bricks hold one channel"
    bits, profile = group[0].quantize.bits, group[0].profile
    if bits > 8 and scene.colour is None:
        yield f"no profile has texels of {len(group)} components of {bits} bits"
    if any(plan.quantize.labels for plan in group):
        yield "labels are not filtered as values are"
    if _FORMATS[len(group)] not in profile.texture_formats:
        yield f"profile {profile.name} has no texture format of {len(group)} components"


def _packed(group: Sequence[ChannelPlan], level: LevelPlan, names: tuple[str, ...], gutter: int) -> VolumePlan | Misfit:
    """Lay out a level of several channels, or say why it does not fit."""
    profile, name = group[0].profile, f"packed-{level.index}"
    wide = group[0].quantize.bits > 8
    texel: TextureFormat | None = SRGB if wide else if_held(_FORMATS[len(names)], profile)
    block = BLOCKS[COLOUR_FORM].size if group[0].volumes[0].format == COLOUR_FORM else 1
    if block > 1:
        texel = COLOUR_FORM
    assert texel is not None  # noqa: S101 - that is no obstacle
    beside = _beside(group, level.index)
    layout = None
    if group[0].volumes[0].mosaic is not None:
        textures = max(1, min(profile.texture_units - beside.units, MOST_TEXTURES))
        packing = Packing(gutter=gutter, block=block, components_per_voxel=len(names))
        fit = mosaic_of(level, packing, textures, profile)
        if isinstance(fit, Misfit):
            return fit
        layout = fit
    textures_of = part_names(name, 1 if layout is None else layout.textures)
    volume = VolumePlan(
        level=level.index,
        names=textures_of,
        files=tuple(f"textures/{texture}.ktx2" for texture in textures_of),
        format=texel,
        shape_zyx=level.shape_zyx if layout is None else (1, *layout.texture_shape_yx),
        mosaic=layout,
        channels=names,
    )
    return too_large(volume, profile, beside) or volume


def _beside(group: Sequence[ChannelPlan], level: int) -> Beside:
    """Return what a program of all channels samples beside their level: a table and the normals of each channel."""
    units = size = 0
    for plan in group:
        tables = [size_bytes(table.format, (1, 1, table.entries)) for table in plan.lookups]
        tables += [size_bytes(table.format, table.shape_zyx) for table in plan.preintegrated]
        planned = plan.part(NormalsPlan)
        normals = [] if planned is None else planned.of_level(level)
        units += (1 if tables else 0) + sum(len(texture.files) for texture in normals)
        size += max(tables, default=0)
        if planned is not None:
            size += sum(size_bytes(planned.format, texture.shape_zyx) * len(texture.files) for texture in normals)
    return Beside(units=units, bytes=size)
