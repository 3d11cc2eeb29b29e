"""A level as one picture for people: its slices side by side, like a mosaic with one slice in a texel."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep.parts.mosaic.packing import Packing, Room, fit_mosaic, pack_mosaic
from volprep.truth.normal_codes import decoded
from volprep.truth.picture import encoded
from volprep_formats.arrays import UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import write_file
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.parts.normals.record import NormalCode
from volprep_formats.package.parts.slices.texels import slice_texels
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.png import png_bytes, require_png_place

LARGEST = 4096
"""Width and height that no picture exceeds."""


@dataclass(frozen=True)
class Montage:
    """A picture of slices."""

    pixels: UInt8Array
    """[H, W, 1], row 0 on top: the largest stored value is white. [H, W, 3] for normals, -1 is 0 and 1 is 255; and for
    colours, sRGB over black."""
    level: int
    """Level that it shows."""
    shown: int
    """Number of slices that it shows."""
    every: int
    """Slices from one that it shows to the next."""
    tiles_x: int
    """Slices in a row."""


def write_montage(package: Package, level: int | None, path: Path, *, normals: bool = False) -> Montage:
    """Write the montage of a level, the finest if None, or of its normals, to a PNG file.

    Raises VP1250 if no texture holds that, VP5021 if the file cannot be written.
    """
    role: Literal["volume", "normals", "slices"] = "normals" if normals else "volume"
    if not normals and package.manifest.textures_of("slices"):
        role = "slices"
    require_png_place(path)
    textures = package.manifest.textures_of(role)
    held = package.manifest.levels_of(role)
    if not held or level not in {None, *held}:
        wanted = f"{'' if level is None else level} with normals".strip() if normals else level
        raise VolprepError("VP1250", path=package.path, level=wanted, found=", ".join(map(str, held)) or "none")
    chosen = held[0] if level is None else level
    made = montage(_of_slices(package, textures) if role == "slices" else _of_level(package, chosen, role), chosen)
    write_file(path, png_bytes(made.pixels), "VP5021")
    return made


def montage(voxels: NDArray[np.generic], level: int = 0, largest: int = LARGEST) -> Montage:
    """Lay slices [z, y, x] side by side, as many as have room, evenly spaced; of wide ones only every so many voxels.

    `voxels` are uint8, uint16, or normalised floating point from 0 to 1; or colours [z, y, x, 3].
    """
    packing = Packing(components_per_voxel=3 if voxels.ndim == 4 else 1)
    thin = -(-max(voxels.shape[1:3]) // largest)
    slices = voxels[:, ::thin, ::thin]
    every = 1
    while (layout := fit_mosaic(_shape(slices[::every]), packing, Room(largest))) is None:
        every += 1
    shown = slices[::every]
    if shown.dtype.kind == "f":
        shown = np.rint(shown.astype(np.float32) * 255).astype(np.uint8)
    if shown.dtype == np.uint16:
        shown = np.rint(shown.astype(np.float32) / 257).astype(np.uint8)
    strips = list(pack_mosaic(lambda z0, z1: shown[z0:z1], layout))
    return Montage(np.concatenate(strips).astype(np.uint8, copy=False), level, len(shown), every, layout.tiles_x)


def _of_level(package: Package, level: int, role: Literal["volume", "normals"]) -> NDArray[np.generic]:
    texels = level_texels(package, level, role=role)
    texture = package.manifest.textures_of(role)[0]
    if texture.reference_mm is not None:
        return _over_black(texels)
    return texels if texture.normals is None else _colours(texels, texture.normals.code)


def _of_slices(package: Package, textures: list[Texture]) -> UInt8Array:
    """Return the stack of the first transfer function across z, or another axis where z has none."""
    first = textures[0].transfer
    axes = {texture.slices.axis for texture in textures if texture.slices is not None and texture.transfer == first}
    return _over_black(slice_texels(package, first or "", max(axes)))


def _over_black(rgba: NDArray[np.generic]) -> UInt8Array:
    """Classified voxels [z, y, x, RGBA] as sRGB."""
    return np.stack([encoded(np.asarray(value, np.float64) / 255, "black") for value in rgba])


def _shape(voxels: NDArray[np.generic]) -> tuple[int, int, int]:
    z, y, x = voxels.shape[:3]
    return z, y, x


def _colours(texels: NDArray[np.generic], code: NormalCode) -> UInt8Array:
    """Red, green and blue for x, y and z; middle grey if there is no normal."""
    vectors = decoded(np.ascontiguousarray(texels).view(np.uint8), code)
    return np.rint((vectors + 1) * 127.5).astype(np.uint8)
