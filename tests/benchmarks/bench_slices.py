"""Slices of OpenGL ES 1.1: error against run time by number of slices, form and angle of view.

One field, sampled by more and more voxels; the truth is the oracle on the finest of them. The angle is that between the
direction of view and the axis of the stack that is drawn; 54.7° is as far as it gets with three stacks. Times are those
of the driver at hand, and count for comparison only.
"""

import math
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from tests.support.slice_packages import missing_es11, slice_package
from volprep.render.slices import SliceRenderer
from volprep.truth.camera import view_from
from volprep.truth.metrics import picture_error
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid
from volprep_formats.package.reader import Package

from .real_scans import NoData

SIZES = (24, 48, 96)
EXTENT_MM = 96.0
PICTURE_HW = (160, 160)
ANGLES = (0.0, 15.0, 30.0, 45.0, 54.7)
FORMS = {
    "RGBA": 'form = "rgba"',
    "palette 256": 'form = "palette"',
    "palette 60": "palette_entries = 60",
    "2 layers": "layers = 2",
    "4 layers": "layers = 4",
}
GLOW = (
    "{ value = 40.0, colour = [0.9, 0.5, 0.2], extinction_per_mm = 0.0 }, "
    "{ value = 140.0, colour = [1.0, 0.8, 0.6], extinction_per_mm = 0.02 }, "
    "{ value = 255.0, colour = [1.0, 1.0, 1.0], extinction_per_mm = 0.3 }"
)
FINEST_VIEW_ONLY = 45.0
"""Forms are compared at this angle; the one that loses nothing, and layers, at all of them."""


@dataclass(frozen=True)
class SliceRow:
    """One picture."""

    form: str
    """What a texel is."""
    slices: int
    """Slices of the stack that is drawn."""
    bytes: int
    """Size of the files of all stacks."""
    angle: float
    """Degrees between the view and the axis of the stack."""
    lengthened: bool
    """Whether texels count 1 / cos of the angle."""
    ms: float
    """Median time of a picture."""
    rmse: float
    """Error of the picture against the oracle."""
    maximum: float
    """Largest error of the picture."""


def measure_slices(console: Console) -> Iterator[SliceRow]:
    """Draw a field from each form at several angles, where there is OpenGL ES 1.1."""
    missing = missing_es11()
    if missing is not None:
        raise NoData(missing)
    with tempfile.TemporaryDirectory() as name:
        truths: dict[float, NDArray[np.float64]] = {}
        # The finest first: it is the truth of the others.
        for voxels in sorted(SIZES, reverse=True):
            console.print(f"measuring {voxels} slices", style="dim")
            codes = _field(voxels)
            spacing_mm = EXTENT_MM / voxels
            for form, table in FORMS.items():
                folder = Path(name) / f"{form}-{voxels}"
                package = slice_package(folder, codes, (spacing_mm,) * 3, points=GLOW, slices=table)
                yield from _rows(package, codes, form, truths)


def slices_table(rows: list[SliceRow]) -> Table:
    """Give the table of what `measure_slices` found."""
    table = Table("texels", "slices", "kB", "angle", "1 / cos", "ms a picture", "RMSE", "largest error")
    for column in table.columns[1:]:
        column.justify = "right"
    for row in rows:
        lengthened = "yes" if row.lengthened else "no"
        numbers = (f"{row.bytes / 1000:.0f}", f"{row.angle:g}°", lengthened, f"{row.ms:.1f}")
        table.add_row(row.form, str(row.slices), *numbers, f"{row.rmse:.5f}", f"{row.maximum:.4f}")
    return table


def _rows(
    package: Package, codes: NDArray[np.uint8], form: str, truths: dict[float, NDArray[np.float64]]
) -> list[SliceRow]:
    manifest = package.manifest
    grid = manifest.levels[0].grid
    size = sum(record.size_bytes for record in manifest.files if record.role == "texture")
    compared = form == "palette 256"
    rows = []
    with ExitStack() as stack:
        renderers = {
            lengthened: stack.enter_context(SliceRenderer(package, lengthen=lengthened))
            for lengthened in ((True, False) if compared else (True,))
        }
        for angle in ANGLES if compared or "layers" in form else (FINEST_VIEW_ONLY,):
            camera = _camera(grid, angle)
            for lengthened, renderer in renderers.items():
                if angle not in truths:
                    truths[angle] = _truth(package, codes, camera)
                picture = renderer.render(camera, PICTURE_HW)
                error = picture_error(picture, truths[angle])
                ms = renderer.time_ms(camera, PICTURE_HW, repeats=3)
                slices = grid.shape_zyx[0]
                rows.append(SliceRow(form, slices, size, angle, lengthened, ms, error.rmse, error.maximum))
    return rows


def _truth(package: Package, codes: NDArray[np.uint8], camera: NDArray[np.float64]) -> NDArray[np.float64]:
    function = package.manifest.transfer_functions[0]
    grid = package.manifest.levels[0].grid
    return oracle_picture(Volume(codes, grid), function, camera, PICTURE_HW).rgba


def _camera(grid: Grid, angle: float) -> NDArray[np.float64]:
    """Look from so many degrees off the z axis, midway between x and y."""
    sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
    extent = np.array(grid.extent_mm_zyx[::-1])
    centre = grid.corner_mm_xyz + np.array(grid.direction) @ (extent / 2)
    x, y, z = centre + 3 * EXTENT_MM * np.array([sine / math.sqrt(2), sine / math.sqrt(2), cosine])
    return view_from(grid, (x, y, z)).box_from_clip(grid, 1.0)


def _field(voxels: int) -> NDArray[np.uint8]:
    """Sample a shell with bumps inside a ball, the same however many voxels there are."""
    z, y, x = np.meshgrid(*[(np.arange(voxels) + 0.5) / voxels * 2 - 1] * 3, indexing="ij")
    radius = np.sqrt(x**2 + y**2 + z**2)
    bumps = 0.12 * np.sin(7 * x) * np.sin(6 * y + 1) * np.sin(5 * z + 2)
    shell = np.exp(-(((radius - 0.65 + bumps) / 0.12) ** 2))
    return np.rint(200 * shell + 55 * np.exp(-((radius / 0.3) ** 2))).astype(np.uint8)
