"""The phantoms: a scene of default settings for each, with its scan."""

import itertools
from collections.abc import Callable
from pathlib import Path

import nibabel
import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array

from .shapes import Canvas

_N = 48
_SEED = 17
_AFFINE = np.diag([-1.0, -1.0, 1.0, 1.0])
"""Of a NIfTI file whose voxels are 1 mm wide and run along x, y and z of LPS."""

Points = tuple[tuple[float, str, float], ...]
"""Points of a transfer function: value, colour, extinction per millimetre."""
_WHITE: Points = ((0, "#c0c0c0", 2.0), (1000, "#ffffff", 2.5))
_TINTS = ("#8090a0", "#c0a080", "#ff2020", "#20ff20", "#2060ff", "#ffff20", "#ff20ff")


def segments_lit(folder: Path) -> Path:
    """Write a body with seven segments, five of them of 1 to 16 voxels, lit."""
    canvas, middle = Canvas((_N,) * 3), ((_N - 1) / 2,) * 3
    body = canvas.ball(middle, 19)
    labels = np.where(body > 0.5, 1, 0).astype(np.uint8)
    labels[canvas.ball(middle, 9) > 0.5] = 2
    labels[14, 15, 24], labels[30:32, 10, 25], labels[10, 22, 21] = 3, 4, 5
    labels[23, 7, 16:32], labels[33:35, 17:19, 16:18] = 6, 7
    return _with_segments(folder, 700 * body + _noise(body.shape, 10), labels, 'lighting = "headlight"')


def segments_small(folder: Path) -> Path:
    """Write a scan of 30 × 26 × 22 voxels with two segments."""
    canvas = Canvas((22, 26, 30))
    body = canvas.ball((15, 13, 11), 9)
    labels = np.where(body > 0.5, 1, 0).astype(np.uint8)
    labels[canvas.ball((18, 12, 10), 4) > 0.5] = 2
    return _with_segments(folder, 700 * body + _noise(body.shape, 10), labels)


def lesion(folder: Path) -> Path:
    """Write tissue with two lesions of 6 voxels that are 5 % brighter, and yellow by their function."""
    canvas = Canvas((_N,) * 3)
    tissue = canvas.block((5, 5, 5), (42, 42, 42))
    lesions = canvas.ball((25, 7, 22), 3) + canvas.ball((14, 22, 30), 3)
    values = 1000 * tissue + (50 * lesions + _noise(tissue.shape, 8)) * (tissue > 0)
    below: Points = ((300, "#804030", 0.0), (900, "#a06050", 0.15), (1000, "#b07060", 0.2))
    return _of_array(folder, values, (*below, (1050, "#fff080", 0.4), (1100, "#fff080", 0.4)))


def vessel(folder: Path, render: str = "") -> Path:
    """Write two red vessels of 1.5 voxels before an opaque grey wall."""
    canvas = Canvas((_N,) * 3)
    wall = canvas.block((4, 19, 4), (43, 39, 43))
    vessels = np.maximum(
        canvas.tube((7, 16.6, 9), (39, 16.1, 38), 0.75), canvas.tube((7, 16.2, 38), (30, 16.7, 15), 0.75)
    )
    values = np.maximum(500 * wall, 1000 * vessels) + _noise(wall.shape, 5)
    grey: Points = ((250, "#404850", 0.0), (400, "#404850", 1.5), (650, "#485058", 1.5))
    return _of_array(folder, values, (*grey, (700, "#ff2010", 2.0), (1000, "#ff3020", 3.0)), render)


def vessel_lit(folder: Path) -> Path:
    """Write the same, lit."""
    return vessel(folder, 'lighting = "headlight"')


def crack_lit(folder: Path) -> Path:
    """Write noisy bone that the box cuts, with a dark gap of one voxel, lit."""
    canvas = Canvas((_N,) * 3)
    bone = canvas.tube((23, 23, -4), (23, 23, 52), 11)
    gap = canvas.gap((23, 23, 24), (0.35, -0.2, 1.0)) * (np.arange(_N) < 25)[:, None]
    values = 1000 * bone * (1 - 0.95 * gap) + 60 + _noise(bone.shape, 12)
    points: Points = ((300, "#d8c8a8", 0.0), (600, "#e8d8b8", 1.5), (1000, "#fff4e0", 3.0))
    return _of_array(folder, values, points, 'lighting = "headlight"')


