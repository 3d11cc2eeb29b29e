"""Whether levels that share a file agree with each other, as mipmaps of one 3D texture."""

from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.texture import Texture
from volprep_formats.textures.ktx2 import Shape, mipmap_shape


def mipmap_shapes(manifest: Manifest) -> dict[int | None, Shape]:
    """Return the texels of each level that is a mipmap: at least as many as it has voxels."""
    return {texture.level: texture.shape_zyx for texture in manifest.textures if texture.mipmap is not None}


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
    chained = {texture.level for texture in manifest.textures if texture.mipmap is not None}
    for program in manifest.programs:
        chooses = any(uniform.source == "mipmap" for uniform in program.uniforms)
        if any((level in chained) != chooses for level in program.levels):
            yield f"program {program.name} must have a uniform mipmap if and only if its levels are mipmaps"


def _chain(textures: list[Texture]) -> Iterator[str]:
    finest = textures[0]
    if [texture.mipmap for texture in textures] != list(range(len(textures))):
        yield f"is shared by {len(textures)} textures, which are not its mipmaps 0 to {len(textures) - 1} in order"
    for mipmap, texture in enumerate(textures):
        if (texture.role, texture.gl.target, texture.mosaic) != ("volume", "TEXTURE_3D", None):
            yield f"holds mipmaps, but {texture.name} is no volume in a 3D texture"
        if texture.shape_zyx != mipmap_shape(finest.shape_zyx, mipmap):
            yield f"holds mipmap {mipmap} of {texture.shape_zyx} texels, which is wrong for {finest.shape_zyx}"
        if texture.gl != finest.gl:
            yield "holds mipmaps of several formats"
