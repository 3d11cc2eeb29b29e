"""How near pictures of a package are to the scan, level by level and transfer function by transfer function.

Views come from all sides: directions of a spiral that is as even on the sphere as any (Fibonacci's), none of them along
an axis, so that the mean over them is near that over all directions. Truth is drawn once for each view and transfer
function, and averaged down to the pictures of each level.

The record must hold for views that made no part of it. Errors of pictures differ from view to view, so

- the root mean square is over all pixels of all views. The error of a view varies by some 30 %; over 16 views the mean
  varies by less than 8 %, over 20 others too: 20 % are more than two and a half standard deviations of the difference;
- the largest error of a view is the largest of many, whose distribution is Gumbel's. That one of 20 views exceeds a
  value with a probability of a thousandth takes 7.3 standard deviations above the mean; the standard deviation itself
  is known to a quarter from 16 views. The record therefore states nine; and at least twice the mean, in case the views
  happen to have equal errors. No error of a premultiplied channel is larger than 1.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep.render.renderers import renderer_of
from volprep.truth.averaged import averaged
from volprep.truth.camera import Camera, view_from
from volprep.truth.metrics import flip_error
from volprep.truth.volume import Medium, Volume
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.channel import Level
from volprep_formats.package.manifest import Projection
from volprep_formats.package.parts.fidelity.record import LevelFidelity
from volprep_formats.package.reader import Package

VIEWS = 16
_RAYS = 256
"""Width and height of the pictures that are drawn, before they are averaged."""
_MOST_PIXELS = 128
_DEVIATIONS = 9.0
_LEAST_OF_MEAN = 2.0
_STEP_OF_TARGET = 1 / 255


@dataclass(frozen=True)
class ViewError:
    """Error of one view."""

    rmse: float
    """Root mean square over all pixels and channels."""
    maximum: float
    """Largest difference of a channel of a pixel."""
    flip: float
    """Mean of FLIP over the foreground."""


@dataclass(frozen=True)
class MeasuredFidelity:
    """Errors of one level with one transfer function."""

    transfer: str
    """Name of the transfer function."""
    level: int
    """Level."""
    pixels: int
    """Width and height of the pictures."""
    pixels_per_voxel: float
    """Pixels along the shortest edge of a voxel."""
    views: tuple[ViewError, ...]
    """Error of each view."""

    @property
    def rmse(self) -> float:
        """Root mean square over all pixels of all views."""
        return math.sqrt(sum(view.rmse**2 for view in self.views) / len(self.views))

    @property
    def maximum(self) -> float:
        """Largest difference in any view."""
        return max(view.maximum for view in self.views)


def measure(package: Package, scan: Volume, cameras: Sequence[Camera]) -> Iterator[MeasuredFidelity]:
    """Measure all levels of a package of one channel with all of its transfer functions.

    Raises the errors of `renderer_of` and the oracle.
    """
    manifest = package.manifest
    for function in manifest.transfer_functions:
        levels = _levels(package, function.name)
        compositing = COMPOSITINGS[next((program.compositing for program in manifest.programs), "emission-absorption")]
        truths: list[Float32Array] = []
        for camera in cameras:
            matrix = camera.box_from_clip(scan.grid, aspect=1.0)
            drawn = compositing.oracle([Medium(scan, function)], matrix, (_RAYS, _RAYS))
            truths.append(drawn.rgba.astype(np.float32))
        for level in levels:
            pixels, per_voxel = _pixels(level, cameras[0].height_mm)
            with renderer_of(package, level=level.index, transfer=function.name) as renderer:
                grid = manifest.levels[0].grid
                pictures = [
                    renderer.render(camera.box_from_clip(grid, aspect=1.0), (_RAYS, _RAYS)) for camera in cameras
                ]
            errors = tuple(
                _error(averaged(picture, pixels), averaged(truth, pixels))
                for picture, truth in zip(pictures, truths, strict=True)
            )
            yield MeasuredFidelity(function.name, level.index, pixels, per_voxel, errors)


def errors_of_views(package: Package, scan: Volume) -> Iterator[LevelFidelity]:
    """Yield the statement of each level with each transfer function of a package of one channel."""
    manifest = package.manifest
    projection = manifest.render.projection if manifest.render else "orthographic"
    cameras = cameras_from(manifest.levels[0].grid, spiral(VIEWS), projection)
    return map(stated, measure(package, scan, cameras))


def stated(found: MeasuredFidelity) -> LevelFidelity:
    """Return the record of the measurements, in three digits: two drivers may differ in the fourth."""
    largest = np.array([view.maximum for view in found.views])
    mean = float(largest.mean())
    bound = max(mean + _DEVIATIONS * float(largest.std(ddof=1)), _LEAST_OF_MEAN * mean) + _STEP_OF_TARGET
    return LevelFidelity(
        transfer=found.transfer,
        level=found.level,
        pixels=found.pixels,
        pixels_per_voxel=_digits(found.pixels_per_voxel),
        views=len(found.views),
        rmse=_digits(found.rmse),
        maximum=min(1.0, _digits(bound)),
        flip=_digits(sum(view.flip for view in found.views) / len(found.views)),
    )


def spiral(count: int) -> Float64Array:
    """Return directions [n, 3], as even on the sphere as a spiral makes them (Fibonacci's)."""
    number = np.arange(count) + 0.5
    z = 1 - 2 * number / count
    turn = math.pi * (1 + math.sqrt(5)) * number
    radius = np.sqrt(1 - z**2)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), z])


def by_chance(count: int, chance: np.random.Generator) -> Float64Array:
    """Return directions [n, 3], all equally probable."""
    found = chance.normal(size=(count, 3))
    directions: Float64Array = found / np.linalg.norm(found, axis=1, keepdims=True)
    return directions


def cameras_from(grid: Grid, directions: Float64Array, projection: Projection) -> list[Camera]:
    """Look from each direction at the middle of the volume, with the field of the standard views."""
    extent_xyz = np.array(grid.extent_mm_zyx[::-1])
    centre = grid.corner_mm_xyz + np.array(grid.direction) @ (extent_xyz / 2)
    distance = 2 * float(np.linalg.norm(extent_xyz))
    eyes = (centre + distance * directions).tolist()
    return [view_from(grid, (x, y, z), projection) for x, y, z in eyes]


def _levels(package: Package, transfer: str) -> list[Level]:
    picture = package.manifest.picture(transfer)
    return [package.manifest.level(drawing.level) for drawing in picture.drawings] if picture else []


def _pixels(level: Level, height_mm: float) -> tuple[int, float]:
    """Return a pixel for a voxel, or fewer where that are many, and how many it then is for a voxel."""
    shortest = min(level.grid.spacing_mm_zyx)
    pixels = max(1, min(_MOST_PIXELS, round(height_mm / shortest)))
    return pixels, pixels * shortest / height_mm


def _error(picture: Float32Array, truth: Float32Array) -> ViewError:
    difference = picture.astype(np.float64) - truth
    flip = flip_error(picture, truth)
    return ViewError(
        float(np.sqrt(np.mean(difference**2))), float(np.abs(difference).max()), max(flip.black, flip.white)
    )


def _digits(number: float) -> float:
    return float(f"{number:.3g}")
