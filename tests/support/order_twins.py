"""Slow twins of what the oracle does not draw."""

import numpy as np

from volprep.truth.stacks import pixel_rays
from volprep_formats.grid import Grid
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.reader import Package

SEGMENTS = 1500


def classified_voxels(package: Package) -> tuple[np.ndarray, Grid, float]:
    """Voxels [z, y, x, RGBA] of a package that holds colours, their grid, and the length of their opacity."""
    reference_mm = next(each.reference_mm for each in package.manifest.textures if each.reference_mm is not None)
    return level_texels(package, 0) / 255.0, package.manifest.levels[0].grid, reference_mm


def preclassified_picture(
    voxels: np.ndarray, grid: Grid, reference_mm: float, box_from_clip: np.ndarray, pixels: int
) -> np.ndarray:
    """Integrate colours that are interpolated between voxels: so many midpoints that they are the integral."""
    near, along = pixel_rays(box_from_clip, (pixels, pixels))
    extent = np.array(grid.extent_mm_zyx[::-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([-near / along, (extent - near) / along])
    enter, leave = np.nanmax(ends.min(axis=0), axis=1), np.nanmin(ends.max(axis=0), axis=1)
    met = np.flatnonzero(leave > np.maximum(enter, 0.0))
    near, along, enter, length = near[met], along[met], enter[met], (leave - enter)[met]
    light, depth = np.zeros((len(met), 3)), np.zeros(len(met))
    for number in range(SEGMENTS):
        at = near + along * (enter + length * (number + 0.5) / SEGMENTS)[:, None]
        texel = _trilinear(voxels, at / grid.spacing_mm_zyx[::-1])
        opacity = np.minimum(texel[:, 3], 1.0 - 1.0 / 512.0)
        colour = texel[:, :3] / np.maximum(texel[:, 3:], 1.0 / 512.0)
        deeper = depth - np.log1p(-opacity) / reference_mm * length / SEGMENTS
        light += colour * (np.exp(-depth) - np.exp(-deeper))[:, None]
        depth = deeper
    picture = np.zeros((pixels * pixels, 4))
    picture[met] = np.column_stack([light, -np.expm1(-depth)])
    return picture.reshape(pixels, pixels, 4)


def _trilinear(voxels: np.ndarray, at_xyz: np.ndarray) -> np.ndarray:
    last = np.array(voxels.shape[:3]) - 1
    at = np.clip(at_xyz[:, ::-1] - 0.5, 0.0, last)
    lower = np.minimum(at.astype(int), np.maximum(last - 1, 0))
    share = (at - lower)[:, :, None]
    found = np.zeros((len(at), voxels.shape[3]))
    for corner in np.ndindex(2, 2, 2):
        z, y, x = np.minimum(lower + corner, last).T
        found += np.prod(np.where(np.array(corner)[:, None] == 1, share, 1 - share), axis=1) * voxels[z, y, x]
    return found
