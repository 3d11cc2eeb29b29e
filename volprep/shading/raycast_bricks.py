"""Ray casting through bricks: a texture says where in another one each brick lies. Both are 3D textures, or mosaics.

The layout is constant in the shader. Empty bricks cost a fetch from the first texture only.
"""

from volprep.shading.compose import Instance, Slot, literal
from volprep.shading.feature import Feature
from volprep.shading.mosaic import Mosaic
from volprep.shading.positions import in_voxels, voxel_positions
from volprep.shading.raycast_mosaic import values_of
from volprep_formats.grid import Grid
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.parts.on_demand.record import OnDemand
from volprep_formats.package.program import Sampler
from volprep_formats.package.texture import MosaicLayout, SampleFilter


def sampling(
    layout: BrickLayout, grid: Grid, *, gradients: bool, flat: tuple[Slot, tuple[Sampler, ...]] | None = None
) -> Feature:
    """Return how a level with these voxels is read; for `gradients` a voxel beyond a brick, too: its ghost voxels.

    `flat` is what `flat_pool` returns where pool and index are mosaics.
    """
    words = {
        "LAST_VOXEL": literal(*(n - 1 for n in grid.shape_zyx[::-1])),
        "CELLS": literal(*(max(n, 1) for n in layout.cells_zyx[::-1])),
        "LAST_BRICK": literal(*(n - 1 for n in layout.bricks_zyx[::-1])),
        "PITCH": literal(*layout.pitch_zyx[::-1]),
        "FIRST_TEXEL": literal(layout.reach - 0.5),
    }
    if flat is None:
        words["POOL"] = literal(*layout.pool_texels_zyx[::-1])
    solid = (Sampler(name="u_volume", role="volume"), Sampler(name="u_bricks", role="bricks"))
    pool, samplers = flat or ("sampling/bricks:texture3d", solid)
    slots: dict[str, Slot] = {"pool": pool, "value_near": "sampling/bricks:near" if gradients else None}
    return Feature(
        slots={"sampling": (voxel_positions(grid.spacing_mm_zyx), Instance("sampling/bricks", words, slots))},
        samplers=samplers,
        offers=in_voxels(grid.shape_zyx) | ({"NEAR": "value_near", "AROUND": "centre, "} if gradients else {}),
    )


def on_demand(layout: OnDemand, grid: Grid, *, gradients: bool) -> Feature:
    """Return how level 0 is read from those bricks of all levels that a device holds; `gradients` as of `sampling`."""
    factors = ", ".join(literal(*map(float, factor[::-1])) for factor in layout.factors_zyx)
    words = {
        "CELLS": literal(*(layout.size,) * 3),
        "LAST_BRICK": literal(*(n - 1 for n in layout.counts_zyx(0, grid.shape_zyx)[::-1])),
        "PITCH": literal(*(layout.pitch,) * 3),
        "POOL": literal(*layout.pool_zyx[::-1]),
        "LEVELS": str(len(layout.factors_zyx)),
        "FACTORS": factors,
        "FIRST_TEXEL": literal(layout.ghost),
    }
    near = "sampling/bricks:on_demand_near" if gradients else None
    slots: dict[str, Slot] = {"pool": "sampling/bricks:texture3d", "value_near": near}
    return Feature(
        slots={"sampling": (voxel_positions(grid.spacing_mm_zyx), Instance("sampling/bricks:on_demand", words, slots))},
        samplers=(Sampler(name="u_volume", role="brick-pool"), Sampler(name="u_bricks", role="brick-pages")),
        offers=in_voxels(grid.shape_zyx) | ({"NEAR": "value_near", "AROUND": "centre, "} if gradients else {}),
    )


def flat_pool(
    pool: MosaicLayout, index: MosaicLayout, component: str, between: SampleFilter
) -> tuple[Slot, tuple[Sampler, ...]]:
    """Return how the pool and the index of bricks are read from mosaics.

    A position in the pool is at least half a texel inside its brick, so that nothing is clamped.
    """
    about = "The pool as a mosaic: normalised stored values, 0 to 1, in tiles of one slice and channel each."
    bricks = Mosaic(about, pool, sampler="u_volume", role="volume", texel="tile_texel", prefix="POOL_", centres=True)
    about = "The index as a mosaic: one texel a brick, in tiles of one slice each."
    entries = Mosaic(
        about, index, sampler="u_bricks", role="bricks", texel="index_texel", prefix="INDEX_", centres=True
    )
    reads = values_of(bricks, component, between, {"STORED": "pool_value"})
    parts = (bricks.texels, *reads, entries.texels, entries.voxels("brick_entry", "nearest"))
    return parts, (*bricks.samplers, *entries.samplers)
