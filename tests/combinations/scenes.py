"""Tiny scenes: a scan of 14 × 16 × 18 voxels, or another medium, with the features of a row, and defaults elsewhere."""

import json
from collections import defaultdict
from pathlib import Path

import nibabel
import numpy as np
import tifffile

from volprep_formats.arrays import Float64Array

from .factors import DEFAULTS, Row

_SHAPE_ZYX = (14, 16, 18)
_AFFINE = np.diag([-0.9, -1.0, 1.2, 1.0])
"""Of a NIfTI file whose voxels are 1.2, 1.0 and 0.9 mm apart along z, y and x of LPS."""
_TURNED = np.array([[-0.8, -0.3, 0.0, -2.0], [0.3, -0.8, 0.0, -3.0], [0.0, 0.0, 1.3, 1.0], [0.0, 0.0, 0.0, 1.0]])
"""Of a second grid, turned by about 20 degrees and moved."""
_PICTURE_SIZE = 48
_PLANE = "[{ normal = [0.0, 1.0, 0.2], constant_mm = -8.0 }]"
_SOURCES = {
    "labels": 'path = "labels.nii"\nlabels = true',
    "colour": 'path = "slices.tif"\nstack = { spacing_mm_zyx = [1.2, 1.0, 0.9] }',
    "channels": 'channels = [{ name = "first", path = "scan.nii" }, { name = "second", path = "other.nii" }]',
    "grids": 'channels = [{ name = "first", path = "scan.nii" }, { name = "second", path = "turned.nii" }]',
    "frames": 'path = "frames.nii"\nframes = "all"',
}
_FUNCTION = """[[transfer]]
name = "{name}"
{more}
points = [
    {{ value = {low}, colour = "#a04020", extinction_per_mm = 0.0 }},
    {{ value = {high}, colour = "#{bright}", extinction_per_mm = 0.5 }},
]
"""
_SEGMENTS = """[segments]
source = "labels.nii"
border = "{border}"
outside_opacity = 0.1
style = [{{ labels = [1], tint = "#20c0ff", opacity = 0.3 }}, {{ labels = [2], tint = "#ff8040" }}]
"""
_COLOUR = "[colour]\npoints = [{ value = 0.0, extinction_per_mm = 0.0 }, { value = 1.0, extinction_per_mm = 0.5 }]\n"
_TABLES: dict[tuple[str, str], tuple[str, str]] = {
    ("layout", "bricks"): ("bricks", "size = 8\n[lab.bricks]\nreach = 2"),
    ("layout", "compressed"): ("textures", 'compression = "auto"'),
    ("layout", "mipmaps"): ("textures", "mipmaps = true"),
    ("layout", "on-demand"): ("on_demand", "size = 8"),
    ("levels", "several"): ("pyramid", "coarsest_longest_axis = 9"),
    ("levels", "box"): ("pyramid", 'coarsest_longest_axis = 9\nfilter = "box"'),
    ("levels", "maximum"): ("pyramid", 'coarsest_longest_axis = 9\nfilter = "maximum"'),
    ("pieces", "files"): ("grid", 'size = 14\nlayout = "files"'),
    ("pieces", "single"): ("grid", 'size = 14\nlayout = "single"'),
    ("mesh", "merged"): ("proxy", 'form = "merged"'),
    ("mesh", "convex"): ("proxy", 'form = "convex"'),
    ("clip", "plane"): ("lighting", f"clip_planes = {_PLANE}"),
    ("clip", "aware"): ("lighting", f"clip_planes = {_PLANE}\nclip_aware = true"),
    ("bits", "8"): ("quantize", "bits = 8"),
    ("bits", "16"): ("quantize", "bits = 16"),
}
"""Table and keys of a value that is no plain key."""
_KEYS = {"compositing": "render", "lighting": "render", "classification": "render", "baked": "lighting"}
"""Table of each factor that is a key."""


