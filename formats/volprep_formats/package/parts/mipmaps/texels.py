"""How the box of a volume maps to the texels of a level, which a mipmap may have more of than the level has voxels."""

from collections.abc import Iterable

from volprep_formats.grid import Vector
from volprep_formats.package.channel import Level
from volprep_formats.package.texture import Texture


def texture_from_box(level: Level, textures: Iterable[Texture]) -> Vector:
    """Return the factor from box millimetres to texture coordinates (x, y, z) of a level, given its textures."""
    of_mipmaps = {texture.level: texture.shape_zyx for texture in textures if texture.mipmap is not None}
    texels_zyx = of_mipmaps.get(level.index, level.grid.shape_zyx)
    z, y, x = (1 / (n * h) for n, h in zip(texels_zyx, level.grid.spacing_mm_zyx, strict=True))
    return x, y, z
