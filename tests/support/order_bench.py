"""Errors of small pictures against the truth, as steps, grids and pixels get finer, for every way to draw a volume."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path

import numpy as np
from order_scans import SHAPE_ZYX, TRANSFER, built, camera, field, grid_of, transfer
from order_twins import classified_voxels, preclassified_picture

from volprep.compositing import COMPOSITINGS
from volprep.lab.stress.combinations import Way, in_way
from volprep.render.renderer import Renderer
from volprep.techniques import TECHNIQUES
from volprep.truth.averaged import averaged
from volprep.truth.decoded import level_volume, table_function
from volprep.truth.phantoms import sampled
from volprep.truth.volume import Medium, Volume
from volprep.validation.timing.order import OrderFacts
from volprep_formats.package.parts.subvolumes.record import decode_grid
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package

Altering = Callable[[Package, Program], Package]
"""Plants a fault; None where there is none."""

PIXELS = 24
OUTLINE_PIXELS = 256
"""The error of a surface is in its outline: a picture must have enough of it."""
FEW_PIXELS = 0.004
"""Error of two pixels of such a picture."""
ROUNDED = 1e-5
"""More than eight times what float32 leaves: 8e-7 to 1.4e-6 (llvmpipe)."""
NOMINAL_VOXELS = 0.0625
"""Nominal step of packages: loops of OpenGL ES 2.0 go up to eight times finer."""
STEPS_MM = tuple(3.2 / 2**k for k in range(6))
OUTLINE_STEPS_MM = (3.2, 1.6, 0.8, 0.4)
SEGMENT_STEPS_MM = (1.6, 0.8, 0.4, 0.2)
"""Between its entries a pre-integrated table is constant: finer steps show that."""
BYTES_STEPS_MM = (0.2, 0.1, 0.05)
"""A lookup table of bytes has a kink at each entry: the order is settled where steps see them all."""
PUBLISHED_STEPS_MM = tuple(0.028 / 2**k for k in range(3))
"""What is published with an error hides it behind that of the step where steps are coarse."""
SHAPES_ZYX = ((6, 7, 8), (12, 14, 16), (24, 28, 32))
FINEST_ZYX = (96, 112, 128)
"""The truth of the field itself: 16 times as exact as that of the finest grid."""
GRID_STEP_MM = 0.05
PIXEL_COUNTS = (4, 8, 16)
TRUE_PIXELS = 128
PIXEL_STEP_MM = 0.04
MIDDLE = 13
"""The point of the grid around which there are eight pieces: 1, 1, 1 of 3 × 3 × 3."""


@dataclass(frozen=True)
class Falling:
    """Errors while something gets finer."""

    sizes: Sequence[float]
    errors: Sequence[float]

    @property
    def order(self) -> float:
        """Slope of the straight line through all of them: single refinements gain from 2 to 8, as kinks fall."""
        return float(np.polyfit(np.log(self.sizes), np.log(np.maximum(self.errors, 1e-9)), 1)[0])


def rmse(picture: np.ndarray, truth: np.ndarray) -> float:
    """Root mean square error of all channels."""
    return float(np.sqrt(np.mean((picture - truth) ** 2)))


def _once(measure: Callable[..., Falling]) -> Callable[..., Falling]:
    """Measure a way without a fault once, however many tests ask."""

    @wraps(measure)
    def measured(bench: "Bench", way: Way, fault: Altering | None = None) -> Falling:
        if fault is not None:
            return measure(bench, way, fault)
        key = (measure.__name__, way)
        if key not in bench.measured:
            bench.measured[key] = measure(bench, way)
        return bench.measured[key]

    return measured


class Bench:
    """Packages, true pictures and what is measured without a fault, each made once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._packages: dict[object, Package] = {}
        self._truths: dict[object, np.ndarray] = {}
        self.measured: dict[tuple[str, Way], Falling] = {}

    def package(
        self, way: Way, step_voxels: float = NOMINAL_VOXELS, shape_zyx: tuple[int, int, int] = SHAPE_ZYX
    ) -> Package:
        """Package with the textures and tables of a way."""
        key = (way.classification, way.sampling, step_voxels, shape_zyx)
        if key not in self._packages:
            folder = self._folder / str(len(self._packages))
            kept = Way(classification=way.classification, sampling=way.sampling)
            self._packages[key] = built(folder, kept, step_voxels, shape_zyx=shape_zyx)
        return self._packages[key]

    def renderer(self, package: Package, way: Way, fault: Altering | None = None) -> Renderer:
        """Draws a package in another way, into floats; pieces around the point that all of them touch."""
        manifest = package.manifest
        files = manifest.subvolumes if way.sampling == "subvolumes" else None
        drawn = in_way(package, _program(package, way), way)
        if fault is not None:
            drawn = fault(drawn, _program(drawn, way))
        if files is None:
            return Renderer(drawn, target="rgba32f")
        assert decode_grid(package.read_bytes(files.grid), package.path, files.grid).counts_zyx == (2, 2, 2)
        return Renderer(drawn, target="rgba32f", point=MIDDLE)

    def truth(self, package: Package, way: Way, pixels: int, zoom: float = 1.0) -> np.ndarray:
        """What the textures and tables of a package should show."""
        table = (way.classification, way.sampling == "mosaic")
        segments = way.classification == "preintegrated"
        # The function itself is what segments are tables of.
        shown = package.manifest.transfer_functions if segments else table
        key = (way.compositing, shown, package.manifest.levels[0].grid.shape_zyx, pixels, zoom)
        if key not in self._truths:
            box_from_clip = camera(package, zoom=zoom)
            if way.classification == "preclassified":
                self._truths[key] = preclassified_picture(*classified_voxels(package), box_from_clip, pixels)
            else:
                medium = Medium(level_volume(package, 0), table_function(package, TRANSFER))
                self._truths[key] = self._oracle(way, medium, box_from_clip, pixels)
        return self._truths[key]

    def true_field(self, way: Way, pixels: int, package: Package, zoom: float) -> np.ndarray:
        """What the field itself should show, with the control points of the transfer function."""
        grid = grid_of(FINEST_ZYX)
        key = ("field", way.compositing, pixels, zoom, way.classification == "palette" and way.sampling)
        if key not in self._truths:
            # A palette has steps, whatever the grid: they are no part of the question.
            function = table_function(package, TRANSFER) if way.classification == "palette" else transfer().resolved()
            medium = Medium(Volume(sampled(field, grid), grid), function)
            self._truths[key] = self._oracle(way, medium, camera(package, zoom=zoom), pixels)
        return self._truths[key]

    def _oracle(self, way: Way, medium: Medium, box_from_clip, pixels: int) -> np.ndarray:
        return COMPOSITINGS[way.compositing].oracle([medium], box_from_clip, (pixels, pixels)).rgba

    @_once
    def by_step(self, way: Way, fault: Altering | None = None) -> Falling:
        """Errors of ever finer steps."""
        pixels, steps_mm = _picture_of(way)
        package = self.package(way)
        truth = self.truth(package, way, pixels)
        with self.renderer(package, way, fault) as renderer:
            box_from_clip = camera(package)
            errors = [rmse(renderer.render(box_from_clip, (pixels, pixels), step), truth) for step in steps_mm]
        return Falling(steps_mm, errors)

    @_once
    def by_grid(self, way: Way, fault: Altering | None = None) -> Falling:
        """Errors of ever finer grids, against the field that all of them sample.

        Where there is no outline to see the camera looks into the middle: rays that run in the outer half voxel, which
        repeats its edge, are fewer on finer grids, but no better.
        """
        pixels, _ = _picture_of(way)
        zoom = 1.0 if COMPOSITINGS[way.compositing].isovalue else 2.5
        errors = []
        for shape_zyx in SHAPES_ZYX:
            step_voxels = GRID_STEP_MM / min(grid_of(shape_zyx).spacing_mm_zyx)
            package = self.package(way, step_voxels, shape_zyx)
            with self.renderer(package, way, fault) as renderer:
                picture = renderer.render(camera(package, zoom=zoom), (pixels, pixels), GRID_STEP_MM)
            errors.append(rmse(picture, self.true_field(way, pixels, package, zoom)))
        return Falling([1 / shape[0] for shape in SHAPES_ZYX], errors)

    @_once
    def by_pixel(self, way: Way, fault: Altering | None = None) -> Falling:
        """Errors of ever smaller pixels, each a ray through its centre, against means of many rays.

        The camera looks into the middle, where no outline is.
        """
        package = self.package(way)
        truth = averaged(self.truth(package, way, TRUE_PIXELS, zoom=6.0), PIXEL_COUNTS[0])
        with self.renderer(package, way, fault) as renderer:
            pictures = [
                renderer.render(camera(package, zoom=6.0), (pixels, pixels), PIXEL_STEP_MM) for pixels in PIXEL_COUNTS
            ]
        errors = [rmse(averaged(picture, PIXEL_COUNTS[0]), truth) for picture in pictures]
        return Falling([1 / pixels for pixels in PIXEL_COUNTS], errors)


