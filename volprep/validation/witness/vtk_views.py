"""The standard views of a scan, drawn by VTK, each with two steps. The finer one is VTK's answer."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep.truth.camera import Camera
from volprep.truth.volume import Volume
from volprep.vtk.process import run_script
from volprep_formats.arrays import Float32Array
from volprep_formats.package.transfer_function import TransferFunction

Blend = Literal["composite", "maximum"]

MOST_VOXELS = 2**27
"""VTK holds the scan in float32, once in memory and once in a texture: 512 MiB each."""
_STEPS_VOXELS = (0.809, 0.4045)
"""Step as a part of the shortest edge of a voxel. Half the golden ratio, so that samples along an
axis are in step with no voxels: in step, two steps can miss the same maxima, and differ by less than both are wrong."""
_ENTRIES = (2048, 4096)
"""Samples of the transfer function: doubled with the steps, so that the pictures differ by the error of both."""
_SECONDS = 1800.0


@dataclass(frozen=True)
class VtkViews:
    """Pictures that VTK drew."""

    coarse: Float32Array
    """[view, H, W, 4], premultiplied linear: twice the step, half the samples of the transfer function."""
    fine: Float32Array
    """The same with `step_mm` and `entries`."""
    step_mm: float
    """Distance of the samples of `fine`."""
    entries: int
    """Samples of the transfer function of `fine`."""
    renderer: str
    """VTK and pyvista with their versions."""
    driver: str
    """GL_RENDERER and GL_VERSION."""


def draw_views(
    scan: Volume, function: TransferFunction, blend: Blend, cameras: Sequence[Camera], *, pixels: int, scratch: Path
) -> VtkViews:
    """Draw the scan from all cameras, `pixels` high and wide. `scratch` takes the scan, at most 2^27 voxels.

    Raises VP6040 if pyvista is not installed, VP6041 if VTK cannot draw.
    """
    grid, points = scan.grid, function.points
    paths = [scratch / f"witness-{name}" for name in ("scan.npy", "task.npz", "pictures.npz")]
    scan_path, task, result = paths
    steps_mm = [ratio * min(grid.spacing_mm_zyx) for ratio in _STEPS_VOXELS]
    try:
        np.save(scan_path, scan.stored)
        np.savez(
            task,
            scan=str(scan_path),
            slope=scan.slope,
            intercept=scan.intercept,
            spacing_mm_zyx=grid.spacing_mm_zyx,
            corner_mm_xyz=grid.corner_mm_xyz,
            direction=np.array(grid.direction),
            values=[point.value for point in points],
            colours=np.array([point.colour for point in points]),
            extinctions_per_mm=[point.extinction_per_mm for point in points],
            blend=blend,
            reference_mm=function.reference_mm,
            steps_mm=steps_mm,
            entries=_ENTRIES,
            eye_mm_xyz=[camera.eye_mm_xyz for camera in cameras],
            forward=[camera.forward for camera in cameras],
            up=[camera.up for camera in cameras],
            height_mm=[camera.height_mm for camera in cameras],
            focus_mm=[camera.focus_mm for camera in cameras],
            perspective=int(cameras[0].projection == "perspective"),
            picture_size=pixels,
        )
        run_script("volume_pictures", task, result, seconds=_SECONDS)
        with np.load(result) as drawn:
            pictures: NDArray[np.uint8] = drawn["pictures"]
            driver, renderer = drawn["driver"].tolist(), str(drawn["version"])
    finally:
        for path in paths:
            path.unlink(missing_ok=True)
    coarse, fine = pictures.astype(np.float32) / np.float32(255.0)
    return VtkViews(coarse, fine, steps_mm[-1], _ENTRIES[-1], renderer, f"{driver[1]}, OpenGL {driver[2]}")
