"""Every technique with every compositing that it has, on a head and on an engine, each with its error, in one picture.

contact-sheet.png has a row for each technique and a column for each compositing, then lights and shadows, pictures that
are not finished, and one with fewer pixels; contact-sheet.json has the numbers. What is published with an error of its
own is compared with that, too: with its twin in double precision.
"""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np

from tests.support.published import TWINS
from volprep.compositing import COMPOSITINGS
from volprep.render.hybrid import HybridWish, hybrid_picture
from volprep.render.progressive import Order, frames
from volprep.techniques import TECHNIQUES, Technique
from volprep.truth.camera import standard_views
from volprep.truth.picture import encoded
from volprep.truth.volume import Medium
from volprep.truth.volume import Volume as Field
from volprep.validation.subjects.same_field import part_of
from volprep_formats.arrays import Float32Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.program import CompositingName, TechniqueName

from .bench import ALONE, Bench, View, rmse
from .volumes import Volume, scan

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PIXELS = 128
_VIEW = "anterior-left"
_STEP_VOXELS = 0.25
_INCHES = 1.45
_GREY = """reference_mm = 1.0
points = [{ value = 0.0, colour = [0.0, 0.0, 0.0], opacity = 0.0 },
    { value = 1.0, colour = [1.0, 1.0, 1.0], opacity = 1.0 }]"""
_SURFACE = """reference_mm = 1.0
isovalue = {at}
points = [{{ value = 0.0, colour = "#c08a6a", opacity = 1.0 }}, {{ value = 1.0, colour = "#fff0d8", opacity = 1.0 }}]"""
_RANGE = 'values = "range"\n'


_LIGHTS, _PARTS = "lights", "parts"
"""Rows beside those of techniques."""
_N_LIGHTS = 6


@dataclass(frozen=True)
class Tile:
    """One picture of the sheet."""

    scan: str
    """Scan and size."""
    technique: TechniqueName
    """Technique."""
    compositing: CompositingName
    """Compositing."""
    rmse: float | None
    """Error against the oracle of the compositing; None where it cannot be drawn."""
    twin_rmse: float | None
    """Error against the twin of the technique, where it has one."""
    refused: str | None = None
    """Why there is no picture."""
    beside: str | None = None
    """What else is shown, where it is not the technique: a light, or a picture that is not finished."""


def write_contact_sheet(bench: Bench, folder: Path) -> Path:
    """Draw everything, write the picture and its numbers, and return the picture's path."""
    head, engine = scan("MR head").reduced(2), scan("engine").reduced(2 if bench.quick else 1)
    subjects = {"head": head} if bench.quick else {"head": head, "engine": engine}
    drawn: list[tuple[Tile, Float32Array | None]] = []
    for which, volume in subjects.items():
        for technique in TECHNIQUES.values():
            drawn += [
                _tile(bench, which, volume, technique, compositing)
                for compositing in COMPOSITINGS
                if compositing in technique.compositings
            ]
        drawn += [*_beside(bench, which, scan("MR head").reduced(3) if which == "head" else scan("engine").reduced(2))]
    path = folder / "contact-sheet.png"
    _write_picture(path, drawn)
    data = {"driver": bench.driver, "pixels": _PIXELS, "tiles": [asdict(tile) for tile, _ in drawn]}
    path.with_suffix(".json").write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    return path