def expected_by_step(way: Way) -> float:
    """Order that the records of a way say."""
    return OrderFacts(way.technique, way.compositing, way.classification).order


def is_exact(way: Way, falling: Falling) -> bool:
    """Whether no error is left for a slope: of a surface single pixels of its outline, of cells rounding."""
    if _in_cells(way):
        return max(falling.errors[STEPS_MM.index(0.8) :]) < ROUNDED
    return COMPOSITINGS[way.compositing].isovalue and max(falling.errors[1:]) < FEW_PIXELS


def as_expected(way: Way, falling: Falling) -> bool:
    """Whether errors fall with the order that the records of a way say, or there are next to none."""
    falls = not _in_cells(way) and abs(falling.order - expected_by_step(way)) <= scatter(way)
    return falls or is_exact(way, falling)


def _in_cells(way: Way) -> bool:
    """Whether steps of up to a voxel, which is 1 mm, must be exact."""
    return COMPOSITINGS[way.compositing].cell_by_cell and TECHNIQUES[way.technique].order is None


def expected_elsewhere(way: Way) -> float | None:
    """Order with which grids and pixels get better; None where an error remains that neither makes smaller.

    Trilinear fields and means over pixels have order 2. At an outline, at a step of a palette, and where a maximum lies
    on a face between cells it is 1 at least.
    """
    if TECHNIQUES[way.technique].order is not None:
        return None
    smooth = COMPOSITINGS[way.compositing].order == 2.0 and way.classification != "palette"
    return 2.0 if smooth else 1.0


