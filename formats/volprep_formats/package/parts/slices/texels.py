"""The slices of a stack as its textures hold them: colours, cut out of their tiles."""

import numpy as np

from volprep_formats.arrays import UInt8Array
from volprep_formats.package.parts.slices.record import StackAxis
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.textures import ktx2, paletted
from volprep_formats.textures.texel_formats import PALETTED


def slice_texels(package: Package, transfer: str, axis: StackAxis) -> UInt8Array:
    """Read a stack, which there must be, as premultiplied linear colours [slice, row, column, RGBA].

    Raises what `Package.read_bytes` and the texture readers raise.
    """
    tiles: list[UInt8Array] = []
    for texture in sorted(package.manifest.textures, key=lambda texture: texture.part):
        layout = texture.slices
        if layout is None or (texture.transfer, layout.axis) != (transfer, axis):
            continue
        texels = _texels(package, texture)
        rows, columns = layout.slice_shape_yx
        for number in range(layout.slices):
            row, column = divmod(number, layout.tiles_x)
            tiles.append(texels[row * rows : (row + 1) * rows, column * columns : (column + 1) * columns])
    return np.stack(tiles)


def _texels(package: Package, texture: Texture) -> UInt8Array:
    """Return the texels of one texture [y, x, RGBA]."""
    data = package.read_bytes(texture.file)
    if texture.format == PALETTED:
        colours, indices = paletted.decode(data, (texture.shape_zyx[1], texture.shape_zyx[2]), texture.file)
        return colours[indices]
    return np.asarray(ktx2.decode(data, texture.file).data[0], np.uint8)
