"""Díaz-García, Brunet, Navazo and Vázquez 2018: progressive ray casting (table 1, figures 4, 6, 7 to 17).

Every order in which volprep.render.progressive finishes a picture is measured; a new one appears by itself.
"""

import math
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import get_args

import numpy as np

from volprep.render.progressive import Order, ShownFrame
from volprep.techniques import TECHNIQUES
from volprep.truth.camera import Camera, standard_views, view_from
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.program import TechniqueName
from volprep_formats.package.reader import Package

from .bench import Bench, View
from .lines import Line
from .panels import panels
from .progress import (
    BUDGET_S,
    FRAMES,
    Opened,
    Progress,
    budget_s_of,
    dssim,
    finishing,
    opened,
    progress,
    seconds_of_equal_frames,
    wake_for,
)
from .record import Cell, Paper, PaperCurves, PaperPicture, PaperPictures, PaperTable
from .tile_sizes import Sized, about_sizes, by_sizes, size_parts
from .volumes import Volume, scan

_CLASSIC: Order = "classic"
_SHAPE_HW, QUICK_HW = (640, 360), (256, 144)
_ZOOMS = (1.0, 1.7)
_LEVELS = '[pyramid]\ncoarsest_longest_axis = 32\nfilter = "box"\n'
"""The coarse ones are the low resolution."""
_CAMERAS = ("superior", "anterior-left")
_TRANSITION = 3
"""A picture's frames are shown at the ends of so many parts."""
_SOFTWARE_SHARE = 2
"""So many times fewer pixels along each axis in the pictures of means."""
_SIZES_SHARE = 2
"""So many times fewer pixels along each axis for the tiles in several sizes: single pixels are many frames."""
_PUBLISHED: dict[Order, str] = {
    "classic": "Classic RC",
    "slabs": "FBSlabs",
    "tiles": "STiles",
    "random": "Simple random",
    "structured": "Simple structured",
}
_Found = dict[tuple[str, Order], list[Progress]]
"""The pictures of each scan in each order, one for each view of means."""


def measure(bench: Bench) -> Paper:
    """Measure every order on three scans."""
    volumes = (
        [scan("MR head").reduced(3)] if bench.quick else [scan("MR head").reduced(2), scan("ch2 head"), scan("engine")]
    )
    orders = get_args(Order)
    found: _Found = {}
    for volume in volumes:
        found |= _runs(bench, volume, orders)
    names = [volume.name for volume in volumes]
    more = [] if bench.quick else [scan("shell")]
    changed = [*volumes, *more]
    changes = [_change(bench, volume, orders) for volume in changed]
    sizes = [each for volume in volumes for each in _sizes(bench, volume)]
    figure9, figure10, figure13 = size_parts(sizes, names, _sizes_hw(bench))
    return Paper(
        "diaz-garcia",
        "Progressive ray casting for volumetric models on mobile devices",
        "Díaz-García, Brunet, Navazo and Vázquez 2018",
        (
            _table1(found, names, orders, _views_text(bench)),
            _figure7(found, names, orders, _views_text(bench)),
            _figure8(bench, volumes),
            figure9,
            figure10,
            changes[0].figure11,
            *(change.figure12 for change in changes),
            panels(
                "Figure 12 in one: DSSIM against the final picture over time, all orders",
                {volume.name: change.figure12 for volume, change in zip(changed, changes, strict=True)},
                "Seconds, and DSSIM on a scale that is logarithmic above 0.0001 and linear below.",
            ),
            figure13,
            *(change.transition for change in changes),
        ),
        _finding(found, names, orders, [change.figure12 for change in changes]) + about_sizes(sizes),
    )


def _runs(bench: Bench, volume: Volume, orders: tuple[Order, ...]) -> _Found:
    """Measure all orders view by view, in turns, so that a driver that gets slower or faster favours none."""
    with ExitStack() as stack:
        shown = {
            order: stack.enter_context(opened(stack.enter_context(bench.renderer(_package(bench, volume, order)))))
            for order in orders
        }
        package = shown["tiles"].renderer.package
        runs = []
        for view in _mean_views(bench, package):
            truth = bench.truth(package, volume, view)
            runs.append(bench.remembered(f"runs {volume.name} {view}", partial(_in_turns, shown, view, truth)))
    return {(volume.name, order): [run[order] for run in runs] for order in orders}