def stent_maximum(folder: Path) -> Path:
    """Write a stent of crossing wires, drawn by maximum."""
    canvas = Canvas((_N,) * 3)
    wires = np.zeros((_N,) * 3)
    for turn in np.linspace(0.0, 2 * np.pi, 6, endpoint=False):
        for twist in (-1.0, 1.0):
            angles = turn + twist * np.linspace(0.0, 2.0, 9)
            places = np.column_stack([24 + 13 * np.cos(angles), 24 + 13 * np.sin(angles), np.linspace(4, 43, 9)])
            for start, end in itertools.pairwise(places):
                wires = np.maximum(wires, canvas.tube(start, end, 0.6))
    values = 2800 * wires + 200 * canvas.tube((24, 24, 2), (24, 24, 45), 11) + _noise(wires.shape, 20)
    points: Points = ((150, "#000000", 0.0), (400, "#804020", 0.3), (3000, "#ffffff", 2.0))
    return _of_array(folder, values, points, 'compositing = "maximum"')


def label_map(folder: Path) -> Path:
    """Write a map of three labels without a scan."""
    canvas = Canvas((_N,) * 3)
    labels = np.zeros((_N,) * 3, np.uint8)
    for label, shape in enumerate((canvas.ball((18, 24, 24), 11), canvas.ball((33, 25, 22), 8)), 1):
        labels[shape > 0.5] = label
    labels[canvas.tube((8, 10, 8), (40, 38, 40), 2.0) > 0.5] = 3
    return _nifti(folder / "labels.nii", labels)


def rgba_nifti(folder: Path) -> Path:
    """Write a NIfTI file in colour with opacity."""
    canvas = Canvas((20, 24, 28))
    texels = np.zeros((28, 24, 20), dtype=[(name, np.uint8) for name in "RGBA"])
    for name, centre in zip("RGB", ((10, 12, 10), (16, 14, 9), (14, 8, 12)), strict=True):
        texels[name] = np.rint(255 * canvas.ball(centre, 6)).T
    texels["A"] = np.rint(200 * canvas.ball((14, 12, 10), 9)).T
    path = folder / "colour.nii"
    nibabel.save(nibabel.Nifti1Image(texels, _AFFINE), path)
    return path


PHANTOMS: dict[str, Callable[[Path], Path]] = {
    "segments-lit": segments_lit,
    "segments-small": segments_small,
    "lesion": lesion,
    "vessel": vessel,
    "vessel-lit": vessel_lit,
    "crack-lit": crack_lit,
    "stent-maximum": stent_maximum,
    "label-map": label_map,
    "rgba-nifti": rgba_nifti,
}
"""Each writes its files into a folder, and returns what is built."""


def _noise(shape: tuple[int, ...], deviation: float) -> Float64Array:
    return deviation * np.random.default_rng(_SEED).standard_normal(shape)


def _with_segments(folder: Path, values: Float64Array, labels: NDArray[np.uint8], render: str = "") -> Path:
    _nifti(folder / "scan.nii", np.rint(values).astype(np.int16))
    _nifti(folder / "labels.nii", labels)
    styles = "".join(
        f'[[segments.style]]\nlabels = [{label}]\ntint = "{_TINTS[label - 1]}"\nopacity = {opacity}\n'
        for label, opacity in zip(range(1, int(labels.max()) + 1), (0.02, 0.5, *[1.0] * 5), strict=False)
    )
    more = f'[segments]\nsource = "labels.nii"\noutside_opacity = 0.0\n{styles}'
    return _scene(folder, 'path = "scan.nii"', _WHITE, render, more)


def _of_array(folder: Path, values: Float64Array, points: Points, render: str = "") -> Path:
    np.save(folder / "scan.npy", np.clip(np.rint(values), 0, 4000).astype(np.uint16))
    return _scene(folder, 'path = "scan.npy"\narray = { spacing_mm_zyx = [1.0, 1.0, 1.0] }', points, render)


def _scene(folder: Path, source: str, points: Points, render: str, more: str = "") -> Path:
    table = ", ".join(
        f'{{ value = {value:.1f}, colour = "{colour}", extinction_per_mm = {extinction:.3f} }}'
        for value, colour, extinction in points
    )
    path = folder / "scene.toml"
    path.write_text(
        f'name = "phantom"\n[source]\n{source}\n[[transfer]]\nname = "t"\npoints = [{table}]\n'
        f"[pyramid]\ncoarsest_longest_axis = 12\n[render]\npicture_size = 192\n{render}\n{more}\n",
        encoding="utf-8",
    )
    return path


def _nifti(path: Path, voxels_zyx: NDArray[np.generic]) -> Path:
    nibabel.save(nibabel.Nifti1Image(voxels_zyx.T, _AFFINE), path)
    return path
