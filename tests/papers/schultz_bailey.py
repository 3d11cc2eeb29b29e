"""Schultz and Bailey, the Beaver Volume Renderer (BVR): tables 1 to 4, and the pictures of appendices C to F.

A scan that is too large is seen whole, halved, in pieces and cut.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from tests.benchmarks.drawing_time import honest_clock, picture_ms
from tests.benchmarks.waking import wake
from volprep.render.renderer import Renderer
from volprep.truth.camera import Camera, view_from
from volprep_formats.arrays import Float32Array
from volprep_formats.package.reader import Package

from .bench import ALONE, Bench, View, rmse
from .reading import MOSAIC
from .record import Cell, Measured, Paper, PaperPicture, PaperPictures, PaperTable
from .volumes import Volume, scan

ZOOMS = (1.0, 1.5)
MIN_VALUES = (0.0, 0.84)
_ALPHA = 0.03
_STEP_SHARE = 1 / 355
_PIXELS, PIXELS = 512, 256
"""Of the paper, on a GPU; and fewer on a software driver, where time goes with pixels and a turn has 72 pictures."""
_DEGREES = 5
"""Of the spin, as in the paper."""
_SIDES = {"sagittal": 90.0, "frontal": 0.0}
_PARTS = ("full volume", "half resolution", "eight pieces", "custom cut")
_FLAT = "OpenGL ES 2.0"
"""The same pieces as mosaics: eight of them take all texture units, so that control points classify."""
_APPENDICES = "CDEF"
"""One for each part."""


@dataclass(frozen=True)
class _Shown:
    """What is drawn: a package, the voxels that it should show, and which level or which pieces of it."""

    package: Package
    volume: Volume
    level: int = 0
    point: int | None = None


def measure(bench: Bench) -> Paper:
    """Measure all four tables."""
    whole = scan("MR head").reduced(3) if bench.quick else scan("MR head")
    pixels = PIXELS if bench.quick or bench.software else _PIXELS
    tables, cells, sheet = [], {}, []
    for number, part in enumerate(_PARTS, 1):
        found = {low: _shown(bench, whole, part, low) for low in MIN_VALUES}
        drawn = [*_rows(bench, found, pixels)]
        rows = [row for row, _ in drawn]
        sheet += [
            PaperPicture.of(f"{_APPENDICES[number - 1]}: {part}, {row[0]}, zoom {row[1]}, from {row[3]}", picture)
            for row, picture in drawn
            if picture is not None
        ]
        # Without zoom.
        cells[part] = {(row[0], row[3]): row[-1] for row in rows if row[1] == ZOOMS[0]}
        if part == "eight pieces":
            flat = [*_flat_rows(bench, whole, pixels)]
            rows += flat
            cells[_FLAT] = {(row[0], row[3]): row[-1] for row in flat}
        tables.append(
            PaperTable(
                f"Table {number}: {part}, {found[0.0].volume.name if part == 'custom cut' else whole.name} voxels",
                ("view", "zoom", "alpha", "least value", "frame rate"),
                tuple(rows),
                f"{pixels}² pixels; a zoom of 1.5 shows the volume with 2.25 times the pixels. Steps are 1/355 of the "
                f"longest axis. The spin is the mean of a turn in steps of {_degrees(bench)}°; no error is given for "
                "it.",
            )
        )
    return Paper(
        "schultz-bailey",
        "BVR, the Beaver Volume Renderer: sub-volumes on a tablet",
        "Schultz and Bailey",
        (
            *tables,
            PaperPictures(
                "Appendices C to F: the pictures of tables 1 to 4",
                tuple(sheet),
                "The number of pixels is that of the pictures whose error is measured.",
            ),
        ),
        _finding(cells, software=bench.software),
        ("Walking from piece to piece and swapping levels by zoom: the paper has no numbers for them.",),
    )


def _degrees(bench: Bench) -> int:
    return 90 if bench.quick else _DEGREES


def _shown(bench: Bench, whole: Volume, part: str, low: float) -> _Shown:
    longest = max(whole.stored.shape)
    look = _look(whole, low, _STEP_SHARE * max(whole.info.grid.extent_mm_zyx))
    half = f"[pyramid]\ncoarsest_longest_axis = {-(-longest // 2)}\n"
    if part == "custom cut":
        cut = whole.middle(longest // 2 if bench.quick else 192)
        return _Shown(bench.package(cut, look, head=_WHOLE, render=_RENDER, more=ALONE + _NO_SKIP), cut)
    if part == "eight pieces":
        return _pieces(bench, whole, look, "gles3", _RENDER)
    package = bench.package(whole, look, head=_WHOLE, render=_RENDER, more=half + _NO_SKIP)
    return _Shown(package, whole, level=1 if part == "half resolution" else 0)


def _pieces(bench: Bench, whole: Volume, look: str, profile: str, render: str) -> _Shown:
    longest = max(whole.stored.shape)
    tables = f"[pyramid]\ncoarsest_longest_axis = {-(-longest // 2)}\n{_NO_SKIP}[grid]\nsize = {longest // 2 + 1}\n"
    package = bench.package(whole, look, profile=profile, head=_WHOLE, render=render, more=tables)
    # Of a grid of 2 × 2 × 2 pieces the middle point has all eight around it.
    return _Shown(package, whole, point=13)


def _flat_rows(bench: Bench, whole: Volume, pixels: int) -> Iterator[tuple[Cell, ...]]:
    """Measure eight pieces in mosaics from both sides, beside the paper's rows."""
    look = _look(whole, 0.0, _STEP_SHARE * max(whole.info.grid.extent_mm_zyx))
    shown = _pieces(bench, whole, look, MOSAIC, f'{_RENDER}\nclassification = "control-points"')
    with _opened(bench, shown) as renderer:
        for side, degrees in _SIDES.items():
            cell, _ = _drawn(bench, renderer, shown, _view(shown, degrees, ZOOMS[0], pixels))
            yield f"{side}, {_FLAT}", ZOOMS[0], _ALPHA, 0.0, cell


