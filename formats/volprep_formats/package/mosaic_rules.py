"""Check the layout of a mosaic; docs/CHECKS.md states the rules."""

from collections.abc import Iterator

from volprep_formats.package.texture import Texture
from volprep_formats.textures.block_formats import block_of
from volprep_formats.textures.mosaic import tiles_of
from volprep_formats.textures.texel_formats import COMPONENTS


def mosaic_contradictions(texture: Texture, shape_zyx: tuple[int, int, int]) -> Iterator[str]:
    """Return every problem of the mosaic of a texture that holds `shape_zyx` voxels; none if it has no mosaic."""
    mosaic = texture.mosaic
    if mosaic is None:
        return
    if (mosaic.slices, *mosaic.tile_shape_yx) != shape_zyx:
        yield f"its mosaic holds {mosaic.slices} slices of {mosaic.tile_shape_yx}, its level {shape_zyx}"
    tiles = tiles_of(mosaic.slices, mosaic.slices_per_texel, mosaic.order)
    if mosaic.tiles_x * mosaic.tiles_y * mosaic.textures < tiles:
        yield f"its mosaic has no room for {mosaic.slices} slices"
    rows, columns = mosaic.pitch_yx
    texture_rows, texture_columns = mosaic.texture_shape_yx
    if mosaic.tiles_y * rows > texture_rows or mosaic.tiles_x * columns > texture_columns:
        yield f"its tiles do not fit into textures of {mosaic.texture_shape_yx}"
    if texture.shape_zyx != (1, *mosaic.texture_shape_yx):
        yield f"its shape {texture.shape_zyx} is not that of its mosaic"
    if mosaic.slices_per_texel > 1 < mosaic.components_per_voxel:
        yield "its mosaic has several components in a voxel and several slices in a texel"
    if mosaic.slices_per_texel == 1 and mosaic.order != "interleaved":
        yield f"its mosaic has one slice in a texel, but these are {mosaic.order}"
    block = block_of(texture.format)
    held = COMPONENTS.get(texture.format) if block is None else block.components
    components = mosaic.slices_per_texel * mosaic.components_per_voxel
    if components != held:
        yield f"its mosaic has {components} components, its format is {texture.format}"
    if any(pitch % (1 if block is None else block.size) for pitch in mosaic.pitch_yx):
        yield f"its tiles are {rows}×{columns} texels apart, so that blocks of {texture.format} mix two"
