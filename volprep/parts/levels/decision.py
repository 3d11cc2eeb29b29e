"""Which levels there could be, and how the device class can hold each of them."""

import math
from typing import Literal

from volprep.compositing import COMPOSITINGS
from volprep.parts.levels.reduce import LABEL_FILTERS
from volprep.parts.mosaic.decision import as_compressed_mosaic, as_mosaic
from volprep.plan.records import LevelPlan, VolumePlan
from volprep.plan.room import Beside, Misfit, one_channel, too_large
from volprep.scene.scene import MosaicSettings, Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import SampleFilter
from volprep_formats.textures.block_formats import CompressedFormat

_NEARLY_EQUAL = math.sqrt(2)
"""Spacings closer than this are halved together: of two axes the one that stays behind is never the finer one."""
_MOST_VOXELS_OF_A_BLOCK = 2**21
"""Kernels that need a block whole, such as the median's, take no larger ones."""


def filter_of(scene: Scene) -> Literal["auto"] | LevelFilter:
    """Return the filter that makes the coarser levels.

    Raises VP3024 for one that would put values between labels, VP3044 for one of classified voxels where none are.
    """
    labels = scene.source.labels
    wanted = scene.pyramid.filter
    if wanted == "transmittance" and scene.render.classification != "preclassified":
        raise VolprepError("VP3044")
    if wanted == "auto":
        return "mode" if labels else COMPOSITINGS[scene.render.compositing].level_filter or "auto"
    if labels and wanted not in LABEL_FILTERS:
        raise VolprepError("VP3024", filter=wanted, possible=", ".join(sorted(LABEL_FILTERS)))
    return wanted


def candidate_levels(
    channel: str,
    grid: Grid,
    coarsest_longest_axis: int,
    profile: DeviceProfile,
    made_by: Literal["auto"] | LevelFilter = "auto",
) -> list[LevelPlan]:
    """List the levels from level 0 down to the first whose longest axis has at most so many voxels.

    It ends before that where a voxel of the next would stand for more than 2^21. Each halves those axes of the one
    before whose spacing is nearly the smallest, so that voxels come closer to cubes; odd sizes round up. Where levels
    are mosaics only the longest of these axes is halved: the package holds one level, and the finest that fits loses
    less when the steps between levels are small.
    """
    factors = (1, 1, 1)
    levels: list[LevelPlan] = []
    while True:
        z, y, x = (-(-n // f) for n, f in zip(grid.shape_zyx, factors, strict=True))
        index = len(levels)
        levels.append(
            LevelPlan(
                channel=channel,
                index=index,
                factors_zyx=factors,
                shape_zyx=(z, y, x),
                filter=made_by if index else "none",
            )
        )
        if max(z, y, x) <= coarsest_longest_axis:
            return levels
        factors = _halved(grid, factors, (z, y, x), one_axis=profile.max_3d_texture_size == 0)
        if math.prod(factors) > _MOST_VOXELS_OF_A_BLOCK:
            return levels


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


def fit_level(  # noqa: PLR0917 - the level, the device class, and what is wanted
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
            f"{by(level.shape_zyx)} voxels, but 3D textures of profile {profile.name} have at most "
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


def by(shape_zyx: tuple[int, int, int]) -> str:
    """Write a shape for people, x first."""
    return "×".join(str(n) for n in reversed(shape_zyx))