def _tile(
    bench: Bench, which: str, volume: Volume, technique: Technique, compositing: CompositingName
) -> tuple[Tile, Float32Array | None]:
    # Around a body there is air: the least value of every ray from outside is that of air.
    shown = volume.middle(min(volume.stored.shape) // 2) if compositing == "minimum" else volume
    step = technique.step_voxels or _STEP_VOXELS
    render = f'technique = "{technique.name}"\ncompositing = "{compositing}"\nstep_voxels = {step}\n'
    if COMPOSITINGS[compositing].isovalue and COMPOSITINGS[compositing].lit:
        render += 'lighting = "headlight"\n'
    try:
        package = bench.package(shown, _look(which, compositing), render=render, more=ALONE)
        level = package.manifest.levels[0]
        camera_of = standard_views(level.grid)[_VIEW]
        # The field holds the volume from all sides; in this view some of it stays empty.
        view = View(replace(camera_of, height_mm=0.85 * camera_of.height_mm), (_PIXELS, _PIXELS))
        with bench.renderer(package) as renderer:
            camera = view.camera.box_from_clip(level.grid, 1.0)
            picture = renderer.render(camera, view.shape_hw)
    except VolprepError as error:
        return Tile(shown.name, technique.name, compositing, None, None, str(error)), None
    truth = bench.truth(package, shown, view)
    twin_rmse = None
    if technique.name in TWINS and compositing == "emission-absorption" and package.manifest.render is not None:
        # The volume of the package may be cropped: its cube of slices is that of its own box.
        twin = TWINS[technique.name](
            Medium(_cropped(shown, level.grid), package.manifest.transfer_functions[0]),
            camera,
            view.shape_hw,
            package.manifest.step_mm,
        )
        twin_rmse = rmse(picture, twin)
    return Tile(shown.name, technique.name, compositing, rmse(picture, truth), twin_rmse), picture


def _beside(bench: Bench, which: str, volume: Volume) -> Iterator[tuple[Tile, Float32Array | None]]:
    """Draw lights and shadows, then what is shown until a picture is finished."""
    grid = volume.info.grid
    middle = grid.corner_mm_xyz + np.array(grid.direction) @ (np.array(grid.extent_mm_zyx[::-1]) / 2)
    place = middle + np.array([-0.9, -0.8, 1.0]) * max(grid.extent_mm_zyx)
    light = f'[lighting]\nlight_mm = [{", ".join(f"{each:.1f}" for each in place)}]\nnormals = "central"\n'
    lights: dict[str, tuple[TechniqueName, CompositingName, str, str]] = {
        "headlight": ("ray-casting", "emission-absorption", "headlight", ""),
        "Phong": ("ray-casting", "emission-absorption", "phong", light),
        "Blinn-Phong": ("ray-casting", "emission-absorption", "blinn-phong", light),
        # A ray to the light from each sample: slab by slab, or the loops take more turns than a driver makes.
        "shadow rays": ("slabs", "emission-absorption", "phong", f'{light}shadows = "rays"\n'),
        "shadow map": ("ray-casting", "isosurface", "phong", f'{light}shadows = "map"\n'),
        "half-angle slices": ("view-slices", "emission-absorption", "phong", f'{light}shadows = "half-angle"\n'),
    }
    for name, (technique, compositing, lighting, more) in lights.items():
        render = f'technique = "{technique}"\ncompositing = "{compositing}"\nlighting = "{lighting}"\n'
        render += f"step_voxels = {TECHNIQUES[technique].step_voxels or (0.5 if 'shadows' in more else _STEP_VOXELS)}\n"
        package = bench.package(volume, _look(which, compositing), render=render, more=ALONE + more)
        # The truth of shadows takes time with the square of the samples.
        size = _PIXELS if "shadows" not in more else _PIXELS // 2
        view = View(standard_views(package.manifest.levels[0].grid)[_VIEW], (size, size))
        with bench.renderer(package) as renderer:
            picture = renderer.render(view.camera.box_from_clip(renderer.level.grid, 1.0), view.shape_hw)
        error = rmse(picture, bench.truth(package, volume, view))
        yield Tile(volume.name, technique, compositing, error, None, beside=name), picture
    for order in get_args(Order)[1:]:
        yield _unfinished(bench, which, volume, order)
    yield _hybrid(bench, which, volume)


def _unfinished(bench: Bench, which: str, volume: Volume, order: Order) -> tuple[Tile, Float32Array]:
    technique: TechniqueName = order if order in TECHNIQUES else "ray-casting"
    render = f'technique = "{technique}"\nstep_voxels = {_STEP_VOXELS}\n'
    package = bench.package(volume, _look(which, "emission-absorption"), render=render, more=ALONE)
    level = package.manifest.levels[0]
    camera = standard_views(level.grid)[_VIEW].box_from_clip(level.grid, 1.0)
    step_mm = _STEP_VOXELS * min(level.grid.spacing_mm_zyx)
    with bench.renderer(package) as renderer:
        # Without a budget each part is a frame.
        shown = [*frames(renderer, order, camera, (_PIXELS, _PIXELS), step_mm, budget_s=0.0)]
    half = min(shown, key=lambda each: abs(each.finished - 0.5))
    error = rmse(half.picture, shown[-1].picture.astype(np.float64))
    return Tile(volume.name, technique, "emission-absorption", error, None, beside=f"{order}, half"), half.picture


def _hybrid(bench: Bench, which: str, volume: Volume) -> tuple[Tile, Float32Array]:
    small = f"[hybrid]\nlongest_side = {_PIXELS // 4}\n"
    package = bench.package(volume, _look(which, "emission-absorption"), more=ALONE + small)
    level, shape_hw = package.manifest.levels[0], (_PIXELS, _PIXELS)
    camera = standard_views(level.grid)[_VIEW].box_from_clip(level.grid, 1.0)
    assert package.manifest.render is not None
    assert package.manifest.render.hybrid is not None
    wish = HybridWish.of_package(package.manifest.render.hybrid, shape_hw)
    with bench.renderer(package) as renderer:
        whole = hybrid_picture(renderer, HybridWish(), camera, shape_hw)
        picture = hybrid_picture(renderer, wish, camera, shape_hw)
    error = rmse(picture, whole.astype(np.float64))
    return Tile(volume.name, "ray-casting", "emission-absorption", error, None, beside="hybrid"), picture


def _cropped(volume: Volume, grid: Grid) -> Field:
    part = volume.stored[part_of(volume.info.grid, grid)]
    return Field(np.ascontiguousarray(part), grid, volume.info.slope, volume.info.intercept)


def _look(which: str, compositing: CompositingName) -> str:
    record = COMPOSITINGS[compositing]
    if record.isovalue:
        return _RANGE + _SURFACE.format(at=0.12 if which == "head" else 0.4)
    if record.fixed_path or compositing == "average":
        return _RANGE + _GREY
    return "mr-head" if which == "head" else "micro-ct"


def _write_picture(path: Path, drawn: list[tuple[Tile, Float32Array | None]]) -> None:
    from matplotlib.figure import Figure

    scans = list(dict.fromkeys(tile.scan.partition(",")[0] for tile, _ in drawn))
    techniques, compositings = list(TECHNIQUES), list(COMPOSITINGS)
    rows = [(name, row) for name in scans for row in (*techniques, _LIGHTS, _PARTS)]
    figure = Figure(figsize=(_INCHES * (len(compositings) + 1), 1.18 * _INCHES * len(rows)), dpi=110)
    figure.patch.set_facecolor("white")
    axes = figure.subplots(len(rows), len(compositings), squeeze=False)
    for row, (name, technique) in enumerate(rows):
        axes[row, 0].set_ylabel(f"{name}\n{technique}", fontsize=6)
        for column, compositing in enumerate(compositings):
            _plain(axes[row, column])
            if row == 0:
                axes[row, column].text(
                    0.5, 1.2, compositing, transform=axes[row, column].transAxes, ha="center", fontsize=7, weight="bold"
                )
    for tile, picture in drawn:
        name = tile.scan.partition(",")[0]
        row, column = rows.index((name, tile.technique)), compositings.index(tile.compositing)
        if tile.beside is not None:
            of_scan = [each.beside for each, _ in drawn if each.beside is not None and each.scan == tile.scan]
            number = of_scan.index(tile.beside)
            row, column = rows.index((name, _LIGHTS if number < _N_LIGHTS else _PARTS)), number % _N_LIGHTS
        place = axes[row, column]
        if picture is not None and tile.rmse is not None:
            place.imshow(encoded(picture, "black"), interpolation="nearest")
            twin = "" if tile.twin_rmse is None else f"; as published {tile.twin_rmse * 255:.2f}"
            beside = "" if tile.beside is None else f"{tile.beside}: "
            place.set_title(f"{beside}{tile.rmse * 255:.2f}{twin}", fontsize=6, pad=2)
        else:
            place.set_title((tile.refused or "")[:6], fontsize=6, pad=2)
    text = "RMSE against the oracle, in 255ths; of parts, against the whole picture"
    figure.text(0.5, 0.995, text, ha="center", va="top", fontsize=8)
    figure.tight_layout(rect=(0, 0, 1, 0.985))
    figure.savefig(path)


def _plain(axes: "Axes") -> None:
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)
