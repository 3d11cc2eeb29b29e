"""Check the empty-space skipping of a manifest against its levels, textures and programs."""

from collections import Counter
from collections.abc import Iterator

from volprep_formats.grid import Grid, blocks_along
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.skip.record import BlockRangesRecord, Skipping, SkipTable
from volprep_formats.package.texture import Texture
from volprep_formats.textures.texel_formats import has_bytes

_OCTANTS = 8
_ENDS = 2


def skip_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of skip tables and ranges of blocks."""
    skipping = manifest.skipping or Skipping()
    textures = {texture.name: texture for texture in manifest.textures}
    grids = {level.index: level.grid for level in manifest.levels}
    names = [table.texture for table in skipping.tables] + [ranges.texture for ranges in skipping.ranges]
    named = Counter(names)
    for texture in manifest.textures:
        if texture.role in {"skip", "ranges"} and named[texture.name] != 1:
            yield f"texture {texture.name} is named by {named[texture.name]} skip tables or ranges instead of one"
    for table in skipping.tables:
        name = f"skip table {table.texture}"
        grid, held = grids.get(table.level), textures.get(table.texture)
        yield from (f"{name} {problem}" for problem in _described(table, "skip", grid, held))
        if table.transfer not in {function.name for function in manifest.transfer_functions}:
            yield f"{name} is for {table.transfer}, which is no transfer function"
        if held is not None and held.transfer != table.transfer:
            yield f"{name} is for {table.transfer}, its texture for {held.transfer}"
    for ranges in skipping.ranges:
        found = _described(ranges, "ranges", grids.get(ranges.level), textures.get(ranges.texture))
        yield from (f"ranges of blocks {ranges.texture} {problem}" for problem in found)


def shared_skip_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of the skip tables of pictures, of several channels or of segments."""
    for picture in (manifest.together, manifest.segments):
        if picture is not None:
            yield from _of_picture(manifest, picture.name)


def _of_picture(manifest: Manifest, picture: str) -> Iterator[str]:
    skipping = manifest.skipping or Skipping()
    tables = [table for table in skipping.tables if table.transfer == picture]
    named = Counter(table.texture for table in tables)
    textures = {texture.name: texture for texture in manifest.textures}
    grids = {level.index: level.grid for level in manifest.levels}
    for texture in manifest.textures:
        if texture.role == "skip" and texture.transfer == picture and named[texture.name] != 1:
            yield f"texture {texture.name} is named by {named[texture.name]} skip tables or ranges instead of one"
    for table in tables:
        grid, held = grids.get(table.level), textures.get(table.texture)
        yield from (f"skip table {table.texture} {problem}" for problem in _described(table, "skip", grid, held))
        if held is not None and held.transfer != picture:
            yield f"skip table {table.texture} is for {picture}, its texture for {held.transfer}"


def _described(
    record: SkipTable | BlockRangesRecord, role: str, grid: Grid | None, texture: Texture | None
) -> Iterator[str]:
    if grid is None:
        yield f"is for level {record.level}, which is not among the levels"
        return
    z, y, x = (blocks_along(voxels, record.block) for voxels in grid.shape_zyx)
    if record.blocks_zyx != (z, y, x):
        yield f"has {record.blocks_zyx} blocks; its level has {(z, y, x)} of {record.block} cells"
    if texture is None or texture.role != role or texture.level != record.level:
        yield f"has no texture of role {role} for its level"
        return
    times = _ENDS if isinstance(record, BlockRangesRecord) else _OCTANTS if record.kind == "octants" else 1
    slices, height, width = times * z, y, x
    layout = texture.mosaic
    if layout is None:
        shape, held = texture.shape_zyx, (slices, height, width)
    else:
        shape, held = (layout.slices, *layout.tile_shape_yx), (slices, height, width)
        if texture.shape_zyx != (1, *layout.texture_shape_yx) or (layout.slices_per_texel, layout.gutter) != (1, 0):
            yield "is a mosaic of another shape, with a gutter, or with several slices in a texel"
        if layout.tiles_x * layout.tiles_y < slices or layout.textures != 1:
            yield "is a mosaic without room for its slices, or of several textures"
        if layout.tiles_x * width > texture.shape_zyx[2] or layout.tiles_y * height > texture.shape_zyx[1]:
            yield "is a mosaic whose tiles do not fit into its texture"
    if shape != held:
        yield f"has {shape} texels instead of {held}"
    if role == "skip" and not has_bytes(texture.format):
        yield "has entries that are no bytes"