def _in_turns(shown: dict[Order, Opened], view: View, truth: Float64Array) -> dict[Order, Progress]:
    budget_s = budget_s_of(shown["tiles"], view)
    return {order: progress(each, order, view, budget_s, truth) for order, each in shown.items()}


def _sizes(bench: Bench, volume: Volume) -> Iterator[Sized]:
    package = _package(bench, volume, "tiles")
    view = replace(_views(bench, package)[-1], shape_hw=_sizes_hw(bench))
    yield from by_sizes(bench, volume, package, view)


def _sizes_hw(bench: Bench) -> tuple[int, int]:
    height, width = QUICK_HW if bench.quick else _SHAPE_HW
    return height // _SIZES_SHARE, width // _SIZES_SHARE


def _package(bench: Bench, volume: Volume, order: Order) -> Package:
    technique: TechniqueName = order if order in TECHNIQUES else "ray-casting"
    look = "micro-ct" if volume.word in {"engine", "shell"} else "mr-head"
    return bench.package(volume, look, render=f'technique = "{technique}"\nstep_voxels = 0.5', more=_LEVELS)


def _zooms(bench: Bench) -> tuple[float, ...]:
    return _ZOOMS[:1] if bench.quick else _ZOOMS


def _cameras(bench: Bench) -> tuple[str, ...]:
    return _CAMERAS[-1:] if bench.quick else _CAMERAS


def _views(bench: Bench, package: Package) -> list[View]:
    """Return the views of pictures: few, in each zoom."""
    grid = package.manifest.levels[0].grid
    return _zoomed(bench, [standard_views(grid)[name] for name in _cameras(bench)], _shape_hw(bench))


def _mean_views(bench: Bench, package: Package) -> list[View]:
    """Return the views of means: those of pictures, or so many around the volume, in each zoom."""
    if not bench.views:
        return _views(bench, package)
    return _zoomed(bench, [*cameras_around(package.manifest.levels[0].grid, bench.views)], _mean_hw(bench))


def _shape_hw(bench: Bench) -> tuple[int, int]:
    return QUICK_HW if bench.quick else _SHAPE_HW


def _mean_hw(bench: Bench) -> tuple[int, int]:
    """Return the pixels of the pictures of means: on a software driver fewer, so that there is time for many views."""
    height, width = _shape_hw(bench)
    share = _SOFTWARE_SHARE if bench.software and bench.views else 1
    return height // share, width // share


def _zoomed(bench: Bench, cameras: list[Camera], shape_hw: tuple[int, int]) -> list[View]:
    # The field's height is that of the volume's width on a screen that is higher than wide.
    higher = shape_hw[0] / shape_hw[1]
    return [
        View(replace(camera, height_mm=camera.height_mm * higher / zoom), shape_hw)
        for zoom in _zooms(bench)
        for camera in cameras
    ]


def cameras_around(grid: Grid, count: int) -> Iterator[Camera]:
    """Look from so many places spread evenly over a sphere around the volume: a lattice of the golden angle."""
    turn = math.pi * (3 - math.sqrt(5))
    z, y, x = grid.extent_mm_zyx
    middle = grid.corner_mm_xyz + np.array(grid.direction) @ (np.array([x, y, z]) / 2)
    for number in range(count):
        height = 1 - (2 * number + 1) / count
        across = math.sqrt(1 - height**2)
        way = np.array([across * math.cos(number * turn), across * math.sin(number * turn), height])
        eye = middle + way * math.hypot(x, y, z)
        yield view_from(grid, (float(eye[0]), float(eye[1]), float(eye[2])))


def _views_text(bench: Bench) -> str:
    """Say over how many pictures means are."""
    cameras, zooms = bench.views or len(_cameras(bench)), len(_zooms(bench))
    around = " spread evenly around the volume" if bench.views else ""
    height, width = _mean_hw(bench)
    return (
        f"{cameras} {'view' if cameras == 1 else 'views'}{around}, {zooms} {'zoom' if zooms == 1 else 'zooms'}, "
        f"{width}×{height} pixels, all methods of a view in turns; "
        "the paper takes 20 on a sphere for each of 3 zooms"
    )


def _table1(found: _Found, names: list[str], orders: tuple[Order, ...], views: str) -> PaperTable:
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
        f"{views}. A frame of tiles or single pixels has {BUDGET_S:g} s, "
        f"or less: 1/{FRAMES} of the time of all tiles. Errors of the whole pictures stand below.",
    )