_WHOLE = 'crop = "none"'
_RENDER = "step_voxels = 0.5\nopacity_cutoff = 0.998"
_NO_SKIP = '[skip]\nkind = "none"\n'


def _look(volume: Volume, low: float, step_mm: float) -> str:
    """Return grey values with one opacity, from the least value that is shown on, as a part of the range."""
    least, most = float(volume.stored.min()), float(np.percentile(volume.stored, 99.9))
    extinction = -math.log1p(-_ALPHA) / step_mm
    shown = least + low * (most - least)
    dark = f"{{ value = {shown:.6g}, colour = [{low:g}, {low:g}, {low:g}], extinction_per_mm = {extinction:.6g} }}"
    bright = f"{{ value = {most:.6g}, colour = [1.0, 1.0, 1.0], extinction_per_mm = {extinction:.6g} }}"
    edge = f"{{ value = {shown:.6g}, colour = [0.0, 0.0, 0.0], extinction_per_mm = 0.0 }}, " if low else ""
    return f"points = [{edge}{dark}, {bright}]"


_Drawn = tuple[tuple[Cell, ...], Float32Array | None]
"""A row of a table, and its picture."""


def _rows(bench: Bench, found: dict[float, _Shown], pixels: int) -> Iterator[_Drawn]:
    for side, degrees in _SIDES.items():
        for zoom in ZOOMS:
            for low, shown in found.items():
                with _opened(bench, shown) as renderer:
                    cell, picture = _drawn(bench, renderer, shown, _view(shown, degrees, zoom, pixels))
                yield (side, zoom, _ALPHA, low, cell), picture
    shown = found[0.0]
    for zoom in ZOOMS:
        with _opened(bench, shown) as renderer:
            views = [_view(shown, degrees, zoom, pixels) for degrees in range(0, 360, _degrees(bench))]
            yield ("spin", zoom, _ALPHA, 0.0, Measured(_spin_ms(renderer, shown, views))), None


def _spin_ms(renderer: Renderer, shown: _Shown, views: list[View]) -> float:
    """Return the mean time of the pictures of a turn; each is drawn once, as an app does."""
    name = renderer.driver.renderer
    clock = honest_clock(name)
    wake(name, lambda: renderer.time_ms(*_asked(shown, views[0]), repeats=1))
    # This picture is not counted: the driver may compile the shader for it.
    renderer.time_ms(*_asked(shown, views[0]), repeats=1)
    return float(np.mean([renderer.time_ms(*_asked(shown, view), repeats=1, clock=clock) for view in views]))