def scatter(way: Way) -> float:
    """How far the slope of a few refinements may be from the order.

    Of a surface, only few pixels of the outline are wrong; tables have half floats or bytes.
    """
    by_bytes = (way.classification, way.sampling) == ("lookup", "mosaic")
    return 0.5 if by_bytes or COMPOSITINGS[way.compositing].isovalue else 0.3


def _picture_of(way: Way) -> tuple[int, Sequence[float]]:
    """Size and steps with which the error of a way shows."""
    outline = COMPOSITINGS[way.compositing].isovalue
    pixels = OUTLINE_PIXELS if outline else PIXELS
    if expected_by_step(way) == 0.0:
        return pixels, PUBLISHED_STEPS_MM
    if way.classification == "preintegrated":
        return pixels, SEGMENT_STEPS_MM
    if (way.classification, way.sampling, COMPOSITINGS[way.compositing].order) == ("lookup", "mosaic", 2.0):
        return pixels, BYTES_STEPS_MM
    return pixels, OUTLINE_STEPS_MM if outline else STEPS_MM


def _program(package: Package, way: Way) -> Program:
    (picture,) = package.manifest.pictures
    drawn = picture.pieces if way.sampling == "subvolumes" else picture.drawings[0]
    assert drawn is not None
    return package.manifest.picture_program(drawn.program, picture)
