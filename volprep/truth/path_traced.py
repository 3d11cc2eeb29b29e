"""Pictures under light from around a volume by path tracing in float64 (native/src/path_tracer.cpp).

The estimate of each pixel is unbiased for the exact trilinear field and the exact piecewise linear transfer function,
and comes with its variance. Two pictures differ only by what exceeds the noise that the variances state.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.truth.oracle import native_function
from volprep.truth.volume import require_field
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.environment import environment_of
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.transfer_function import TransferFunction

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Weights of linear RGB with the primaries of sRGB (Rec. ITU-R BT.709)."""


@dataclass(frozen=True)
class TracedPicture:
    """A picture and its noise."""

    rgba: Float64Array
    """[height, width, 4], row 0 on top: premultiplied linear RGB and opacity, means of independent samples."""
    variance: Float64Array
    """[height, width, 4]: variances of these means."""
    missed: float
    """Largest part of a pixel that is missing because paths were given up; 0 if none was."""


class NativeLight(TypedDict):
    """Arguments that the native kernels of light share, by their names."""

    volume: NDArray[np.generic]
    slope: float
    intercept: float
    spacing_mm_xyz: Sequence[float]
    extent_mm_xyz: Sequence[float]
    values: Float64Array
    colours: Float64Array
    extinctions_per_mm: Float64Array
    albedos: Float64Array
    sky: Float64Array
    suns: Float64Array
    lamp_mm_xyz: Sequence[float] | None
    ambient: float
    reach_mm: float
    scatters: bool
    planes: Float64Array | None


@dataclass(frozen=True)
class LitVolume:
    """A volume, its transfer function, and the light around it."""

    volume: NDArray[np.generic]
    """Stored values [z, y, x], C order: uint8, int16, uint16 or float32. physical = slope · stored + intercept."""
    grid: Grid
    """Positions of the voxels; its shape is the volume's."""
    slope: float
    """physical = slope · stored + intercept."""
    intercept: float
    """physical = slope · stored + intercept."""
    transfer_function: TransferFunction
    """Extinction and colour over physical values. At a jump the value itself belongs to the side above."""
    model: LightModel
    """The light, and how it travels."""
    environment: Float64Array | None = None
    """[4, RGB]: light from around in place of the model's: from the direction w of the patient's space comes the first
    row plus the others times w."""
    planes: Float64Array | None = None
    """[n, 4]: planes in box space that cut the volume; it ends where a·x + b·y + c·z + d falls below 0, in
    millimetres. None for the whole volume."""

    def native(self) -> NativeLight:
        """Return the arguments that the native kernels of light share. Raises the errors of `require_field`."""
        require_field(self.volume, self.grid)
        model = self.model
        values, colours, extinctions_per_mm = native_function(self.transfer_function)
        sky, suns = _surroundings(model, self.environment, self.grid)
        place = None if model.light_mm is None or model.kind != "shadow" else _place(self.grid, model.light_mm)
        return NativeLight(
            volume=self.volume,
            slope=self.slope,
            intercept=self.intercept,
            spacing_mm_xyz=self.grid.spacing_mm_zyx[::-1],
            extent_mm_xyz=self.grid.extent_mm_zyx[::-1],
            values=values,
            colours=colours,
            extinctions_per_mm=extinctions_per_mm,
            albedos=_in_channels(colours, model),
            sky=sky,
            suns=suns,
            lamp_mm_xyz=place,
            ambient=model.ambient,
            reach_mm=model.radius_mm or math.inf,
            scatters=model.kind == "scattering",
            planes=self.planes,
        )


def traced_picture(
    lit: LitVolume, box_from_clip: Float64Array, shape_hw: tuple[int, int], paths: int, seed: int = 1
) -> TracedPicture:
    """Draw a volume with `paths` samples of each pixel. The same seed gives the same picture on any machine.

    Raises
    ------
    VolprepError
        VP6001 if a voxel is not finite: the field around it is not defined.
    ValueError
        If the volume does not have the grid's shape.
    """
    rgba, variance = np.empty((*shape_hw, 4)), np.empty((*shape_hw, 4))
    matrix = np.ascontiguousarray(box_from_clip, dtype=np.float64)
    missed = _native.trace_picture(
        **lit.native(), box_from_clip=matrix, paths=paths, seed=seed, rgba=rgba, variance=variance
    )
    return TracedPicture(rgba, variance, missed)


def squares_beyond_noise(picture: Float64Array, truth: TracedPicture) -> Float64Array:
    """Return the squared error of each pixel [n] that the truth shows, mean over RGB, without the truth's variance.

    Only means of many are meaningful: single ones may be negative.
    """
    seen = truth.rgba[..., 3] > 0.0
    squares = ((picture - truth.rgba)[seen, :3] ** 2).mean(axis=1)
    beyond: Float64Array = squares - truth.variance[seen, :3].mean(axis=1)
    return beyond


def _surroundings(model: LightModel, environment: Float64Array | None, grid: Grid) -> tuple[Float64Array, Float64Array]:
    """Return the native arrays of sky and suns, with directions along the axes of the box."""
    box_from_patient = np.array(grid.direction).T
    # Light that an app turns has no suns: they are spread over half of the sky.
    is_smooth = model.turnable or environment is not None
    if environment is None:
        spread = environment_of(model if model.turnable else model.model_copy(update={"suns": ()}))
        environment = spread if model.turnable else _in_channels(spread, model)
    sky = np.concatenate([environment[:1], box_from_patient @ environment[1:]]).T
    rows: Sequence[Float64Array] = [
        np.concatenate(
            [
                box_from_patient @ _unit(np.array(sun.direction)),
                _in_channels(np.array([sun.colour]), model)[0],
                [math.cos(math.radians(sun.size_degrees / 2))],
            ]
        )
        for sun in (() if is_smooth else model.suns)
    ]
    return np.ascontiguousarray(sky), np.array(rows).reshape(-1, 7)


def _in_channels(colours: Float64Array, model: LightModel) -> Float64Array:
    """Return colours [n, 3], as their luminance where light has no colour on its way."""
    if model.channels == "rgb" and not model.turnable:
        return colours
    grey: Float64Array = np.repeat((colours @ LUMINANCE)[:, None], 3, axis=1)
    return grey


def _place(grid: Grid, place_mm_xyz: tuple[float, float, float]) -> list[float]:
    box: list[float] = (np.linalg.inv(grid.world_from_box) @ [*place_mm_xyz, 1.0])[:3].tolist()
    return box


def _unit(vector: Float64Array) -> Float64Array:
    unit: Float64Array = vector / np.linalg.norm(vector)
    return unit
