"""Whether the textures of empty-space skipping hold what an app reads and writes when it edits functions."""

from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.skip.record import BlockRangesRecord, Skipping, SkipTable
from volprep_formats.package.texture import Texture
from volprep_formats.textures.texel_formats import has_bytes

_ENDS = 2


def skip_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of skip tables and ranges of blocks."""
    skipping = manifest.skipping or Skipping()
    textures = {(texture.role, texture.name): texture for texture in manifest.textures}
    for table in skipping.tables:
        held = textures.get(("skip", table.texture))
        yield from (f"skip table {table.texture} {problem}" for problem in _described(table, "skip", 1, held))
        if held is not None and not has_bytes(held.format):
            yield f"skip table {table.texture} has entries that are no bytes"
    for ranges in skipping.ranges:
        held = textures.get(("ranges", ranges.texture))
        yield from (f"ranges of {ranges.texture} {problem}" for problem in _described(ranges, "ranges", _ENDS, held))


def _described(record: SkipTable | BlockRangesRecord, role: str, times: int, texture: Texture | None) -> Iterator[str]:
    """A texture has `times` slices for each block along z, and room for them where it is a mosaic."""
    if texture is None:
        yield f"has no texture of role {role}"
        return
    z, height, width = record.blocks_zyx
    slices = times * z
    layout = texture.mosaic
    held = texture.shape_zyx if layout is None else (layout.slices, *layout.tile_shape_yx)
    if held != (slices, height, width):
        yield f"has {held} texels instead of {(slices, height, width)}"
    if layout is not None and (layout.slices_per_texel, layout.gutter, layout.textures) != (1, 0, 1):
        yield "is a mosaic with a gutter, of several textures, or with several slices in a texel"
