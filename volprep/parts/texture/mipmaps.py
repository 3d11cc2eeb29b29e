"""Levels as the mipmaps of one texture, for apps that choose the level for each draw or each sample.

OpenGL halves every axis and rounds down, while levels round up, so that no voxel is lost: 447 voxels have 224 at level
1, and a texture of 447 texels has a mipmap of 223, whose texels would lie elsewhere. So the finest level is padded
until all halvings are whole, 448 for up to six mipmaps: its last voxels are repeated, beyond the end of the volume's
box, where the clamped field has the same values. Each mipmap is then its level of the pyramid, by whatever filter, and
texture coordinates are the same for all.
"""

from collections.abc import Iterator, Sequence
from typing import Literal

from volprep.plan.records import LevelPlan, VolumePlan
from volprep.plan.room import Beside, Misfit
from volprep.plan.shape_text import shape_text
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.textures.texel_formats import size_bytes

KIND = "mipmaps"
"""Kind of their item of the plan."""


def mipmap_levels(
    channel: str, grid: Grid, coarsest_longest_axis: int, profile: DeviceProfile, made_by: Literal["auto"] | LevelFilter
) -> list[LevelPlan]:
    """List the levels from level 0 down to the first whose longest axis has at most so many voxels.

    Each halves every axis of the one before, down to one voxel. Raises VP3071 where levels are no 3D textures.
    """
    if not profile.max_3d_texture_size:
        raise VolprepError("VP3071", profile=profile.name)
    longest = max(grid.shape_zyx)
    last = next(index for index in range(32) if -(-longest // 2**index) <= coarsest_longest_axis)
    return [_level(channel, grid, index, last, made_by) for index in range(last + 1)]


def in_one_texture(
    fits: Sequence[VolumePlan | Misfit], levels: Sequence[LevelPlan], profile: DeviceProfile, beside: Beside
) -> list[VolumePlan | Misfit]:
    """Make levels that fit as 3D textures mipmaps of one: from the finest level on that fits with all that follow."""
    tried: list[VolumePlan | Misfit] = []
    for first, fit in enumerate(fits):
        rest = zip(fits[first:], levels[first:], strict=True)
        volumes = [(volume, level) for volume, level in rest if isinstance(volume, VolumePlan)]
        if isinstance(fit, Misfit) or len(volumes) < len(fits) - first:
            tried.append(fit)
            continue
        chain = [
            volume.model_copy(update={"files": fit.files, "shape_zyx": level.texels_zyx, "mipmap": mipmap})
            for mipmap, (volume, level) in enumerate(volumes)
        ]
        misfit = _misfit(chain, profile, beside)
        if misfit is None:
            return [*tried, *chain]
        tried.append(misfit)
    return tried


def chain_bytes(volumes: Sequence[VolumePlan], volume: VolumePlan) -> int:
    """Size on the device of the textures of a level, with all mipmaps where they are one texture."""
    held = [other for other in volumes if other.files == volume.files]
    return sum(size_bytes(volume.format, volume.shape_zyx) * len(volume.files) for volume in held)


def describe_mipmaps(levels: Sequence[LevelPlan], volumes: Sequence[VolumePlan]) -> Iterator[PlanItem]:
    """Return whether levels of 3D textures are mipmaps of one, and what that costs."""
    finest = volumes[0]
    if finest.mosaic is not None or finest.bricks is not None:
        return
    if finest.mipmap is None:
        yield PlanItem(
            name="mipmaps", kind=KIND, kept=False, reason="the scene does not ask for them: each level is a texture"
        )
        return
    voxels = sum(size_bytes(finest.format, level.shape_zyx) for level in levels)
    texels = chain_bytes(volumes, finest)
    yield PlanItem(
        name="mipmaps",
        kind=KIND,
        kept=True,
        reason=f"the scene asks for them: {len(levels)} levels in one texture of {shape_text(finest.shape_zyx)} "
        f"texels, so that {shape_text(levels[0].shape_zyx)} voxels halve evenly; that takes {texels - voxels} bytes "
        "more",
    )


def _misfit(chain: Sequence[VolumePlan], profile: DeviceProfile, beside: Beside) -> Misfit | None:
    size, shape = chain_bytes(chain, chain[0]), chain[0].shape_zyx
    if max(shape) > profile.max_3d_texture_size:
        limit = f"profile {profile.name} holds at most {profile.max_3d_texture_size} along an axis"
        return Misfit(f"its mipmaps need {shape_text(shape)} texels, but a 3D texture of {limit}")
    if size + beside.bytes > profile.max_texture_bytes:
        limit = f"the {profile.max_texture_bytes} that profile {profile.name} has for textures"
        return Misfit(f"{size} bytes with mipmaps, and {beside.bytes} for other textures, are more than {limit}")
    return None


def _level(channel: str, grid: Grid, index: int, last: int, made_by: Literal["auto"] | LevelFilter) -> LevelPlan:
    padded = [_padded(n, last) for n in grid.shape_zyx]
    z, y, x = (min(2**index, n) for n in padded)
    return LevelPlan(
        channel=channel,
        index=index,
        factors_zyx=(z, y, x),
        shape_zyx=tuple(-(-n // f) for n, f in zip(grid.shape_zyx, (z, y, x), strict=True)),
        padded_zyx=tuple(n // f for n, f in zip(padded, (z, y, x), strict=True)),
        filter=made_by if index else "none",
    )


def _padded(voxels: int, halvings: int) -> int:
    """Texels of an axis that can be halved so often without a rest, or down to one."""
    power, step = 1 << (voxels - 1).bit_length(), 1 << halvings
    return min(power, -(-voxels // step) * step)
