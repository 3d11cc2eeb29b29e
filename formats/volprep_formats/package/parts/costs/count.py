"""Upload bytes and memory of a manifest's textures, for each level and transfer function."""

from collections.abc import Iterable, Iterator, Sequence

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.costs.record import DrawCost
from volprep_formats.package.profile import TextureFormat
from volprep_formats.package.sampled import sampled_textures
from volprep_formats.package.texture import Texture
from volprep_formats.textures.gl_formats import gpu_bytes, size_bytes, texture_format
from volprep_formats.textures.paletted import PALETTE_BYTES

Image = tuple[TextureFormat, tuple[int, int, int]]
"""Format and shape (z, y, x) of a texture or a mipmap."""
_VERTEX_BYTES = 12
"""Three floats."""
_TRIANGLE_BYTES = 6
"""Three indices of 16 bits."""


def draw_costs(manifest: Manifest) -> tuple[DrawCost, ...]:
    """Return the cost of each transfer function at each level, in the order in which the programs draw them.

    Textures of unknown formats count as nothing: other rules report them.
    """
    return tuple(_costs(manifest))


def _costs(manifest: Manifest) -> Iterator[DrawCost]:
    if not manifest.profile.has_shaders:
        slices = [texture for texture in manifest.textures if texture.role == "slices"]
        for transfer, level in dict.fromkeys((str(each.transfer), each.level or 0) for each in slices):
            own = [each for each in slices if (each.transfer, each.level or 0) == (transfer, level)]
            yield _cost(manifest, transfer, level, own)
        return
    drawn = {(each.transfer, level): each for each in reversed(manifest.programs) for level in each.levels}
    for program in manifest.programs:
        for level in program.levels:
            if drawn[program.transfer, level] is program:
                found = [each for each in sampled_textures(manifest, program, level) if each is not None]
                yield _cost(manifest, program.transfer, level, found)


def _cost(manifest: Manifest, transfer: str, level: int, textures: Sequence[Texture]) -> DrawCost:
    meshes = manifest.proxy.meshes if manifest.proxy is not None else ()
    own = [mesh for mesh in meshes if (mesh.transfer, mesh.level) == (transfer, level)]
    mesh_bytes = sum(mesh.vertices * _VERTEX_BYTES + mesh.triangles * _TRIANGLE_BYTES for mesh in own)
    # Two samplers may read one texture, which is uploaded once.
    each = {texture.name: texture for texture in textures}.values()
    return cost_of(transfer, level, [image for texture in each for image in _images(manifest, texture)], mesh_bytes)


def cost_of(transfer: str, level: int, images: Iterable[Image], mesh_bytes: int = 0) -> DrawCost:
    """Return the cost of one picture: the images of its textures, each mipmap by itself, and its mesh."""
    held = [*images]
    palettes = PALETTE_BYTES * sum(name == "PALETTE8_RGBA8" for name, _ in held)
    return DrawCost(
        transfer=transfer,
        level=level,
        upload_bytes=mesh_bytes + palettes + sum(size_bytes(*image) for image in held),
        gpu_bytes=mesh_bytes + sum(gpu_bytes(*image) for image in held),
    )


def _images(manifest: Manifest, texture: Texture) -> list[Image]:
    """Return format and shape of a texture, or of each mipmap of it."""
    name = texture_format(texture.gl, manifest.profile.api)
    if name is None:
        return []
    if texture.mipmap is None:
        return [(name, texture.shape_zyx)]
    return [(name, each.shape_zyx) for each in manifest.textures if each.file == texture.file]
