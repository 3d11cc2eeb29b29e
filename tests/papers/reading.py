"""Thesis: 2D slices in mosaics beside tables 3 and 4, mosaics against 3D textures and bricks, and figure 19.

The thesis regrets that no paper compares mosaics with 3D textures (section 6.8), and leaves it as future work.
"""

import math
import re

from volprep.techniques import TECHNIQUES
from volprep.truth.camera import standard_views
from volprep.validation.comparison.altered import Altered
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.program import TechniqueName
from volprep_formats.package.reader import Package

from .bench import ALONE, Bench, View, reason
from .record import Cell, Measured, PaperPicture, PaperPictures, PaperTable
from .volumes import Volume

MOSAIC = "gles2-4096"
"""Profile whose volumes are mosaics: slices side by side in 2D textures."""
_NO_SKIP = '[skip]\nkind = "none"\n'
_PLAIN = "opacity_cutoff = 1.0\n"
_VIEW = "anterior-left"
_DRAWN: tuple[TechniqueName, ...] = ("ray-casting", "view-slices", "axis-slices")
_WAYS = {
    "3D texture": ("gles3", ""),
    "mosaic, one channel": (MOSAIC, ""),
    "mosaic, four channels": (MOSAIC, '[lab.mosaic]\norder = "interleaved"\n'),
    "bricks in a 3D texture": ("gles3", "[bricks]\n"),
    "bricks in a mosaic": (MOSAIC, "[bricks]\n"),
}
_SURFACE = """reference_mm = 1.0
isovalue = {at:.6g}
points = [{{ value = {low:.6g}, colour = "#c08a6a", opacity = 1.0 }},
    {{ value = {high:.6g}, colour = "#fff0d8", opacity = 1.0 }}]"""
_ISOVALUE = 0.4
"""Of the surface, as a share of the greatest value: the engine's metal."""
_LOOSE_STEPS = (2.0, 1.0, 0.5)
_BISECTION = re.compile(r"(vec3 passed_between\(vec3 front, vec3 back\) \{\n)")


def mosaic_cell(  # noqa: PLR0917 - what is drawn, and how
    bench: Bench, volume: Volume, technique: TechniqueName, pixels: int, classification: str, step_mm: float | None
) -> Cell:
    """Measure a technique whose slices lie in a mosaic; where it is not possible, the code that says why."""
    render = f'technique = "{technique}"\nclassification = "{classification}"\nstep_voxels = 0.5\n{_PLAIN}'
    try:
        package = bench.package(volume, "micro-ct", profile=MOSAIC, render=render, more=ALONE + _NO_SKIP)
    except VolprepError as error:
        return reason(error)
    view = View(standard_views(package.manifest.levels[0].grid)[_VIEW], (pixels, pixels))
    with bench.renderer(package) as renderer:
        return bench.measured(renderer, package, volume, view, step_mm)


def ways_to_read(bench: Bench, volume: Volume, pixels: int) -> PaperTable:
    """Measure the same voxels in each texture layout, with rays and with slices."""
    rows: list[tuple[Cell, ...]] = []
    for name, (profile, more) in _WAYS.items():
        cells: list[Cell] = []
        held = 0
        for technique in _DRAWN:
            render = f'technique = "{technique}"\nstep_voxels = 0.5\n{_PLAIN}'
            package = bench.package(volume, "micro-ct", profile=profile, render=render, more=ALONE + _NO_SKIP + more)
            held = package.manifest.pictures[0].drawings[0].cost.gpu_bytes
            view = View(standard_views(package.manifest.levels[0].grid)[_VIEW], (pixels, pixels))
            with bench.renderer(package) as renderer:
                cells.append(bench.measured(renderer, package, volume, view))
        rows.append((name, *cells, f"{held / 1e6:.1f} MB"))
    return PaperTable(
        f"Section 6.8: mosaics against 3D textures and bricks, {volume.name} voxels, {pixels}² pixels",
        ("layout", *(TECHNIQUES[name].text for name in _DRAWN), "textures"),
        tuple(rows),
        "Steps of half a voxel, no skip tables. The thesis leaves the comparison as future work. OpenGL ES 2.0, which "
        "draws the mosaics, rounds each layer of slices to 8 bits.",
    )


