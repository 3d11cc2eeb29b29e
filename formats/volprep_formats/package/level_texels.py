"""The voxels of a level as its texture holds them, or the textures of its mosaic."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep_formats.package.manifest import MosaicLayout, Texture
from volprep_formats.package.reader import Package
from volprep_formats.textures import ktx2
from volprep_formats.textures.block_formats import BLOCKS
from volprep_formats.textures.bricks import voxels_of_bricks
from volprep_formats.textures.mosaic import slices_of_mosaic


def level_texels(package: Package, level: int, role: Literal["volume", "normals"] = "volume") -> NDArray[np.generic]:
    """Read the volume of `level`, which a texture must hold, as [z, y, x]; of several channels that of `package`.

    Or its normals, as [z, y, x, byte]. Compressed values come as normalised float32. Raises what `Package.read_bytes`
    and the texture reader raise.
    """
    held = [each for each in package.manifest.textures if each.role == role and each.level == level]
    textures = sorted((each for each in held if each.channels == held[0].channels), key=lambda texture: texture.part)
    mosaic = textures[0].mosaic
    files = [ktx2.decode(package.read_bytes(texture.file), texture.file) for texture in textures]
    bricks = textures[0].bricks
    if bricks is not None:
        voxels = voxels_of_bricks(files[0].data, _places(package, textures[0]), bricks, _shape(package, level))
    elif textures[0].mipmap is None:
        images = [_texels(file, mosaic) for file in files]
        voxels = images[0] if mosaic is None else slices_of_mosaic([image[0] for image in images], mosaic)
    else:
        voxels = files[0].levels[textures[0].mipmap][tuple(slice(n) for n in _shape(package, level))]
    return voxels[..., package.component_of(textures[0])] if len(textures[0].channels or ()) > 1 else voxels


def _shape(package: Package, level: int) -> tuple[int, int, int]:
    return next(each.grid.shape_zyx for each in package.manifest.levels if each.index == level)


def _places(package: Package, pool: Texture) -> NDArray[np.uint8]:
    """Entries of the texture that says where bricks lie."""
    held = [each for each in package.manifest.textures if each.role == "bricks" and each.level == pool.level]
    file = next(each.file for each in held if each.channels == pool.channels)
    return np.asarray(ktx2.decode(package.read_bytes(file), file).data, np.uint8)


def _texels(image: ktx2.Ktx2Image, mosaic: MosaicLayout | None) -> NDArray[np.generic]:
    if image.format not in BLOCKS or mosaic is None:
        return image.data
    from volprep_formats.textures.blocks import decode_blocks  # noqa: PLC0415 - codecs are for those who need them

    blocks = np.asarray(image.data[0], np.uint8)
    return decode_blocks(blocks, image.format, mosaic.texture_shape_yx, mosaic.channels)[None]
