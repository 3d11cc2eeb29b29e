"""Check the bricks of a manifest against its levels, textures and programs."""

import math
from collections.abc import Iterator

from volprep_formats.grid import blocks_along
from volprep_formats.package.channel import Level
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.mosaic_rules import mosaic_contradictions
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.texture import Texture


def bricks_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of bricks that can be found without opening another file."""
    levels = {level.index: level for level in manifest.levels}
    pools = {texture.level: texture for texture in manifest.textures if texture.bricks is not None}
    places = [texture for texture in manifest.textures if texture.role == "bricks"]
    for texture in pools.values():
        level = levels.get(-1 if texture.level is None else texture.level)
        problems = [*_layout(texture), *(_of_level(texture, level) if level else ())]
        yield from (f"texture {texture.name} {problem}" for problem in problems)
        if [each.level for each in places].count(texture.level) != 1:
            yield f"texture {texture.name} holds bricks, and not one texture says where they are"
    for texture in places:
        pool = pools.get(texture.level)
        if pool is None or pool.bricks is None or not _is_index(texture, pool, pool.bricks):
            yield f"texture {texture.name} is not rgba8unorm, nearest, with a texel for each brick of its level"


def _is_index(texture: Texture, pool: Texture, layout: BrickLayout) -> bool:
    """Whether a texture has an entry for each brick: in a 3D texture, or in a mosaic where the pool is one."""
    mosaic = texture.mosaic
    if texture.format != "rgba8unorm" or texture.filter != "nearest":
        return False
    if mosaic is None:
        return pool.mosaic is None and texture.shape_zyx == layout.bricks_zyx
    plain = (mosaic.textures, mosaic.slices_per_texel, mosaic.gutter) == (1, 1, 0)
    return pool.mosaic is not None and plain and not [*mosaic_contradictions(texture, layout.bricks_zyx)]


def _layout(texture: Texture) -> Iterator[str]:
    layout = texture.bricks
    if layout is None:
        return
    if (texture.role, texture.mipmap, texture.dimension == "3d") != ("volume", None, texture.mosaic is None):
        yield "holds bricks, but is no volume in a 3D texture or a mosaic of its own"
    if texture.mosaic is not None:
        yield from mosaic_contradictions(texture, layout.pool_texels_zyx)
        if texture.mosaic.textures > 1 or texture.mosaic.components_per_voxel > 1:
            yield "holds bricks in a mosaic of several textures, or with several components in a voxel"
    elif texture.shape_zyx != layout.pool_texels_zyx:
        yield f"has {texture.shape_zyx} texels, its places for bricks {layout.pool_texels_zyx}"
    if layout.stored > min(math.prod(layout.pool_zyx), math.prod(layout.bricks_zyx)) or max(layout.pool_zyx) > 255:
        yield f"holds {layout.stored} bricks in {layout.pool_zyx} places, of {layout.bricks_zyx} in all"


def _of_level(texture: Texture, level: Level) -> Iterator[str]:
    layout = texture.bricks
    if layout is None:
        return
    shape = level.grid.shape_zyx
    counts = tuple(blocks_along(n, cells) for n, cells in zip(shape, layout.cells_zyx, strict=True))
    if any((cells == 0) != (n == 1) or cells >= n for n, cells in zip(shape, layout.cells_zyx, strict=True)):
        yield f"has bricks of {layout.cells_zyx} cells, its level {shape} voxels"
    elif counts != layout.bricks_zyx:
        yield f"has {layout.bricks_zyx} bricks of {layout.cells_zyx} cells, its level {shape} voxels"
