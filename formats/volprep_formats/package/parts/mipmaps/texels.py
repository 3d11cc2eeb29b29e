"""How the box of a volume maps to the texels of a level, which a mipmap may have more of than the level has voxels."""

from collections.abc import Iterable

from volprep_formats.grid import Vector
from volprep_formats.package.channel import Level
from volprep_formats.package.texture import Texture


def texture_from_box(level: Level, textures: Iterable[Texture]) -> Vector:
    """Return the factor from box millimetres to texture coordinates (x, y, z) of a level, given its textures."""
    of_mipmaps = (
        texture.shape_zyx for texture in textures if texture.mipmap is not None and texture.level == level.index
    )
    texels_zyx = next(of_mipmaps, level.grid.shape_zyx)
    z, y, x = (1 / (n * h) for n, h in zip(texels_zyx, level.grid.spacing_mm_zyx, strict=True))
    return x, y, z