def about_ways(table: PaperTable) -> str:
    """Say what a mosaic costs, from this run's numbers."""
    times = {str(row[0]): [cell.ms for cell in row if isinstance(cell, Measured)] for row in table.rows}
    whole = times["3D texture"]

    def against(name: str) -> str:
        factors = [one / other for one, other in zip(times[name], whole, strict=True)]
        return f"{min(factors):.1f} to {max(factors):.1f}"

    others = [name for name in _WAYS if name != "3D texture"]
    said = ", ".join(f"{name} {against(name)}" for name in others)
    errors = [cell.rmse or 0.0 for row in table.rows for cell in row[1:2] if isinstance(cell, Measured)]
    apart = max(errors) / max(min(errors), 1e-9)
    same = "the same within a tenth" if apart < 1.1 else f"up to {apart:.1f} times apart"
    return (
        f" Against a 3D texture the same pictures take as many times as long: {said}. With rays their errors are "
        f"{same}. No paper that the thesis knows has compared them."
    )


def figure19(bench: Bench, volume: Volume, pixels: int) -> tuple[PaperPictures, PaperTable]:
    """Draw an isosurface with and without the search between two samples."""
    low, high = float(volume.stored.min()), float(volume.stored.max())
    look = _SURFACE.format(at=low + _ISOVALUE * (high - low), low=low, high=high)
    rows: list[tuple[Cell, ...]] = []
    pictures: list[PaperPicture] = []
    truth = None
    for steps in _LOOSE_STEPS[:2] if bench.quick else _LOOSE_STEPS:
        render = f'compositing = "isosurface"\nlighting = "headlight"\nstep_voxels = {steps}\n'
        package = bench.package(volume, look, render=render, more=ALONE + _NO_SKIP)
        grid = package.manifest.levels[0].grid
        view = View(standard_views(grid)[_VIEW], (pixels, pixels))
        cells: list[Cell] = []
        for name, shown in {"the last sample": _unrefined(package), "refined": package}.items():
            with bench.renderer(shown) as renderer:
                cells.append(bench.measured(renderer, package, volume, view))
                camera = view.camera.box_from_clip(grid, 1.0)
                if steps == _LOOSE_STEPS[0]:
                    pictures.append(
                        PaperPicture.of(f"steps of {steps:g} voxels, {name}", renderer.render(camera, (pixels, pixels)))
                    )
        truth = bench.truth(package, volume, view)
        rows.append((f"{steps:g} voxels", *cells))
    if truth is not None:
        pictures.append(PaperPicture.of("exact roots on the scan", truth.astype("float32")))
    return (
        PaperPictures(
            f"Figure 19: an isosurface with and without adaptive refinement, {volume.name} voxels", tuple(pictures)
        ),
        PaperTable(
            f"Figure 19 in numbers, {volume.name} voxels, {pixels}² pixels",
            ("step", "the last sample", "refined"),
            tuple(rows),
            "Refined: bisection between the samples on both sides, and there a straight line. Lit from the viewer, "
            "because light shows the steps of a surface.",
        ),
    )


def about_refinement(table: PaperTable) -> str:
    """Say what the refinement gains, from this run's numbers."""
    _, plain, fine = table.rows[0]
    assert isinstance(plain, Measured)
    assert isinstance(fine, Measured)
    gain = (plain.rmse or 0.0) / max(fine.rmse or 0.0, 1e-9)
    return (
        f" Figure 19: with {table.rows[0][0]} between samples, the search for the surface makes its error "
        f"{gain:.1f} times smaller and takes {fine.ms / plain.ms:.2f} of the time of the last sample."
    )


def _unrefined(package: Package) -> Package:
    """Return the package whose surface lies at the first sample behind it, as without the search."""
    program = package.manifest.level_programs[0]
    text, count = _BISECTION.subn(
        r"\1  if (ISOVALUE >= 0.0) {\n    return back;\n  }\n", package.read_text(program.fragment)
    )
    assert count == 1
    return Altered(package, {program.fragment: text})


def diagonal_step(volume: Volume, steps: int) -> float:
    """Return the step that divides the diagonal of a volume."""
    return math.hypot(*volume.info.grid.extent_mm_zyx) / steps
