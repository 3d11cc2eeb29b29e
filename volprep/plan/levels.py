"""Which levels there could be, and how the device class can hold each of them."""

import math
from dataclasses import dataclass
from typing import Literal

from volprep.mosaic import fit_mosaic
from volprep.plan.records import LevelPlan, VolumePlan
from volprep.render.gl_formats import BYTES_PER_TEXEL
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import MosaicLayout
from volprep_formats.package.profile import DeviceProfile, TextureFormat

_NEARLY_EQUAL = math.sqrt(2)
"""Spacings closer than this are halved together: of two axes the one that stays behind is never the finer one."""
ONE_CHANNEL: dict[int, tuple[TextureFormat, ...]] = {8: ("LUMINANCE8", "R8"), 16: ("R16F",)}
_CHANNELS: tuple[Literal[1, 4], ...] = (1, 4)
_FOUR_CHANNELS: dict[int, tuple[TextureFormat, ...]] = {8: ("RGBA8",), 16: ("RGBA16F",)}


@dataclass(frozen=True)
class Misfit:
    """A level that a device class cannot hold."""

    reason: str
    """Why, with the numbers."""


def candidate_levels(grid: Grid, coarsest_longest_axis: int, profile: DeviceProfile) -> list[LevelPlan]:
    """List the levels from level 0 down to the first whose longest axis has at most so many voxels.

    Each halves those axes of the one before whose spacing is nearly the smallest, so that voxels come closer to
    cubes; odd sizes round up. Where levels are mosaics only the longest of these axes is halved: the package holds
    one level, and the finest that fits loses less when the steps between levels are small.
    """
    factors = (1, 1, 1)
    levels: list[LevelPlan] = []
    while True:
        z, y, x = (-(-n // f) for n, f in zip(grid.shape_zyx, factors, strict=True))
        index = len(levels)
        levels.append(
            LevelPlan(index=index, factors_zyx=factors, shape_zyx=(z, y, x), filter="box" if index else "none")
        )
        if max(z, y, x) <= coarsest_longest_axis:
            return levels
        factors = _halved(grid, factors, (z, y, x), one_axis=profile.max_3d_texture_size == 0)


def _halved(
    grid: Grid, factors: tuple[int, int, int], shape: tuple[int, int, int], *, one_axis: bool
) -> tuple[int, int, int]:
    spacing = [f * h for f, h in zip(factors, grid.spacing_mm_zyx, strict=True)]
    # An axis of one voxel cannot get coarser.
    limit = min(h for h, n in zip(spacing, shape, strict=True) if n > 1) * _NEARLY_EQUAL
    axes = [axis for axis in range(3) if shape[axis] > 1 and spacing[axis] <= limit]
    if one_axis:
        axes = [max(axes, key=lambda axis: shape[axis])]
    z, y, x = (f * 2 if axis in axes else f for axis, f in enumerate(factors))
    return z, y, x


def fit_level(level: LevelPlan, bits: int, profile: DeviceProfile, other_bytes: int) -> VolumePlan | Misfit:
    """Lay a level out as the device class can hold it, beside `other_bytes` of other textures, or say why not."""
    volume = _as_texture3d(level, bits, profile) if profile.max_3d_texture_size else _as_mosaic(level, bits, profile)
    if isinstance(volume, Misfit):
        return volume
    size = texture_bytes(volume)
    if size + other_bytes > profile.max_texture_bytes:
        return Misfit(
            f"{size} bytes, with {other_bytes} for the lookup table, are more than the "
            f"{profile.max_texture_bytes} that profile {profile.name} has for textures"
        )
    return volume


def texture_bytes(volume: VolumePlan) -> int:
    """Size of a texture on the device."""
    return math.prod(volume.shape_zyx) * BYTES_PER_TEXEL[volume.format]


def _as_texture3d(level: LevelPlan, bits: int, profile: DeviceProfile) -> VolumePlan | Misfit:
    texel = first_of(ONE_CHANNEL[bits], profile)
    if texel is None:
        return Misfit(f"profile {profile.name} has no format of one channel and {bits} bits")
    if max(level.shape_zyx) > profile.max_3d_texture_size:
        return Misfit(
            f"{by(level.shape_zyx)} voxels, but 3D textures of profile {profile.name} hold at most "
            f"{profile.max_3d_texture_size} along an axis"
        )
    name = f"volume-{level.index}"
    return VolumePlan(
        level=level.index,
        name=name,
        file=f"textures/{name}.ktx2",
        format=texel,
        shape_zyx=level.shape_zyx,
        mosaic=None,
    )


def _as_mosaic(level: LevelPlan, bits: int, profile: DeviceProfile) -> VolumePlan | Misfit:
    for channels in _CHANNELS:
        texel = first_of((ONE_CHANNEL if channels == 1 else _FOUR_CHANNELS)[bits], profile)
        layout = fit_mosaic(level.shape_zyx, channels, profile.max_texture_size)
        if texel is not None and layout is not None:
            return _mosaic_plan(level, texel, layout)
    size = profile.max_texture_size
    depth, height, width = level.shape_zyx
    room = (size // height) * (size // width) * 4
    return Misfit(
        f"{depth} slices of {height}×{width} voxels, but a mosaic of {size}×{size} texels and four channels "
        f"has room for {room}"
    )


def _mosaic_plan(level: LevelPlan, texel: TextureFormat, layout: MosaicLayout) -> VolumePlan:
    height, width = layout.tile_shape_yx
    name = f"mosaic-{level.index}"
    return VolumePlan(
        level=level.index,
        name=name,
        file=f"textures/{name}.ktx2",
        format=texel,
        shape_zyx=(1, layout.tiles_y * height, layout.tiles_x * width),
        mosaic=layout,
    )


def first_of(formats: tuple[TextureFormat, ...], profile: DeviceProfile) -> TextureFormat | None:
    """Give the first of `formats` that a device class has."""
    return next((texel for texel in formats if texel in profile.texture_formats), None)


def by(shape: tuple[int, int, int]) -> str:
    """Write a shape for people."""
    return "×".join(str(n) for n in shape)
