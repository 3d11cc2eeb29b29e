"""The voxels of a level as its texture holds them, or the textures of its mosaic."""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.package.reader import Package
from volprep_formats.textures import ktx2
from volprep_formats.textures.mosaic import slices_of_mosaic


def level_texels(package: Package, level: int, channel: str | None = None) -> NDArray[np.generic]:
    """Read the volume of `level`, which a texture must hold, as [z, y, x]; of several channels the first unless named.

    Raises what `Package.read_bytes` and the texture reader raise.
    """
    volumes = [each for each in package.manifest.textures if each.role == "volume" and each.level == level]
    wanted = volumes[0].channel if channel is None else channel
    textures = sorted((each for each in volumes if each.channel == wanted), key=lambda texture: texture.part)
    images = [ktx2.decode(package.read_bytes(texture.file), texture.file).data for texture in textures]
    mosaic = textures[0].mosaic
    return images[0] if mosaic is None else slices_of_mosaic([image[0] for image in images], mosaic)
