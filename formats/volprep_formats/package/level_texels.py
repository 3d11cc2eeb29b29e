"""The voxels of a level as its texture holds them, or the textures of its mosaic."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import blocks_along
from volprep_formats.package.parts.bricks.places import index_entries, misplaced, voxels_of_bricks
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import MosaicLayout, Texture
from volprep_formats.textures import ktx2
from volprep_formats.textures.block_formats import BLOCKS
from volprep_formats.textures.mosaic import slices_of_mosaic
from volprep_formats.textures.srgb_texels import decoded_srgb
from volprep_formats.textures.texel_formats import SRGB


def level_texels(package: Package, level: int, role: Literal["volume", "normals"] = "volume") -> NDArray[np.generic]:
    """Read the volume of `level`, which a texture must hold, as [z, y, x]; of several channels that of `package`.

    Or its normals, as [z, y, x, byte]. Compressed and sRGB values come as normalised float32. Raises what
    `Package.read_bytes` and the texture reader raise.
    """
    held = package.manifest.textures_of(role, level=level)
    textures = sorted(
        (texture for texture in held if texture.channels == held[0].channels), key=lambda texture: texture.part
    )
    mosaic = textures[0].mosaic
    if [texture.part for texture in textures] != list(range(1 if mosaic is None else mosaic.textures)):
        problem = f"the {role} of level {level} is in {len(textures)} textures, which are not each part of it once"
        raise VolprepError("VP4011", path=package.path, problem=problem)
    files = [ktx2.decode(package.read_bytes(texture.file), texture.file) for texture in textures]
    bricks = textures[0].bricks
    if textures[0].mipmap is None:
        images = [_texels(file, mosaic) for file in files]
        voxels = images[0] if mosaic is None else slices_of_mosaic([image[0] for image in images], mosaic)
        if bricks is not None:
            voxels = _from_bricks(package, textures[0], voxels, bricks)
    else:
        voxels = _from_mipmap(package, textures[0], files[0])
    if len(textures[0].channels) < 2:
        return voxels
    component = package.component_of(textures[0])
    chosen = voxels[..., component]
    return chosen if textures[0].format != SRGB else decoded_srgb(chosen, component)


@dataclass(frozen=True)
class StoredTexels:
    """Texels [z, y, x] of a level, which are read when they are asked for."""

    package: Package
    file: str
    """The texture."""
    at_bytes: int
    """Offset of its texels."""
    dtype: np.dtype[np.generic]
    shape: tuple[int, int, int]

    def __getitem__(self, z: slice) -> NDArray[np.generic]:
        """Return some slices. Raises what `Package.read_part` raises."""
        begin, end, _ = z.indices(self.shape[0])
        _, height, width = self.shape
        slice_bytes = height * width * self.dtype.itemsize
        data = self.package.read_part(self.file, self.at_bytes + begin * slice_bytes, (end - begin) * slice_bytes)
        return np.frombuffer(data, self.dtype).reshape(-1, height, width)


def stored_texels(package: Package, level: int) -> StoredTexels | None:
    """Return the volume of a level to be read slice by slice; None where its slices do not follow each other in a file.

    Raises what `level_texels` raises.
    """
    texture = next(iter(package.manifest.textures_of("volume", level=level)), None)
    record = next((file for file in package.manifest.files if texture and file.path == texture.file), None)
    if texture is None or record is None:
        # The code that reads the whole level reports the error.
        return None
    alone = (texture.mosaic, texture.bricks, texture.mipmap) == (None, None, None) and len(texture.channels) < 2
    if not alone:
        return None
    start = package.read_start(texture.file, ktx2.MOST_HEAD_BYTES)
    head = ktx2.decode_head(start, record.size_bytes, texture.file)
    if head.channels != 1 or head.format in BLOCKS or head.supercompressed:
        return None
    return StoredTexels(package, texture.file, head.levels_at[0], head.dtype, head.shape_zyx)


def _from_mipmap(package: Package, texture: Texture, file: ktx2.Ktx2Image) -> NDArray[np.generic]:
    """Return the voxels of a mipmap level without the repeated padding."""
    mipmap, shape_zyx = texture.mipmap or 0, package.manifest.level(texture.level).grid.shape_zyx
    if mipmap >= len(file.levels) or any(n > m for n, m in zip(shape_zyx, file.levels[mipmap].shape, strict=False)):
        problem = f"{texture.file} does not hold {shape_zyx} voxels as its mipmap {mipmap}"
        raise VolprepError("VP4011", path=package.path, problem=problem)
    return file.levels[mipmap][tuple(slice(n) for n in shape_zyx)]


def _from_bricks(
    package: Package, pool: Texture, texels: NDArray[np.generic], layout: BrickLayout
) -> NDArray[np.generic]:
    """Return the voxels of a level stored as bricks."""
    held = package.manifest.textures_of("bricks", level=pool.level)
    places = next((texture for texture in held if texture.channels == pool.channels), None)
    problem: str | None = f"no texture says where the bricks of {pool.file} are"
    if places is not None:
        file = ktx2.decode(package.read_bytes(places.file), places.file)
        entries = index_entries(file.data, places.mosaic)
        problem = misplaced(entries, layout) if file.format == "rgba8unorm" else "is not rgba8unorm"
        shape_zyx = package.manifest.level(pool.level).grid.shape_zyx
        counts = tuple(blocks_along(n, cells) for n, cells in zip(shape_zyx, layout.cells_zyx, strict=True))
        if problem is None and (texels.shape, counts) == (layout.pool_texels_zyx, layout.bricks_zyx):
            return voxels_of_bricks(texels, entries, layout, shape_zyx)
        problem = f"{places.file} {problem or f'and {pool.file} do not make {shape_zyx} voxels'}"
    raise VolprepError("VP4011", path=package.path, problem=problem)


def _texels(image: ktx2.Ktx2Image, mosaic: MosaicLayout | None) -> NDArray[np.generic]:
    if image.format not in BLOCKS or mosaic is None:
        return image.data
    from volprep_formats.textures.blocks import decode_blocks  # noqa: PLC0415 - codecs only where needed

    blocks = np.asarray(image.data[0], np.uint8)
    channels = mosaic.slices_per_texel * mosaic.components_per_voxel
    return decode_blocks(blocks, image.format, mosaic.texture_shape_yx, channels)[None]