def _figure7(found: _Found, names: list[str], orders: tuple[Order, ...], views: str) -> PaperTable:
    rows: list[tuple[Cell, ...]] = []
    for order in orders:
        row: list[Cell] = [_PUBLISHED[order]]
        for name in names:
            runs = found[name, order]
            seconds = float(np.mean([sum(run.frames_ms) for run in runs])) / 1000
            error = math.sqrt(float(np.mean([run.rmse**2 for run in runs])))
            row.append(f"{seconds:.3g} s, {error:.4f}, {np.mean([len(run.frames_ms) for run in runs]):.0f} frames")
        rows.append(tuple(row))
    return PaperTable(
        "Figure 7: seconds until a picture is complete, its RMSE and its frames, means over views and zooms",
        ("method", *names),
        tuple(rows),
        f"{views}.",
    )


def _figure8(bench: Bench, volumes: list[Volume]) -> PaperCurves:
    lines = []
    for volume in volumes[:2]:
        package = _package(bench, volume, "tiles")
        zooms, n_cameras = _zooms(bench), len(_cameras(bench))
        with bench.renderer(package) as renderer:
            for number, view in enumerate(_views(bench, package)[n_cameras - 1 :: n_cameras]):
                seconds = seconds_of_equal_frames(renderer, view)
                points = tuple((float(frame), at) for frame, at in enumerate([0.0, *seconds]))
                lines.append(Line(f"{volume.word}, zoom {zooms[number]:g}", points))
    return PaperCurves(
        "Figure 8: accumulated time over frames, as many tiles in each, those that cost least first",
        "frame",
        "seconds",
        tuple(lines),
    )


@dataclass(frozen=True)
class _Change:
    """How one scan's picture comes, in one view."""

    figure11: PaperPictures
    """A detail on the way."""
    figure12: PaperCurves
    """How far each frame is from the last one."""
    transition: PaperPictures
    """Frames of each order, from the first to the last."""


def _change(bench: Bench, volume: Volume, orders: tuple[Order, ...]) -> _Change:
    lines, shown, transition = [], {}, []
    package = _package(bench, volume, "tiles")
    view = _views(bench, package)[-1]
    with bench.renderer(package) as renderer, opened(renderer) as tiled:
        budget_s = budget_s_of(tiled, view)
    for order in orders:
        with bench.renderer(_package(bench, volume, order)) as renderer, opened(renderer) as each:
            [*finishing(each, order, View(view.camera, view.small_hw), math.inf)]
            wake_for(renderer, view)
            frames = [*finishing(each, order, view, budget_s)]
        final = frames[-1].picture
        times = np.cumsum([0.0, *(frame.ms for frame in frames[1:])]) / 1000
        values = [dssim(frame.picture, final) for frame in frames]
        lines.append(Line(_PUBLISHED[order], tuple(zip(times.tolist(), values, strict=True))))
        if order != _CLASSIC:
            transition += [*_transition(order, frames, times.tolist())]
        half = min(range(len(frames)), key=lambda number: abs(values[number] - values[0] / 2))
        shown[order] = frames[half].picture, values[half]
    rows, columns = _detail(shown["tiles"][0], final)
    pictures = [
        PaperPicture.of(f"{_PUBLISHED[order]}, DSSIM {value:.4f}", picture[rows, columns])
        for order, (picture, value) in shown.items()
        if order != _CLASSIC
    ]
    return _Change(
        PaperPictures(
            f"Figure 11: a detail on the way to the final picture, {volume.name} voxels",
            (*pictures, PaperPicture.of("Final picture", final[rows, columns])),
            "Of each order the frame that is nearest to half of the first DSSIM of figure 12.",
        ),
        PaperCurves(
            f"Figure 12: DSSIM against the final picture over time, {volume.name} voxels",
            "seconds",
            "DSSIM",
            tuple(lines),
            "All but the classic one begin with a coarse level in a quarter of the pixels along each axis, filtered. "
            "Behind a slab this level is drawn with steps four times as long, and counted in the time of the frame.",
        ),
        PaperPictures(
            f"Figures 4, 6 and 14 to 17: from the low resolution to the final picture, {volume.name} voxels",
            tuple(transition),
            "Of each order four frames, half as large along each axis as they were drawn.",
        ),
    )


