"""Time series for tests: a still ball beside one that moves, and their scene."""

from pathlib import Path

import nibabel
import numpy as np

SHAPE_ZYX = (20, 22, 24)
STILL_X = 10
"""Columns up to here hold the same values in all frames."""


def moving(frames: int) -> np.ndarray:
    """Return frames [frame, z, y, x] in which nothing moves in the first columns."""
    z, y, x = np.meshgrid(*map(np.arange, SHAPE_ZYX), indexing="ij")
    made = []
    for phase in 2 * np.pi * np.arange(frames) / frames:
        still = np.exp(-((z - 10) ** 2 + (y - 11) ** 2 + (x - 5) ** 2) / 12.0)
        beating = np.exp(
            -((z - 10) ** 2 + (y - 11 - 3 * np.sin(phase)) ** 2 + (x - 17) ** 2) / (10 + 4 * np.cos(phase))
        )
        made.append(200.0 * still + np.where(x > STILL_X, 180.0 * beating, 0.0))
    return np.rint(made).astype(np.uint8)


def save_series(path: Path, frames: np.ndarray, unit: str = "msec", step: float = 40.0) -> Path:
    """Write frames [frame, z, y, x] as one NIfTI file, or a volume [z, y, x]."""
    picture = nibabel.Nifti1Image(frames.T, np.diag([1.0, 1.0, 1.5, 1.0]))
    picture.header.set_xyzt_units("mm", unit)
    if frames.ndim == 4:
        picture.header["pixdim"][4] = step
    nibabel.save(picture, path)
    return path


def write_series(
    folder: Path, frames: np.ndarray, *, chosen: str = 'frames = "all"', more: str = "", profile: str = "gles3"
) -> Path:
    """Write a series, or a volume with `chosen` empty, and its scene."""
    save_series(folder / "series.nii", frames)
    scene = folder / "series.toml"
    scene.write_text(f"""name = "series"
profile = "{profile}"
{more}
[source]
path = "series.nii"
{chosen}
[pyramid]
coarsest_longest_axis = 8
filter = "box"
[[transfer]]
name = "tracer"
points = [
    {{ value = 30.0, colour = "#4060ff", extinction_per_mm = 0.0 }},
    {{ value = 200.0, colour = "#ffffff", extinction_per_mm = 0.4 }},
]
""")
    return scene
