"""Upload bytes and memory of the textures of a drawing."""

from collections.abc import Iterable, Sequence

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.proxy.record import ProxyMeshFile
from volprep_formats.package.picture import DrawCost
from volprep_formats.package.texture import Texture
from volprep_formats.textures.block_formats import BLOCKS
from volprep_formats.textures.paletted import PALETTE_BYTES
from volprep_formats.textures.texel_formats import BYTES_PER_TEXEL, PALETTED, gpu_bytes, size_bytes

Image = tuple[str, tuple[int, int, int]]
"""Format and shape (z, y, x) of a texture or a mipmap."""
_VERTEX_BYTES = 12
"""Three floats."""
_TRIANGLE_BYTES = 6
"""Three indices of 16 bits."""


def cost_of_textures(manifest: Manifest, textures: Sequence[Texture], meshes: Sequence[ProxyMeshFile]) -> DrawCost:
    """Return the cost of a drawing with these textures and meshes.

    Textures of unknown formats count as nothing: other rules report them.
    """
    mesh_bytes = sum(mesh.vertices * _VERTEX_BYTES + mesh.triangles * _TRIANGLE_BYTES for mesh in meshes)
    # Two samplers may read one texture, which is uploaded once.
    held = {texture.name: texture for texture in textures}.values()
    return cost_of([image for texture in held for image in _images(manifest, texture)], mesh_bytes)


def cost_of(images: Iterable[Image], mesh_bytes: int = 0) -> DrawCost:
    """Return the cost of a drawing: the images of its textures, each mipmap by itself, and its mesh."""
    held = [*images]
    palettes = PALETTE_BYTES * sum(name == PALETTED for name, _ in held)
    return DrawCost(
        upload_bytes=mesh_bytes + palettes + sum(size_bytes(*image) for image in held),
        gpu_bytes=mesh_bytes + sum(gpu_bytes(*image) for image in held),
    )


def _images(manifest: Manifest, texture: Texture) -> list[Image]:
    """Return format and shape of a texture, or of each mipmap of it."""
    if texture.format not in BYTES_PER_TEXEL and texture.format not in BLOCKS:
        return []
    if texture.mipmap is None:
        return [(texture.format, texture.shape_zyx)]
    return [(texture.format, same.shape_zyx) for same in manifest.textures if same.file == texture.file]
