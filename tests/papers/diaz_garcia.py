"""Díaz-García, Brunet, Navazo and Vázquez 2018: progressive ray casting (table 1, figures 7 to 10, 12 and 13).

Every order in which volprep.render.progressive finishes a picture is measured; a new one appears by itself.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import get_args

import numpy as np

from tests.benchmarks.drawing_time import honest_ms
from volprep.render.progressive import Order, frames, low_resolution
from volprep.render.renderer import Renderer
from volprep.report.plots import Line
from volprep.techniques import TECHNIQUES
from volprep.truth.camera import standard_views
from volprep.truth.metrics import picture_error
from volprep.validation.altered import Altered
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.program import TechniqueName
from volprep_formats.package.reader import Package

from .bench import ALONE, Bench, View, rmse
from .record import Cell, Paper, PaperCurves, PaperTable
from .volumes import Volume, scan

_CLASSIC: Order = "classic"
_AT_ONCE: tuple[Order, ...] = ("classic", "slabs")
"""Orders whose frames the renderer itself gives."""
_SHAPE_HW, QUICK_HW = (640, 360), (256, 144)
_ZOOMS = (1.0, 1.7)
_CAMERAS = ("superior", "anterior-left")
_TILE_SIZES, _QUICK_SIZES = (2, 4, 8, 16, 32), (8, 32)
_PUBLISHED: dict[Order, str] = {
    "classic": "Classic RC",
    "slabs": "FBSlabs",
    "tiles": "STiles",
    "random": "Simple random",
    "structured": "Simple structured",
}


@dataclass(frozen=True)
class _Progress:
    """A picture that comes in frames."""

    frames_ms: tuple[float, ...]
    """Time of each frame, without reading it back."""
    pictures: tuple[Float32Array, ...]
    """What is shown after each."""
    rmse: float
    """Error of the last one."""


def measure(bench: Bench) -> Paper:
    """Measure every order on three scans."""
    volumes = (
        [scan("MR head").reduced(3)] if bench.quick else [scan("MR head").reduced(2), scan("ch2 head"), scan("engine")]
    )
    found: _Found = {}
    waiting: list[str] = ["Figure 11, a detail of an unfinished picture: the contact sheet has such pictures."]
    for order in get_args(Order):
        try:
            found |= {(volume.name, order): [*_runs(bench, volume, order)] for volume in volumes}
        except VolprepError as error:
            waiting.append(f"{_PUBLISHED.get(order, order)}: this driver or profile cannot do it ({error}).")
    orders = [*dict.fromkeys(order for _, order in found)]
    names = [volume.name for volume in volumes]
    dssim = _dssim(bench, found, volumes[0], orders)
    sizes = _sizes(bench, volumes) if "tiles" in orders else {}
    return Paper(
        "diaz-garcia",
        "Progressive ray casting for volumetric models on mobile devices",
        "Díaz-García, Brunet, Navazo and Vázquez 2018",
        (
            _table1(found, names, orders),
            _figure7(found, names, orders),
            _figure8(found, names, orders),
            *_by_size(sizes, names),
            dssim,
            *_over_time(sizes, names[0]),
        ),
        _finding(found, names, orders, dssim) + _about_sizes(sizes, names),
        tuple(waiting),
    )


def _runs(bench: Bench, volume: Volume, order: Order) -> Iterator[_Progress]:
    package = _package(bench, volume, order)
    with bench.renderer(package) as renderer:
        for view in _views(bench, package):
            yield _progress(bench, renderer, order, package, volume, view)


def _package(bench: Bench, volume: Volume, order: Order) -> Package:
    technique: TechniqueName = order if order in TECHNIQUES else "ray-casting"
    look = "micro-ct" if volume.word == "engine" else "mr-head"
    return bench.package(
        volume, look, profile=_PROFILE, render=f'technique = "{technique}"\nstep_voxels = 0.5', more=ALONE
    )


_PROFILE = "gles3"


def _views(bench: Bench, package: Package) -> list[View]:
    grid = package.manifest.levels[0].grid
    cameras = _CAMERAS[-1:] if bench.quick else _CAMERAS
    zooms = _ZOOMS[:1] if bench.quick else _ZOOMS
    # The field's height is that of the volume's width on a screen that is higher than wide.
    shape_hw = QUICK_HW if bench.quick else _SHAPE_HW
    higher = shape_hw[0] / shape_hw[1]
    found = []
    for zoom in zooms:
        for name in cameras:
            camera = standard_views(grid)[name]
            found.append(View(replace(camera, height_mm=camera.height_mm * higher / zoom), shape_hw))
    return found


def _progress(  # noqa: PLR0917 - who draws what, and how
    bench: Bench, renderer: Renderer, order: Order, package: Package, volume: Volume, view: View
) -> _Progress:
    camera = view.camera.box_from_clip(renderer.level.grid, view.aspect)
    step_mm = 0.5 * min(renderer.level.grid.spacing_mm_zyx)
    # The driver compiles the shaders for the first picture.
    [*_shown(renderer, order, camera, view.small_hw, step_mm)]
    read_ms = _read_ms(renderer, camera, view)
    times, pictures = [], []
    wall, cpu = time.perf_counter(), time.process_time()
    for picture in _shown(renderer, order, camera, view.shape_hw, step_mm):
        wall_ms, cpu_ms = (time.perf_counter() - wall) * 1000, (time.process_time() - cpu) * 1000
        times.append(max(honest_ms(renderer.driver.renderer, wall_ms, cpu_ms) - read_ms, 0.01))
        pictures.append(picture)
        wall, cpu = time.perf_counter(), time.process_time()
    *_, last = _shown(renderer, order, camera, view.small_hw, step_mm)
    return _Progress(tuple(times), tuple(pictures), rmse(last, bench.truth(package, volume, view)))


def _shown(
    renderer: Renderer, order: Order, camera: Float64Array, shape_hw: tuple[int, int], step_mm: float
) -> Iterator[Float32Array]:
    """Give the picture after each frame, without the small one that comes first."""
    if order in _AT_ONCE:
        yield from renderer.progress(camera, shape_hw, step_mm)
        return
    shown = frames(renderer, order, camera, shape_hw, step_mm)
    next(shown)
    yield from (frame.picture for frame in shown)


def _read_ms(renderer: Renderer, camera: Float64Array, view: View) -> float:
    """Return how long reading a picture back takes: drawing and reading, less drawing."""
    long_step = 0.2 * math.hypot(*renderer.level.grid.extent_mm_zyx)
    renderer.render(camera, view.shape_hw, long_step)
    cpu, wall = time.process_time(), time.perf_counter()
    renderer.render(camera, view.shape_hw, long_step)
    both = honest_ms(renderer.driver.renderer, (time.perf_counter() - wall) * 1000, (time.process_time() - cpu) * 1000)
    cpu = time.process_time()
    wall_ms = renderer.time_ms(camera, view.shape_hw, long_step, repeats=1)
    return both - honest_ms(renderer.driver.renderer, wall_ms, (time.process_time() - cpu) * 1000)


_Found = dict[tuple[str, Order], list[_Progress]]


def _table1(found: _Found, names: list[str], orders: list[Order]) -> PaperTable:
    rows: list[tuple[Cell, ...]] = []
    for name in names:
        for order in orders:
            rates = [1000 / ms for run in found[name, order] for ms in run.frames_ms]
            average = len(rates) / sum(1 / rate for rate in rates)
            rows.append((name, _PUBLISHED[order], min(rates), max(rates), average))
    return PaperTable(
        "Table 1: frames in a second while a picture is made",
        ("scan", "method", "min", "max", "avg"),
        tuple(rows),
        "Half of the paper's pixels along each axis, two views, two zooms. Errors of the whole pictures stand below.",
    )


def _figure7(found: _Found, names: list[str], orders: list[Order]) -> PaperTable:
    rows: list[tuple[Cell, ...]] = []
    for order in orders:
        row: list[Cell] = [_PUBLISHED[order]]
        for name in names:
            runs = found[name, order]
            seconds = float(np.mean([sum(run.frames_ms) for run in runs])) / 1000
            error = math.sqrt(float(np.mean([run.rmse**2 for run in runs])))
            row.append(f"{seconds:.3f} s, {error:.4f}, {np.mean([len(run.frames_ms) for run in runs]):.0f} frames")
        rows.append(tuple(row))
    return PaperTable(
        "Figure 7: seconds until a picture is complete, its RMSE and its frames, means over views and zooms",
        ("method", *names),
        tuple(rows),
    )


def _figure8(found: _Found, names: list[str], orders: list[Order]) -> PaperCurves:
    order: Order = "tiles" if "tiles" in orders else orders[-1]
    lines = []
    for name in names[:2]:
        runs = found[name, order]
        for zoom in range(max(1, len(runs) // len(_CAMERAS))):
            times = runs[min(len(runs) - 1, (zoom + 1) * len(_CAMERAS) - 1)].frames_ms
            points = tuple((float(frame), float(at)) for frame, at in enumerate(np.cumsum(times) / 1000, 1))
            lines.append(Line(f"{name.partition(',')[0]}, zoom {zoom}", ((0.0, 0.0), *points)))
    return PaperCurves(
        f"Figure 8: accumulated time over frames, {_PUBLISHED[order]}",
        "frame",
        "seconds",
        tuple(lines),
        "Frames have a budget of 0.1 s by the clock on the wall; the paper draws as many tiles in each frame here.",
    )


def _dssim(bench: Bench, found: _Found, volume: Volume, orders: list[Order]) -> PaperCurves:
    lines = []
    for order in orders:
        package = _package(bench, volume, order)
        view = _views(bench, package)[-1]
        run = found[volume.name, order][-1]
        with bench.renderer(package) as renderer:
            camera = view.camera.box_from_clip(renderer.level.grid, view.aspect)
            step_mm = 0.5 * min(renderer.level.grid.spacing_mm_zyx)
            low = low_resolution(renderer, camera, view.shape_hw, step_mm)
        times = [0.0, *(np.cumsum(run.frames_ms) / 1000).tolist()]
        values = [_structural(frame, run.pictures[-1]) for frame in (low, *run.pictures)]
        lines.append(Line(_PUBLISHED[order], tuple(zip(times, values, strict=True))))
    return PaperCurves(
        f"Figure 12: DSSIM against the final picture over time, {volume.name} voxels",
        "seconds",
        "DSSIM",
        tuple(lines),
        "All begin with the small picture, of a quarter of the pixels along each axis. Behind a slab nothing is "
        "drawn, "
        "where the paper draws what is left at low resolution.",
    )


_Sizes = dict[tuple[str, int], _Progress]


def _sizes(bench: Bench, volumes: list[Volume]) -> _Sizes:
    """Finish a picture of each scan by tiles of each size."""
    found: _Sizes = {}
    for volume in volumes:
        package = _package(bench, volume, "tiles")
        view = _views(bench, package)[-1]
        for size in _QUICK_SIZES if bench.quick else _TILE_SIZES:
            with bench.renderer(_of_size(package, size)) as renderer:
                found[volume.name, size] = _progress(bench, renderer, "tiles", package, volume, view)
    return found


def _of_size(package: Package, size: int) -> Package:
    program = package.manifest.programs[0]
    assert program.tiles is not None
    tiles = program.tiles.model_copy(update={"size": size})
    text = package.read_text(tiles.cost)
    declared = f"TILE = {program.tiles.size:.1f};"
    assert declared in text
    texts = {tiles.cost: text.replace(declared, f"TILE = {size:.1f};")}
    return Altered(package, texts, program.model_copy(update={"tiles": tiles}))


def _changes(run: _Progress) -> list[float]:
    """Return the DSSIM of each frame from the next; of a picture in one frame, that of the frame from itself."""
    return [_structural(one, other) for one, other in pairwise(run.pictures)] or [0.0]


def _by_size(sizes: _Sizes, names: list[str]) -> Iterator[PaperTable]:
    tried = sorted({size for _, size in sizes})
    if not tried:
        return
    seconds: list[tuple[Cell, ...]] = [
        (f"{size}×{size}", *(sum(sizes[name, size].frames_ms) / 1000 for name in names)) for size in tried
    ]
    yield PaperTable(
        "Figure 9: seconds until a picture is complete, by size of tiles",
        ("pixels of a tile", *names),
        tuple(seconds),
        "The paper begins with tiles of one pixel: here each is a draw of its own, 230 400 for a picture.",
    )
    rows: list[tuple[Cell, ...]] = []
    for size in tried:
        found = [value for name in names for value in _changes(sizes[name, size])]
        rows.append((f"{size}×{size}", float(np.mean(found)), float(np.std(found))))
    yield PaperTable(
        "Figure 10: DSSIM of a frame from the next, by size of tiles",
        ("pixels of a tile", "mean", "standard deviation"),
        tuple(rows),
    )


def _over_time(sizes: _Sizes, name: str) -> Iterator[PaperCurves]:
    lines = []
    for (scan_name, size), run in sizes.items():
        if scan_name == name:
            times = np.cumsum(run.frames_ms)[-len(_changes(run)) :] / 1000
            lines.append(Line(f"{size}×{size}", tuple(zip(times.tolist(), _changes(run), strict=True))))
    if lines:
        yield PaperCurves(
            f"Figure 13: DSSIM of each frame from the one before it, by size of tiles, {name} voxels",
            "seconds",
            "DSSIM",
            tuple(lines),
        )


def _about_sizes(sizes: _Sizes, names: list[str]) -> str:
    if not sizes:
        return ""
    tried = sorted({size for _, size in sizes})

    def seconds(size: int) -> float:
        return float(np.mean([sum(sizes[name, size].frames_ms) for name in names])) / 1000

    def change(size: int) -> float:
        return float(np.mean([value for name in names for value in _changes(sizes[name, size])]))

    least, most = tried[0], tried[-1]
    return (
        f" Tiles of {most}² pixels finish a picture in {seconds(most):.2f} seconds, of 8² in {seconds(8):.2f}, of "
        f"{least}² in {seconds(least):.2f}; in the paper larger tiles are faster. A frame differs from the next by "
        f"{change(most):.4f} with the largest tiles, by {change(8):.4f} with those of 8²."
    )


def _structural(picture: Float32Array, final: Float32Array) -> float:
    return (1 - picture_error(picture, final).ssim_black) / 2


def _finding(found: _Found, names: list[str], orders: list[Order], dssim: PaperCurves) -> str:
    def total(order: Order) -> float:
        return float(np.mean([sum(run.frames_ms) for name in names for run in found[name, order]]))

    def longest(order: Order) -> float:
        return max(ms for name in names for run in found[name, order] for ms in run.frames_ms)

    progressive = [each for each in orders if each != _CLASSIC]
    slower = ", ".join(f"{_PUBLISHED[each]} {total(each) / total(_CLASSIC):.1f} times" for each in progressive)
    worst = ", ".join(f"{_PUBLISHED[each]} {longest(each):.0f}" for each in progressive)
    quickest = min(progressive, key=total)
    early = []
    for line in dssim.lines:
        limit = line.points[0][1] / 10
        at = next((seconds for seconds, value in line.points[1:] if value <= limit), line.points[-1][0])
        early.append(f"{line.label} after {at:.3f} s")
    tiles = (
        "That tiles are the fastest progressive form holds here, too."
        if quickest == "tiles"
        else f"The paper has tiles as the fastest; here it is {_PUBLISHED[quickest]}: each tile is a draw of its own, "
        "which costs a software driver as much as many samples, and it has no texture cache that tiles would use "
        "better."
    )
    return (
        "The paper finds that progressive forms take longer in all than classic ray casting and answer sooner. "
        "In all they "
        f"take, as against the classic form here: {slower}. The longest frame of the classic form takes "
        f"{longest(_CLASSIC):.0f} milliseconds, that of the others: {worst}. {tiles} Slabs lose early ray "
        "termination from "
        "slab to slab, and look at no skip table. A tenth of the first DSSIM is reached by: "
        f"{'; '.join(early)}. The errors of the whole pictures are those of ray casting: no order changes what a "
        "pixel "
        "shows in the end, but slabs round it to 8 bits once for each slab."
    )
