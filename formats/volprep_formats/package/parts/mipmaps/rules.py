"""Whether levels that share a file agree with each other, as mipmaps of one 3D texture."""

from collections.abc import Iterable, Iterator

from volprep_formats.grid import Vector
from volprep_formats.package.channel import Level
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.texture import Texture
from volprep_formats.textures.ktx2 import mipmap_shape


def texture_from_box(level: Level, textures: Iterable[Texture]) -> Vector:
    """Return the factor from box millimetres to texture coordinates (x, y, z) of a level, given its textures.

    A mipmap may have more texels than the level has voxels.
    """
    of_mipmaps = (each.shape_zyx for each in textures if each.mipmap is not None and each.level == level.index)
    texels_zyx = next(of_mipmaps, level.grid.shape_zyx)
    z, y, x = (1 / (n * h) for n, h in zip(texels_zyx, level.grid.spacing_mm_zyx, strict=True))
    return x, y, z


def mipmap_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of the textures that share a file, or say that they do."""
    files: dict[str, list[Texture]] = {}
    for texture in manifest.textures:
        files.setdefault(texture.file, []).append(texture)
    grids = {level.index: level.grid for level in manifest.levels}
    for file, textures in files.items():
        if len(textures) == 1 and textures[0].mipmap is None:
            continue
        yield from (f"{file} {problem}" for problem in _chain(textures))
        for texture in textures:
            grid = grids.get(-1 if texture.level is None else texture.level)
            if grid is not None and any(n > m for n, m in zip(grid.shape_zyx, texture.shape_zyx, strict=True)):
                yield f"texture {texture.name} has {texture.shape_zyx} texels, its level {grid.shape_zyx} voxels"


def _chain(textures: list[Texture]) -> Iterator[str]:
    finest = textures[0]
    if [texture.mipmap for texture in textures] != list(range(len(textures))):
        yield f"is shared by {len(textures)} textures, which are not its mipmaps 0 to {len(textures) - 1} in order"
    for mipmap, texture in enumerate(textures):
        if (texture.role, texture.dimension, texture.mosaic) != ("volume", "3d", None):
            yield f"holds mipmaps, but {texture.name} is no volume in a 3D texture"
        if texture.shape_zyx != mipmap_shape(finest.shape_zyx, mipmap):
            yield f"holds mipmap {mipmap} of {texture.shape_zyx} texels, which is wrong for {finest.shape_zyx}"
        if texture.format != finest.format:
            yield "holds mipmaps of several formats"