def _transition(order: Order, shown: list[ShownFrame], times_s: list[float]) -> Iterator[PaperPicture]:
    """Give four frames of a picture, the first and the last one among them."""
    numbers = dict.fromkeys(round(third * (len(shown) - 1) / _TRANSITION) for third in range(_TRANSITION + 1))
    for number in numbers:
        picture = shown[number].picture
        height, width = (size // 2 * 2 for size in picture.shape[:2])
        small = picture[:height, :width].reshape(height // 2, 2, width // 2, 2, 4).mean(axis=(1, 3), dtype=np.float32)
        yield PaperPicture.of(f"{_PUBLISHED[order]}, {times_s[number]:.3g} s", small)


def _rises(figures12: list[PaperCurves], order: Order) -> str:
    """Say by how much a frame of this order is worse than the one before it, at most, over the scans."""
    lines = [line for figure in figures12 for line in figure.lines if line.label == _PUBLISHED[order]]
    values = [[value for _, value in line.points] for line in lines]
    worst = max(max((b - a for a, b in pairwise(each)), default=0.0) for each in values)
    return f"{_PUBLISHED[order]}: no frame" if worst <= 1e-5 else f"{_PUBLISHED[order]}: a frame by up to {worst:.4f}"


def _first_at_half(figures12: list[PaperCurves]) -> str:
    """Say which progressive order is the first at half of the first DSSIM, of each scan, and when the others are."""
    told = []
    for figure in figures12:
        times = {
            line.label: next(seconds for seconds, value in line.points if value <= line.points[0][1] / 2)
            for line in figure.lines
            if line.label != _PUBLISHED[_CLASSIC]
        }
        order = sorted(times, key=lambda label: times[label])
        others = ", ".join(f"{label} {times[label] / times[order[0]]:.1f} times" for label in order[1:])
        scan = figure.title.rpartition("over time, ")[2].removesuffix(" voxels")
        told.append(f"{scan}, {order[0]} after {times[order[0]]:.3g} s ({others} as late)")
    return "; ".join(told)


def _detail(picture: Float32Array, final: Float32Array) -> tuple[slice, slice]:
    """Return the square of a third of the width of which most nearly half is finished and shows something."""
    side = final.shape[1] // 3
    finished = (picture == final).all(axis=-1) & (final[..., 3] > 0)
    corners = [
        (row, column)
        for row in range(0, final.shape[0] - side + 1, max(1, side // 4))
        for column in range(0, final.shape[1] - side + 1, max(1, side // 4))
    ]
    row, column = min(corners, key=lambda at: abs(finished[at[0] :, at[1] :][:side, :side].mean() - 0.5))
    return slice(row, row + side), slice(column, column + side)


def _finding(found: _Found, names: list[str], orders: tuple[Order, ...], figures12: list[PaperCurves]) -> str:
    def total(order: Order) -> float:
        return float(np.mean([sum(run.frames_ms) for name in names for run in found[name, order]]))

    def longest(order: Order) -> float:
        return max(ms for name in names for run in found[name, order] for ms in run.frames_ms)

    progressive = [each for each in orders if each != _CLASSIC]
    slower = ", ".join(f"{_PUBLISHED[each]} {total(each) / total(_CLASSIC):.1f} times" for each in progressive)
    worst = ", ".join(f"{_PUBLISHED[each]} {longest(each):.3g}" for each in progressive)
    quickest = min(progressive, key=total)
    early = []
    for line in figures12[0].lines:
        limit = line.points[0][1] / 10
        at = next((seconds for seconds, value in line.points[1:] if value <= limit), line.points[-1][0])
        early.append(f"{line.label} after {at:.3g} s")
    tiles = (
        "That tiles are the fastest progressive form holds here, too."
        if quickest == "tiles"
        else f"The paper has tiles as the fastest; here it is {_PUBLISHED[quickest]}, and tiles take "
        f"{total('tiles') / total(quickest):.2f} times as long."
    )
    return (
        "The paper finds that progressive forms take longer in all than classic ray casting and answer sooner. In all "
        f"they take, as against the classic form here: {slower}. The longest frame of the classic form takes "
        f"{longest(_CLASSIC):.3g} milliseconds, that of the others: {worst}. {tiles} Slabs lose early ray termination "
        f"from slab to slab, and look at no skip table. A tenth of the first DSSIM is reached by: {'; '.join(early)}. "
        f"At equal DSSIM, half of the first one, the first progressive form is: {_first_at_half(figures12)}. "
        f"Farther from the last frame than the one before, by DSSIM, in figure 12 (scans: {len(figures12)}): "
        f"{'; '.join(_rises(figures12, each) for each in progressive)}. "
        "The errors of the whole pictures are those of ray casting: no order changes what a pixel shows in the end, "
        "but slabs round it to 8 bits once for each slab."
    )
