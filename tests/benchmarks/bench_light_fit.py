"""Time and memory of light that is computed once, for a whole scan.

`python -m tests.benchmarks.bench_light_fit SCAN [--size N] [--function KIND]`. The scan is stretched to N voxels along
each axis, as uint8, and has a transfer function of `tests.light_study`, a white sky, and scattering. Light has half of
its resolution, or a quarter if half is more than builds take, and is fitted to as many places as in a build. Prints
seconds of the wall clock and of the processor, also those of the two native kernels, and the peak of memory.
"""

import argparse
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.ndimage import zoom

from tests.light_study.subjects import KINDS, function
from volprep.kernels import _native
from volprep.library.scans import read_scan
from volprep.parts.light.decision import sample_count
from volprep.parts.light.solve import solve_field
from volprep.parts.light.trial import MOST_TEXELS, texels
from volprep.truth.path_traced import LitVolume
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.progress import Silent


class Timed:
    """A kernel, and the processor seconds that its calls have taken."""

    def __init__(self, kernel: Callable[..., Any]) -> None:
        self._kernel, self.seconds = kernel, 0.0

    def __call__(self, *parts: Any, **named: Any) -> Any:
        start = time.process_time()
        found = self._kernel(*parts, **named)
        self.seconds += time.process_time() - start
        return found


def stretched(scan: Path, size: int, kind: str) -> LitVolume:
    """Return a scan of `size`³ voxels under a white sky."""
    found = read_scan(scan)
    low, high = np.quantile(found.stored, [0.0, 0.999]).tolist()
    bytes_ = np.clip((found.stored.astype(np.float32) - low) * (255.0 / (high - low)), 0.0, 255.0)
    voxels = zoom(bytes_, [size / n for n in found.grid.shape_zyx], output=np.uint8, order=1)
    z_mm, y_mm, x_mm = (mm / size for mm in found.grid.extent_mm_zyx)
    grid = Grid.of(voxels.shape, (z_mm, y_mm, x_mm))
    return LitVolume(voxels, grid, 1.0, 0.0, function(voxels, grid, kind), LightModel(kind="scattering"))


def main() -> None:
    """Fit the light, and print a line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scan", type=Path)
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--function", choices=KINDS, default=KINDS[0])
    asked = parser.parse_args()
    lit = stretched(asked.scan, asked.size, asked.function)
    factor = 2 if texels(lit.grid, 2) <= MOST_TEXELS else 4
    z, y, x = (-(-n // factor) for n in lit.grid.shape_zyx)
    samples, solver = Timed(_native.light_samples), Timed(_native.solve_light)
    wall, processor = time.perf_counter(), time.process_time()
    with patch.object(_native, "light_samples", samples), patch.object(_native, "solve_light", solver):
        field = solve_field(lit, factor, sample_count((z, y, x)), Silent())
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    sys.stdout.write(
        f"{asked.size} cubed, 1/{factor}, {asked.function}, {field.samples} places: {wall:.0f} s, "
        f"processor {processor:.0f} s (samples {samples.seconds:.0f}, solver {solver.seconds:.0f}), "
        f"peak {peak:.2f} GB, residual {field.residual:.2g}, smoothness {field.smoothness}\n"
    )


if __name__ == "__main__":
    main()
