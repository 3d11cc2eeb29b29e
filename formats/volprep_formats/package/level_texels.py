"""The voxels of a level as its texture holds them, or the textures of its mosaic."""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.package.reader import Package
from volprep_formats.textures import ktx2
from volprep_formats.textures.mosaic import slices_of_mosaic


def level_texels(package: Package, level: int) -> NDArray[np.generic]:
    """Read the volume of `level`, which a texture must hold, as [z, y, x].

    Raises what `Package.read_bytes` and the texture reader raise.
    """
    textures = [each for each in package.manifest.textures if each.role == "volume" and each.level == level]
    images = [
        ktx2.decode(package.read_bytes(texture.file), texture.file).data
        for texture in sorted(textures, key=lambda texture: texture.part)
    ]
    mosaic = textures[0].mosaic
    return images[0] if mosaic is None else slices_of_mosaic([image[0] for image in images], mosaic)
