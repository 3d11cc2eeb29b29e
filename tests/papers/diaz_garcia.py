"""Díaz-García, Brunet, Navazo and Vázquez 2018: progressive ray casting (table 1, figures 7 to 13).

Every registered technique whose renderer gives more than one frame is progressive; a technique that is registered later
appears by itself. Plain ray casting is the classic form beside them.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tests.benchmarks.drawing_time import honest_ms
from volprep.render.renderer import Renderer
from volprep.report.plots import Line
from volprep.techniques import TECHNIQUES
from volprep.truth.camera import standard_views
from volprep.truth.metrics import picture_error
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.program import TechniqueName
from volprep_formats.package.reader import Package

from .bench import Bench, View, rmse, techniques_of
from .record import Cell, Paper, PaperCurves, PaperTable
from .volumes import Volume, scan

_CLASSIC: TechniqueName = "ray-casting"
_SHAPE_HW, _QUICK_HW = (1280, 720), (320, 180)
_ZOOMS = (1.0, 1.7)
_CAMERAS = ("anterior", "left", "superior", "anterior-left")
_LOW = 4
"""How many times fewer pixels along each axis the picture has that is shown first."""
_PUBLISHED = {"tiles": "STiles", "slabs": "FBSlabs", "random": "Simple random", "structured": "Simple structured"}
"""What the paper calls a technique whose name begins so."""


@dataclass(frozen=True)
class _Progress:
    """A picture that comes in frames."""

    frames_ms: tuple[float, ...]
    """Time of each frame, without reading it back."""
    rmse: float
    """Error of the last one."""


def measure(bench: Bench) -> Paper:
    """Measure what can be measured with the techniques that are registered."""
    volumes = [scan("MR head").reduced(3)] if bench.quick else [scan("MR head"), scan("ch2 head"), scan("engine")]
    found: dict[tuple[str, TechniqueName], list[_Progress]] = {}
    for volume in volumes:
        for technique in techniques_of("texture3d"):
            if TECHNIQUES[technique].loops:
                runs = [*_runs(bench, volume, technique)]
                if technique == _CLASSIC or any(len(run.frames_ms) > 1 for run in runs):
                    found[volume.name, technique] = runs
    techniques = [*dict.fromkeys(technique for _, technique in found)]
    names = [volume.name for volume in volumes]
    dssim = _dssim(bench, volumes[0], [each for each in techniques if each != _CLASSIC])
    return Paper(
        "diaz-garcia",
        "Progressive ray casting for volumetric models on mobile devices",
        "Díaz-García, Brunet, Navazo and Vázquez 2018",
        (
            _table1(found, names, techniques),
            _figure7(found, names, techniques),
            _figure8(found, names, techniques),
            dssim,
        ),
        _finding(found, names, techniques, dssim),
        tuple(_waiting(techniques)),
    )


def _waiting(techniques: list[TechniqueName]) -> Iterator[str]:
    for beginning, published in _PUBLISHED.items():
        if not any(each.startswith(beginning) for each in techniques):
            yield f"{published} in table 1 and figures 7 and 12 waits for a technique {beginning}."
    if not any(each.startswith("tiles") for each in techniques):
        yield "Figures 9, 10 and 13, about sizes of tiles, wait for a technique tiles."


def _runs(bench: Bench, volume: Volume, technique: TechniqueName) -> Iterator[_Progress]:
    package = _package(bench, volume, technique)
    with bench.renderer(package) as renderer:
        for view in _views(bench, package):
            yield _frames(bench, renderer, package, volume, view)


def _package(bench: Bench, volume: Volume, technique: TechniqueName) -> Package:
    coarsest = -(-max(volume.stored.shape) // _LOW)
    look = "micro-ct" if volume.word == "engine" else "mr-head"
    more = f'[pyramid]\ncoarsest_longest_axis = {coarsest}\nfilter = "box"\n'
    return bench.package(volume, look, render=f'technique = "{technique}"\nstep_voxels = 0.5', more=more)


def _views(bench: Bench, package: Package) -> list[View]:
    grid = package.manifest.levels[0].grid
    cameras = _CAMERAS[-1:] if bench.quick else _CAMERAS
    zooms = _ZOOMS[:1] if bench.quick else _ZOOMS
    # The field's height is that of the volume's width on a screen that is higher than wide.
    shape_hw = _QUICK_HW if bench.quick else _SHAPE_HW
    higher = shape_hw[0] / shape_hw[1]
    found = []
    for zoom in zooms:
        for name in cameras:
            camera = standard_views(grid)[name]
            found.append(View(replace(camera, height_mm=camera.height_mm * higher / zoom), shape_hw))
    return found


def _frames(bench: Bench, renderer: Renderer, package: Package, volume: Volume, view: View) -> _Progress:
    camera = view.camera.box_from_clip(renderer.level.grid, view.aspect)
    [*renderer.progress(camera, view.small_hw)]
    read_ms = _read_ms(renderer, camera, view)
    times = []
    wall, cpu = time.perf_counter(), time.process_time()
    for _ in renderer.progress(camera, view.shape_hw):
        took = honest_ms(
            renderer.driver.renderer, (time.perf_counter() - wall) * 1000, (time.process_time() - cpu) * 1000
        )
        times.append(max(took - read_ms, 0.01))
        wall, cpu = time.perf_counter(), time.process_time()
    *_, last = renderer.progress(camera, view.small_hw)
    return _Progress(tuple(times), rmse(last, bench.truth(package, volume, view)))


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


_Found = dict[tuple[str, TechniqueName], list[_Progress]]


def _name(technique: TechniqueName) -> str:
    if technique == _CLASSIC:
        return "classic"
    return next((name for start, name in _PUBLISHED.items() if technique.startswith(start)), technique)


def _table1(found: _Found, names: list[str], techniques: list[TechniqueName]) -> PaperTable:
    rows: list[tuple[Cell, ...]] = []
    for name in names:
        row: list[Cell] = [name]
        for technique in techniques:
            rates = [1000 / ms for run in found[name, technique] for ms in run.frames_ms]
            row += [min(rates), max(rates), len(rates) / sum(1 / rate for rate in rates)]
        rows.append(tuple(row))
    heads = [f"{_name(technique)}, {which}" for technique in techniques for which in ("min", "max", "avg")]
    return PaperTable(
        "Table 1: frames in a second while a picture is made",
        ("scan", *heads),
        tuple(rows),
        "Errors of the whole pictures stand below: frames on the way have none of their own.",
    )


def _figure7(found: _Found, names: list[str], techniques: list[TechniqueName]) -> PaperTable:
    rows: list[tuple[Cell, ...]] = []
    for name in names:
        row: list[Cell] = [name]
        for technique in techniques:
            runs = found[name, technique]
            seconds = float(np.mean([sum(run.frames_ms) for run in runs])) / 1000
            error = math.sqrt(float(np.mean([run.rmse**2 for run in runs])))
            row += [seconds, f"{error:.4f}", float(np.mean([len(run.frames_ms) for run in runs]))]
        rows.append(tuple(row))
    heads = [f"{_name(technique)}, {which}" for technique in techniques for which in ("seconds", "RMSE", "frames")]
    return PaperTable(
        "Figure 7: seconds until a picture is complete, mean over views and zooms", ("scan", *heads), tuple(rows)
    )


def _figure8(found: _Found, names: list[str], techniques: list[TechniqueName]) -> PaperCurves:
    lines = []
    for technique in techniques:
        if technique == _CLASSIC:
            continue
        for name in names[:2]:
            runs = found[name, technique]
            for zoom in range(max(1, len(runs) // len(_CAMERAS))):
                times = runs[min(len(runs) - 1, (zoom + 1) * len(_CAMERAS) - 1)].frames_ms
                sums = np.cumsum(times) / 1000
                points = tuple((float(frame), float(at)) for frame, at in enumerate(sums, 1))
                lines.append(Line(f"{_name(technique)}, {name.partition(',')[0]}, zoom {zoom}", ((0.0, 0.0), *points)))
    return PaperCurves(
        "Figure 8: accumulated time over frames", "frame", "seconds", tuple(lines), "The paper shows it for its tiles."
    )


def _dssim(bench: Bench, volume: Volume, techniques: list[TechniqueName]) -> PaperCurves:
    lines = []
    for technique in techniques:
        package = _package(bench, volume, technique)
        view = _views(bench, package)[-1]
        height, width = view.shape_hw
        view = View(view.camera, (height // 2, width // 2))
        low = _low_picture(bench, package, view)
        with bench.renderer(package) as renderer:
            camera = view.camera.box_from_clip(renderer.level.grid, view.aspect)
            pictures = [*renderer.progress(camera, view.shape_hw)]
            times = np.cumsum(_frames(bench, renderer, package, volume, view).frames_ms) / 1000
        shown = [low, *(picture + (1 - picture[..., 3:]) * low for picture in pictures[:-1]), pictures[-1]]
        for label, frames in ((", over the small picture", shown), (" alone", [np.zeros_like(low), *pictures])):
            values = [_structural(frame, pictures[-1]) for frame in frames]
            lines.append(Line(f"{_name(technique)}{label}", tuple(zip((0.0, *times.tolist()), values, strict=True))))
    return PaperCurves(
        f"Figure 12: DSSIM against the final picture over time, {volume.name} voxels",
        "seconds",
        "DSSIM",
        tuple(lines),
        "The small picture has a quarter of the pixels along each axis, of level 2. An app that draws what lies "
        "behind a "
        "slab at low resolution, as the paper does, comes between the two.",
    )


def _structural(picture: Float32Array, final: Float32Array) -> float:
    return (1 - picture_error(picture, final).ssim_black) / 2


def _low_picture(bench: Bench, package: Package, view: View) -> Float32Array:
    height, width = view.shape_hw
    level = max(each.index for each in package.manifest.levels)
    with bench.renderer(package, level) as renderer:
        camera = view.camera.box_from_clip(renderer.level.grid, view.aspect)
        small = renderer.render(camera, (height // _LOW, width // _LOW))
    large = np.kron(small, np.ones((_LOW, _LOW, 1), np.float32))
    picture = np.zeros((height, width, 4), np.float32)
    picture[: large.shape[0], : large.shape[1]] = large[:height, :width]
    return picture


def _finding(found: _Found, names: list[str], techniques: list[TechniqueName], dssim: PaperCurves) -> str:
    def total(technique: TechniqueName) -> float:
        return float(np.mean([sum(run.frames_ms) for name in names for run in found[name, technique]]))

    def longest(technique: TechniqueName) -> float:
        return max(ms for name in names for run in found[name, technique] for ms in run.frames_ms)

    progressive = [each for each in techniques if each != _CLASSIC]
    slower = ", ".join(f"{_name(each)} {total(each) / total(_CLASSIC):.1f} times" for each in progressive)
    worst = ", ".join(f"{_name(each)} {longest(each):.0f}" for each in progressive)
    early = []
    for line in dssim.lines:
        limit = line.points[0][1] / 10
        at = next((seconds for seconds, value in line.points if value <= limit), line.points[-1][0])
        early.append(f"{line.label} after {at / line.points[-1][0]:.0%} of the time")
    return (
        "The paper finds that progressive forms take longer in all than classic ray casting and answer sooner. "
        "In all they "
        f"take here, as against the classic form: {slower}. The longest frame of the classic form takes "
        f"{longest(_CLASSIC):.0f} "
        f"milliseconds, that of the progressive ones: {worst}. Slabs lose early ray termination from slab to "
        "slab and look "
        "at no skip table, which the paper's do at proxy geometry: that is what they take longer. The paper's "
        "slabs come near "
        f"to the final picture quickly and then change little. Here a tenth of the first DSSIM is reached by: "
        f"{'; '.join(early)}. Frames of one form are all about as long, since each takes as many samples of all "
        "rays; only "
        "tiles in the order of their cost have the bent curve of figure 8."
    )
