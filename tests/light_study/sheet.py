"""`python -m tests.light_study.sheet OUT.png` shows scans under lights of run time, baked light and path tracing.

A row for each scan: unlit, headlight, Phong with shadows, baked occlusion, baked scattering, the path-traced truth, and
how far baked scattering is from it. Each way is a package that is built as a user builds it, and drawn on the driver at
hand. `--thin 2` takes every second voxel of the scans of `python -m tests.light_study`, an eighth of the time.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

from tests.benchmarks.bench_light import draw, make, truths
from tests.light_study.subjects import KINDS, SCANS, function, read
from volprep.truth.path_traced import squares_beyond_noise
from volprep.truth.picture import encoded
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.transfer_function import TransferFunction

WAYS = ("unlit", "headlight", "Phong, shadow rays", "baked occlusion, 1/2", "baked scattering, 1/2")
VIEW = "anterior-left"
_STEP, _SHADOW_STEP = 0.125, 0.5
"""Steps in voxels. The first is short enough for what is opaque within half a voxel. With shadow rays, drivers end the
loops of so short a step."""
_TIMES = 4.0
"""Factor of the difference from the truth in its picture; grey is none."""
_INCHES = 1.6


def pictures(folder: Path, name: str, asked: argparse.Namespace) -> dict[str, Float64Array]:
    """Return the pictures of a scan by their titles."""
    voxels, grid = read(asked.data, name)
    n = asked.thin
    voxels = np.ascontiguousarray(voxels[::n, ::n, ::n])
    z, y, x = (n * each for each in grid.spacing_mm_zyx)
    look = transfer(function(voxels, Grid.of(voxels.shape, (z, y, x)), asked.function))
    made = {
        way: make(folder / str(i), way, voxels, (z, y, x), look, step_voxels=_SHADOW_STEP if "shadow" in way else _STEP)
        for i, way in enumerate(WAYS)
    }
    found = {way: draw(each, (VIEW,), asked.pixels)[0] for way, each in made.items()}
    truth = truths(made["unlit"], voxels, (VIEW,), asked.pixels)[VIEW]
    best = found[WAYS[-1]]
    decibels = -10 * np.log10(max(float(squares_beyond_noise(best, truth).mean()), 1e-8))
    off = np.clip(0.5 + _TIMES * (best - truth.rgba), 0.0, 1.0)
    off[..., 3] = 1.0
    return {**found, "path traced": truth.rgba, f"{_TIMES:.0f} times the difference, {decibels:.1f} dB": off}


def transfer(look: TransferFunction) -> str:
    """Return a transfer function in TOML."""
    points = (
        f"{{ value = {each.value!r}, colour = {list(each.colour)}, extinction_per_mm = {each.extinction_per_mm!r} }}"
        for each in look.points
    )
    return f'name = "{look.name}"\npoints = [{", ".join(points)}]'


def write(path: Path, rows: dict[str, dict[str, Float64Array]]) -> None:
    """Write the pictures of all scans as one."""
    from matplotlib.figure import Figure

    columns = max(len(row) for row in rows.values())
    figure = Figure(figsize=(_INCHES * columns, 1.1 * _INCHES * len(rows)), dpi=120)
    axes = figure.subplots(len(rows), columns, squeeze=False)
    for cells, (name, row) in zip(axes, rows.items(), strict=True):
        cells[0].set_ylabel(name, fontsize=7)
        for cell, (title, picture) in zip(cells, row.items(), strict=True):
            cell.imshow(encoded(picture, "black"), interpolation="nearest")
            cell.set_title(title, fontsize=5, pad=2)
            cell.set_xticks([])
            cell.set_yticks([])
    figure.tight_layout()
    figure.savefig(path)


def main() -> None:
    """Make the sheet of the scans that are asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.light_study.sheet", description=__doc__)
    parser.add_argument("out", type=Path, metavar="OUT.png")
    parser.add_argument("scans", nargs="*", metavar="SCAN", help=f"of {', '.join(SCANS)}; all if absent")
    parser.add_argument("--data", type=Path, default=os.environ.get("VOLPREP_TEST_DATA"), help="the data for tests")
    parser.add_argument("--function", choices=KINDS, default=KINDS[-1])
    parser.add_argument("--pixels", type=int, default=128)
    parser.add_argument("--thin", type=int, default=1)
    asked = parser.parse_args()
    rows = {}
    for name in asked.scans or SCANS:
        with tempfile.TemporaryDirectory() as folder:
            rows[name] = pictures(Path(folder), name, asked)
        sys.stdout.write(f"{name}: {list(rows[name])[-1]}\n")
        sys.stdout.flush()
    write(asked.out, rows)


if __name__ == "__main__":
    main()
