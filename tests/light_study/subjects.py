"""What is studied: real scans, thinned, each with a soft and with a hard transfer function.

`python -m tests.light_study.subjects DATA OUT.npz` writes the thinned scans to one file of 5 MB. The study takes it in
place of the folder, `--data OUT.npz`, on a machine without the scans.
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from volprep.library.scans import read_scan
from volprep.truth.path_traced import LitVolume
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint

SCANS = {
    "head": ("nifti_ch2/ch2.nii.gz", (2, 2, 2)),
    "head MR": ("mr_t1_studyforrest/dicoms", (4, 4, 4)),
    "CT": ("ct_phantom_tilt-18.5/S2010", (1, 6, 6)),
    "engine": ("engine_pair/png_stack", (2, 2, 2)),
    "shell": ("qim_microct/shell_225x128x128.tif", (2, 2, 2)),
    "fly": ("qim_microct/fly_150x256x256.tif", (2, 3, 3)),
}
"""Place of each scan in the data for tests, and which voxels are taken along z, y and x: every so many."""
_TILTED = {"CT"}
KINDS = ("soft", "hard")
_AIR, _MOST = 0.02, 0.995
"""Quantiles of values that count as the least and the most."""
_COLOUR = (0.9, 0.9, 0.9)


def read(data: Path, name: str) -> tuple[np.ndarray, Grid]:
    """Return the voxels [z, y, x] of a scan, and their grid."""
    if data.suffix == ".npz":
        with np.load(data) as packed:
            z_mm, y_mm, x_mm = packed[f"{name} mm"].tolist()
            return packed[name], Grid.of(packed[name].shape, (z_mm, y_mm, x_mm))
    path, every = SCANS[name]
    found = read_scan(data / path, repair=("tilt",)) if name in _TILTED else read_scan(data / path)
    z, y, x = every
    voxels = np.ascontiguousarray(found.stored[::z, ::y, ::x])
    spacing = tuple(n * h for n, h in zip(every, found.grid.spacing_mm_zyx, strict=True))
    return voxels, Grid.of(voxels.shape, spacing)


def subjects(data: Path, names: Sequence[str], kinds: Sequence[str] = KINDS) -> Iterator[tuple[str, str, LitVolume]]:
    """Return the name of each scan and of the kind of function, and the scan under a white sky with scattering."""
    for name in names:
        voxels, grid = read(data, name)
        for kind in kinds:
            lit = LitVolume(voxels, grid, 1.0, 0.0, function(voxels, grid, kind), LightModel(kind="scattering"))
            yield name, kind, lit


def function(voxels: np.ndarray, grid: Grid, kind: str) -> TransferFunction:
    """Return a function with an albedo of 0.9.

    Soft: up to 0.6 per voxel, over all values. Hard: 4 per voxel behind a step, so that half a voxel is opaque.
    """
    low, high = np.quantile(voxels, [_AIR, _MOST]).tolist()
    voxel_mm = min(grid.spacing_mm_zyx)
    starts, ends, most = (0.2, 1.0, 0.6) if kind == "soft" else (0.35, 0.37, 4.0)
    return TransferFunction(
        name=kind,
        points=tuple(
            TransferPoint(value=low + part * (high - low), colour=_COLOUR, extinction_per_mm=extinction)
            for part, extinction in ((starts, 0.0), (ends, most / voxel_mm))
        ),
    )


def pack(data: Path, out: Path) -> None:
    """Write all scans to one file."""
    parts = {}
    for name in SCANS:
        voxels, grid = read(data, name)
        parts |= {name: voxels, f"{name} mm": np.array(grid.spacing_mm_zyx)}
    np.savez_compressed(out, **parts)


if __name__ == "__main__":
    pack(Path(sys.argv[1]), Path(sys.argv[2]))
