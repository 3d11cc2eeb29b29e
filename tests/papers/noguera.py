"""Noguera, Jiménez, Ogáyar and Segura 2012: ray casting and slices across the view, both through a mosaic."""

import math

from volprep.techniques import TECHNIQUES
from volprep.truth.camera import standard_views
from volprep_formats.package.program import TechniqueName

from .bench import ALONE, Bench, View, techniques_of
from .record import Cell, Measured, Paper, PaperTable
from .volumes import Volume, scan

STEPS = (10, 20, 40, 80)
RESOLUTIONS = ((320, 480), (768, 1024))
_RAYS: TechniqueName = "ray-casting"
_SLICES: TechniqueName = "view-slices-as-published"


def measure(bench: Bench) -> Paper:
    """Measure tables 1 and 2, then the same for every other technique that reads mosaics."""
    resolutions = RESOLUTIONS[:1] if bench.quick else RESOLUTIONS
    volumes = {1: scan("MR head").reduced(3), 2: scan("engine").reduced(2)}
    if bench.quick:
        volumes = {1: volumes[1]}
    others = [name for name in techniques_of("mosaic") if name not in {_RAYS, _SLICES}]
    parts, cells = [], {}
    for number, volume in volumes.items():
        for technique in (_RAYS, _SLICES, *others):
            cells |= _cells(bench, volume, technique, resolutions)
        rows: list[tuple[Cell, ...]] = [
            (
                f"{shape_hw[1]}×{shape_hw[0]}",
                *(cells[volume.name, technique, shape_hw, n] for technique in (_RAYS, _SLICES) for n in STEPS),
            )
            for shape_hw in resolutions
        ]
        parts.append(
            PaperTable(
                f"Table {number}: {volume.name} voxels, by resolution and number of steps or slices",
                ("resolution", *(f"rays, {n}" for n in STEPS), *(f"slices, {n}" for n in STEPS)),
                tuple(rows),
                "Slices with the opacity and the blending that the paper prints. Steps and slices are equal parts of "
                "the diagonal of the volume.",
            )
        )
        parts.append(
            PaperTable(
                f"Beside table {number}: the other techniques that read a mosaic",
                ("resolution, technique", *map(str, STEPS)),
                tuple(
                    (
                        f"{shape_hw[1]}×{shape_hw[0]}, {TECHNIQUES[technique].text}",
                        *(cells[volume.name, technique, shape_hw, n] for n in STEPS),
                    )
                    for shape_hw in resolutions
                    for technique in others
                ),
            )
        )
    return Paper(
        "noguera",
        "Volume rendering strategies on mobile devices",
        "Noguera, Jiménez, Ogáyar and Segura 2012",
        tuple(parts),
        _finding(cells, volumes[1], resolutions[0], software=bench.software),
        ("Rows for an iPad 2 and an iPod: there is one device here. `volprep view` measures phones.",),
    )


_Cells = dict[tuple[str, TechniqueName, tuple[int, int], int], Measured]


def _cells(bench: Bench, volume: Volume, technique: TechniqueName, resolutions: tuple[tuple[int, int], ...]) -> _Cells:
    found: _Cells = {}
    render = f'technique = "{technique}"\nstep_voxels = 1.0'
    package = bench.package(
        volume, _look(volume), profile="gles2-4096", render=render, more=ALONE + '[skip]\nkind = "none"\n'
    )
    grid = package.manifest.levels[0].grid
    with bench.renderer(package) as renderer:
        for shape_hw in resolutions:
            view = View(standard_views(grid)["anterior-left"], shape_hw)
            for steps in STEPS:
                step_mm = math.hypot(*grid.extent_mm_zyx) / steps
                found[volume.name, technique, shape_hw, steps] = bench.measured(
                    renderer, package, volume, view, step_mm
                )
    return found


def _look(volume: Volume) -> str:
    return "micro-ct" if volume.word == "engine" else "mr-head"


def _finding(cells: _Cells, volume: Volume, shape_hw: tuple[int, int], *, software: bool) -> str:
    rays, slices = ({n: cells[volume.name, technique, shape_hw, n] for n in STEPS} for technique in (_RAYS, _SLICES))
    right = {n: cells[volume.name, "view-slices", shape_hw, n] for n in STEPS}
    speed = sum(rays[n].ms / slices[n].ms for n in STEPS) / len(STEPS)
    faster = f"Slices are {speed:.2f} times as fast as rays" if speed > 1 else f"Rays are {1 / speed:.1f} times as fast"
    growth = rays[80].ms / rays[10].ms
    shape = (
        "close to proportional"
        if growth > 5
        else "less than proportional: a picture has a fixed part, and rays end early"
    )
    blending = (
        " The slices of the paper gain from blending hardware that works beside the shader; a driver without it reads "
        "and writes the picture for each slice."
        if software
        else ""
    )
    why = (
        "The factor of two is found."
        if speed > 1.6
        else f"The factor of two of the paper is not found.{blending} No slice knows that a pixel is opaque already."
    )
    return (
        "The paper finds that time grows with pixels times steps, and that slices are about twice as fast as rays. "
        f"From 10 to 80 steps rays take {growth:.1f} times as long here, {shape}. {faster} here, on the average of "
        f"the four columns. {why} The paper says that rays give the better picture. That holds, and numbers say why: "
        f"with 80 steps rays are off by {rays[80].rmse:.4f} and slices as printed by {slices[80].rmse:.4f}, because "
        "their opacities are added and grow linearly with the distance of slices. Slices with exponential opacity and "
        f"the blending that belongs to it are off by {right[80].rmse:.4f}: it is not slicing that is worse."
    )
