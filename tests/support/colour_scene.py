"""A small volume in colour: a ball of many colours in a stack of RGBA pictures."""

from pathlib import Path

import numpy as np
import tifffile
from numpy.typing import NDArray

SHAPE_ZYX = (9, 14, 17)
LARGEST_PER_MM = 0.5
SCENE = """
name = "ball"
profile = "{profile}"
{top}
[source]
path = "slices.tif"
stack = {{ spacing_mm_zyx = [1.5, 1.0, 0.75] }}

[pyramid]
coarsest_longest_axis = 9

[colour]
extinction = "{extinction}"
points = [{{ value = 0.0, extinction_per_mm = 0.0 }}, {{ value = 1.0, extinction_per_mm = 0.5 }}]
"""


def ball() -> NDArray[np.uint8]:
    """Pixels [z, y, x, RGBA] of sRGB and straight alpha: a soft ball, in stripes of dark and bright colours."""
    z, y, x = np.meshgrid(*((np.arange(n) + 0.5) / n * 2 - 1 for n in SHAPE_ZYX), indexing="ij")
    alpha = np.clip((0.95 - np.sqrt(x * x + y * y + z * z)) * 2.5, 0.0, 1.0)
    colours = np.stack([0.5 + 0.5 * x, 0.5 - 0.5 * y, 0.5 + 0.5 * z], axis=-1)
    colours *= np.where(np.floor(3 * x + 2 * y) % 2, 1.0, 0.35)[..., None]
    return np.rint(np.concatenate([colours, alpha[..., None]], axis=-1) * 255).astype(np.uint8)


def waves() -> NDArray[np.uint8]:
    """Pixels [z, y, x, RGBA] that change slowly everywhere, without an outline."""
    z, y, x = np.meshgrid(*((np.arange(n) + 0.5) / n * 3 for n in SHAPE_ZYX), indexing="ij")
    planes = (np.sin(x + 0.4 * y), np.cos(y - 0.5 * z), np.sin(z + 0.3 * x + 1.0), np.cos(0.8 * x + 0.5 * y - 0.9 * z))
    return np.rint((0.55 + 0.4 * np.stack(planes, axis=-1)) * 255).astype(np.uint8)


def write_pictures(path: Path, pixels: NDArray[np.generic], alpha: str = "unassalpha") -> None:
    """Write pages [z, y, x, channel] of RGB or RGBA."""
    extra = [alpha] if pixels.shape[-1] == 4 else None
    tifffile.imwrite(path, pixels, photometric="rgb", extrasamples=extra)


def write_colour_scene(
    folder: Path, profile: str = "gles3", extinction: str = "alpha", top: str = "", tables: str = ""
) -> Path:
    """Write the scene and its pictures; give the path of the scene."""
    write_pictures(folder / "slices.tif", ball())
    scene = folder / "ball.toml"
    scene.write_text(SCENE.format(profile=profile, extinction=extinction, top=top) + tables)
    return scene


def write_colour_blocks(folder: Path) -> Path:
    """Write the scene with compressed blocks, and a tolerance that they are within."""
    tables = (
        '[textures]\ncompression = "astc-4x4"\n[tolerance]\nrmse = 1.0\nmaximum = 1.0\nflip = 1.0\n'
        "[render]\npicture_size = 16\n"
    )
    return write_colour_scene(folder, "gles3-astc", tables=tables)