def write_scene(folder: Path, row: Row) -> Path:
    """Write the scene of a row and its files into a folder, and return its path."""
    _write_files(folder)
    tables: defaultdict[str, list[str]] = defaultdict(list)
    tables["render"].append(f"picture_size = {_PICTURE_SIZE}")
    if row["baked"] == "shadow" or row["lighting"] in {"phong", "blinn-phong"}:
        tables["lighting"].append("light_mm = [-30.0, -20.0, 40.0]")
    if row["layout"] in {"bricks", "mipmaps", "on-demand"}:
        tables["lighting"].append('normals = "central"')
    for factor, value in row.items():
        if factor in _KEYS and value != DEFAULTS[factor]:
            tables[_KEYS[factor]].append(f"{factor} = {json.dumps(value)}")
        if (factor, value) in _TABLES:
            table, keys = _TABLES[factor, value]
            tables[table].append(keys)
    medium = row["medium"]
    source = _SOURCES.get(medium, 'path = "scan.nii"')
    head = f'name = "scene"\nprofile = "{row["profile"]}"\n[source]\n{source}\n'
    path = folder / "scene.toml"
    written = ["\n".join((f"[{table}]", *keys)) for table, keys in tables.items()]
    path.write_text("\n".join([head + _shown(medium), *written]), encoding="utf-8")
    return path


def _shown(medium: str) -> str:
    """Return the transfer functions of a medium, and the tables that belong to it."""
    if medium == "colour":
        return _COLOUR
    if medium == "labels":
        return _function("tissue", "isovalue = 0.5", (0.5, 2.0))
    functions = _function("tissue", "isovalue = 400.0", (100.0, 900.0))
    if medium in {"channels", "grids"}:
        second = _function("liquid", 'channel = "second"\nisovalue = 300.0', (150.0, 800.0), "40c0ff")
        return f"{functions}{second}[together]\n"
    return functions + (_SEGMENTS.format(border=medium) if medium in {"mixed", "crisp"} else "")


def _function(name: str, more: str, ends: tuple[float, float], bright: str = "fff0c0") -> str:
    return _FUNCTION.format(name=name, more=more, low=ends[0], high=ends[1], bright=bright)


def _write_files(folder: Path) -> None:
    values = _hill((0.5, 0.45, 0.6), 0.3) + 0.6 * _hill((0.6, 0.7, 0.3), 0.15)
    noise = 0.01 * np.random.default_rng(3).standard_normal(_SHAPE_ZYX)
    _nifti(folder / "scan.nii", np.rint(1000 * (values + noise)).astype(np.int16))
    _nifti(folder / "other.nii", np.rint(1000 * _hill((0.4, 0.6, 0.35), 0.25)).astype(np.int16))
    liquid = _hill((0.5, 0.55, 0.45), 0.25)[2:, 3:, 2:-3]
    _nifti(folder / "turned.nii", np.rint(1000 * liquid).astype(np.int16), _TURNED)
    moved = _hill((0.45, 0.5, 0.55), 0.3)
    _nifti(folder / "frames.nii", np.rint(1000 * np.stack([values, moved])).astype(np.int16))
    _nifti(folder / "labels.nii", np.digitize(values, (0.3, 0.7)).astype(np.uint8))
    shares = np.stack(
        [*(_hill(at, 0.4) for at in ((0.4, 0.4, 0.4), (0.6, 0.5, 0.4), (0.5, 0.6, 0.7))), values], axis=-1
    )
    pixels = np.rint(255 * np.clip(shares, 0.0, 1.0)).astype(np.uint8)
    tifffile.imwrite(folder / "slices.tif", pixels, photometric="rgb", extrasamples=["unassalpha"])


def _hill(centre_zyx: tuple[float, float, float], width: float) -> Float64Array:
    """Return a smooth hill of height 1 whose centre and width are parts of the volume."""
    places = np.meshgrid(*(np.arange(n) / (n - 1) for n in _SHAPE_ZYX), indexing="ij")
    hill: Float64Array = np.exp(-sum((at - c) ** 2 for at, c in zip(places, centre_zyx, strict=True)) / width**2)
    return hill


def _nifti(path: Path, voxels_zyx: np.ndarray, affine: Float64Array = _AFFINE) -> None:
    nibabel.save(nibabel.Nifti1Image(voxels_zyx.T, affine), path)