@contextmanager
def _opened(bench: Bench, shown: _Shown) -> Iterator[Renderer]:
    if shown.point is None:
        with bench.renderer(shown.package, shown.level) as renderer:
            yield renderer
        return
    with Renderer(shown.package, point=shown.point) as renderer:
        yield renderer


def _view(shown: _Shown, degrees: float, zoom: float, pixels: int) -> View:
    """Look from so many degrees off the front, on a circle around the body."""
    grid = shown.package.manifest.levels[0].grid
    middle = grid.corner_mm_xyz + np.array(grid.direction) @ (np.array(grid.extent_mm_zyx[::-1]) / 2)
    angle, away = math.radians(degrees), 2 * math.hypot(*grid.extent_mm_zyx)
    x, y, z = (middle + away * np.array([math.sin(angle), -math.cos(angle), 0.0])).tolist()
    camera: Camera = view_from(grid, (x, y, z))
    return View(replace(camera, height_mm=camera.height_mm / zoom), (pixels, pixels))


def _asked(shown: _Shown, view: View) -> tuple[np.ndarray, tuple[int, int], float]:
    grid = shown.package.manifest.levels[0].grid
    return view.camera.box_from_clip(grid, view.aspect), view.shape_hw, _STEP_SHARE * max(grid.extent_mm_zyx)


def _drawn(bench: Bench, renderer: Renderer, shown: _Shown, view: View) -> tuple[Measured, Float32Array]:
    camera, shape_hw, step_mm = _asked(shown, view)
    ms = picture_ms(renderer, camera, shape_hw, step_mm, 2)
    picture = renderer.render(camera, view.small_hw, step_mm)
    return Measured(ms, rmse(picture, bench.truth(shown.package, shown.volume, view))), picture


_Rows = dict[str, dict[tuple[Cell, Cell], Cell]]


def _finding(cells: _Rows, *, software: bool) -> str:
    def ms(part: str, view: str, low: float = 0.0) -> float:
        cell = cells[part][view, low]
        assert isinstance(cell, Measured)
        return cell.ms

    full, half, eight, cut = _PARTS
    apart = {part: ms(part, "sagittal") / ms(part, "frontal") for part in _PARTS}
    low = ms(full, "frontal", MIN_VALUES[1]) / ms(full, "frontal")
    flat = ms(_FLAT, f"frontal, {_FLAT}") / ms(eight, "frontal")
    gain, pieces, own = ms(full, "spin") / ms(half, "spin"), ms(eight, "spin") / ms(full, "spin"), ms(cut, "spin")
    memory = (
        "Neither storing nor caching of 3D textures shows here: what is left is the length of the rays."
        if max(apart[full], 1 / apart[full]) < 1.3
        else "So the order of voxels in memory counts here, too."
    )
    halved = (
        "with one step for all, as the paper has it, the number of samples is the same, so that only a cache could gain"
        if gain < 1.3
        else "which is a cache, because with one step for all the number of samples is the same"
    )
    smaller = (
        "the fastest view of the paper, and here"
        if own < ms(full, "spin")
        else "the fastest view of the paper, but not here: in a frame of its own it fills as many "
        "pixels, and steps that are shares of the box are as many"
    )
    return (
        "The paper's front view is up to five times as fast as its side view, and it suspects how the driver stores "
        f"3D textures. Here the side view takes {apart[full]:.2f} of the time of the front view for the full volume "
        f"and {apart[half]:.2f} at half the resolution. {memory} Half the resolution is {gain:.2f} times as fast in a "
        f"spin, where the paper gains a factor of three: {halved}. Eight pieces take {pieces:.1f} times as long as "
        "one volume; in the paper, too, they are slower than half the resolution, because the shader chooses a "
        f"texture for each sample{', and a driver without branches reads all eight' if software else ''}. In mosaics, "
        f"which {_FLAT} draws with control points in place of a table, the front view of the pieces takes {flat:.1f} "
        "times as long as in 3D textures. The cut "
        f"takes {own / ms(full, 'spin'):.2f} of the time of the full volume: {smaller}. A least value of 0.84 takes "
        f"{low:.2f} of the time of none: samples that show nothing are taken all the same where no skip table leaves "
        "them out, and rays that meet less end later."
    )
