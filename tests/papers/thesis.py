"""The mobile volume rendering thesis: tables 3 to 6, and what figures 16 and 21 show.

Table 7 compares browsers with native programs: `volprep view` measures browsers.
"""

import math
import re
from dataclasses import replace

import numpy as np

from volprep.report.plots import Line
from volprep.techniques import TECHNIQUES
from volprep.truth.camera import standard_views
from volprep.validation.altered import Altered
from volprep_formats.package.program import TechniqueName
from volprep_formats.package.reader import Package

from .bench import ALONE, Bench, View, techniques_of
from .record import Cell, Measured, Paper, PaperCurves, PaperTable
from .savings import PLAIN, WAYS, Savings, savings
from .volumes import Volume, scan

_STEPS = 512
_QUALITY_STEPS = (64, 128, 256, 512)
_RAYS: TechniqueName = "ray-casting"
_SLICES: TechniqueName = "view-slices"
_VIEW = "anterior-left"
_PLAIN_RAYS = "opacity_cutoff = 1.0\n"
_NO_SKIP = '[skip]\nkind = "none"\n'
_VOLUME_FETCH = "textureLod(u_volume, at, 0.0).r"
_PICTURE = re.compile(r"^( *picture = )(.*);$", re.MULTILINE)
_SPHERE = "clamp(1.5 - 3.0 * length(at - 0.5), 0.0, 1.0)"
_CLASSIFICATIONS = {
    "preclassified": "full volume of colours",
    "palette": "palette of 60",
    "lookup": "texture",
    "control-points": "control points",
    "preintegrated": "pre-integrated",
}
_NORMALS = {
    "forward differences": 'normals = "forward"\n',
    "central differences": 'normals = "central"\n',
    "Sobel normals in a volume": 'normals = "volume"\n',
}


def measure(bench: Bench) -> Paper:
    """Measure all tables on this driver."""
    pixels = 256 if bench.quick else 512
    volume = scan("engine").reduced(2) if bench.quick else scan("engine")
    techniques = (_RAYS, _SLICES) if bench.quick else techniques_of("texture3d")
    table3 = _table3(bench, volume, pixels, techniques)
    table4 = _table4(bench, volume, pixels, techniques)
    table5 = _table5(bench, volume, pixels)
    scans = {scan("engine"): "micro-ct", scan("ch2 head"): "mr-head", scan("MR head"): "mr-head"}
    if not bench.quick:
        scans |= {scan("fly"): "micro-ct", scan("shell"): "micro-ct"}
    else:
        scans = {volume: "micro-ct"}
    saved = [savings(bench, each, look) for each, look in scans.items()]
    return Paper(
        "thesis",
        "Volume rendering on mobile devices",
        "Master's thesis, mobile volume rendering, 2015",
        (
            table3,
            table4,
            table5,
            _table6(saved),
            _figure16(saved),
            *_figure21(bench, volume, 128 if bench.quick else 256),
        ),
        _finding(table3, table4, table5, saved),
        ("Table 7, browsers against native programs: the page of `volprep view` measures a browser.",),
    )


def _table3(bench: Bench, volume: Volume, pixels: int, techniques: tuple[TechniqueName, ...]) -> PaperTable:
    rows: list[tuple[Cell, ...]] = []
    for technique in techniques:
        render = f'technique = "{technique}"\nstep_voxels = 0.5\n{_PLAIN_RAYS}'
        cells: list[Cell] = []
        for which in ("calculated", "small", "full"):
            drawn = volume.resized(16) if which == "small" else volume
            package = bench.package(drawn, "micro-ct", render=render, more=ALONE + _NO_SKIP)
            grid = package.manifest.levels[0].grid
            step_mm = math.hypot(*grid.extent_mm_zyx) / _STEPS
            view = View(standard_views(grid)[_VIEW], (pixels, pixels))
            shown = _calculated(package) if which == "calculated" else package
            with bench.renderer(shown) as renderer:
                found = bench.measured(renderer, package, drawn, view, step_mm)
            cells.append(replace(found, rmse=None) if which == "calculated" else found)
        rows.append((TECHNIQUES[technique].text, *cells))
    return PaperTable(
        f"Table 3: {_STEPS} steps through {volume.name} voxels, {pixels}² pixels",
        ("technique", "volume calculated", "small volume", "full volume"),
        tuple(rows),
        "Calculated: a sphere by arithmetic in place of the fetch. Small: 16³ voxels, as many samples. Rays and slices "
        "run to their end. The thesis has slices through 2D textures; here all read a 3D texture.",
    )


def _calculated(package: Package) -> Package:
    """Return the package whose shader computes a sphere instead of reading voxels."""
    program = package.manifest.programs[0]
    text = package.read_text(program.fragment)
    assert _VOLUME_FETCH in text
    # The texture stays in the sum, so that no uniform of the program becomes idle; it is read once for a pixel.
    text = text.replace(_VOLUME_FETCH, _SPHERE)
    text = _PICTURE.sub(r"\1\2 + 1e-9 * textureLod(u_volume, vec3(0.5), 0.0).r;", text)
    return Altered(package, program.fragment, text)


def _table4(bench: Bench, volume: Volume, pixels: int, techniques: tuple[TechniqueName, ...]) -> PaperTable:
    rows: list[tuple[Cell, ...]] = []
    for technique in techniques:
        cells: list[Cell] = []
        for name in _CLASSIFICATIONS:
            if name not in TECHNIQUES[technique].classifications:
                cells.append("not possible")
                continue
            render = f'technique = "{technique}"\nclassification = "{name}"\nstep_voxels = 0.5\n{_PLAIN_RAYS}'
            package = bench.package(volume, "micro-ct", render=render, more=ALONE + _NO_SKIP)
            grid = package.manifest.levels[0].grid
            view = View(standard_views(grid)[_VIEW], (pixels, pixels))
            with bench.renderer(package) as renderer:
                cells.append(bench.measured(renderer, package, volume, view))
        rows.append((TECHNIQUES[technique].text, *cells))
    return PaperTable(
        f"Table 4: how values become colours, {volume.name} voxels, {pixels}² pixels",
        ("technique", *_CLASSIFICATIONS.values()),
        tuple(rows),
        "Steps of half a voxel. The thesis has the first three columns.",
    )


def _table5(bench: Bench, volume: Volume, pixels: int) -> PaperTable:
    grid = volume.info.grid
    away = np.array([-0.8, -1.0, 0.9]) * math.hypot(*grid.extent_mm_zyx)
    middle = grid.corner_mm_xyz + np.array(grid.direction) @ (np.array(grid.extent_mm_zyx[::-1]) / 2)
    light = ", ".join(f"{each:.1f}" for each in middle + away)
    cells: list[Cell] = []
    for which, normals in {"no illumination": None, **_NORMALS}.items():
        render = f"step_voxels = 0.5\n{_PLAIN_RAYS}"
        more = ALONE + _NO_SKIP
        if normals is not None:
            render += 'lighting = "blinn-phong"\n'
            more += f"[lighting]\nlight_mm = [{light}]\n{normals}"
            more += '[normals]\nkernel = "sobel"\n' if "volume" in which else ""
        package = bench.package(volume, "micro-ct", render=render, more=more)
        view = View(standard_views(package.manifest.levels[0].grid)[_VIEW], (pixels, pixels))
        with bench.renderer(package) as renderer:
            cells.append(bench.measured(renderer, package, volume, view))
    return PaperTable(
        f"Table 5: where normals come from, Blinn-Phong, {volume.name} voxels, {pixels}² pixels",
        ("", "no illumination", *_NORMALS),
        (("ray casting", *cells),),
        "Each error is against a light on the same kind of gradient, unquantised. Only what is seen is lit.",
    )


def _table6(saved: list[Savings]) -> PaperTable:
    rows = tuple(
        (
            each.scan,
            *(found.drawn for found in each.found),
            f"{'takes it' if each.kept else 'leaves it out'}: {each.reason}",
        )
        for each in saved
    )
    return PaperTable(
        "Table 6: work that is left out, alone and together, lit from the viewer, 256² pixels, three views",
        ("scan", *(way.name for way in WAYS), "what the plan says of the skip table"),
        rows,
        "Samples are those of a pixel on the average. The thesis has light where seen, early exit and a table of 16³ "
        "blocks, one after the other.",
    )


def _figure16(saved: list[Savings]) -> PaperTable:
    names = (
        PLAIN.name,
        "blocks, 16 along an axis",
        "distance map, blocks of 4³",
        "early exit",
        "these and the distance map",
    )
    rows = tuple((each.scan, *(each.of(name).samples for name in names)) for each in saved)
    return PaperTable(
        "Figure 16: samples of a pixel",
        ("scan", *names),
        rows,
        "The thesis counts steps of one ray: 43 without any of these.",
    )


def _figure21(bench: Bench, volume: Volume, pixels: int) -> tuple[PaperTable, PaperCurves]:
    steps = _QUALITY_STEPS[:2] if bench.quick else _QUALITY_STEPS
    found: dict[TechniqueName, list[Measured]] = {}
    for technique in (_RAYS, _SLICES):
        render = f'technique = "{technique}"\nstep_voxels = 0.5\n{_PLAIN_RAYS}'
        package = bench.package(volume, "micro-ct", render=render, more=ALONE + _NO_SKIP)
        grid = package.manifest.levels[0].grid
        view = View(standard_views(grid)[_VIEW], (pixels, pixels))
        with bench.renderer(package) as renderer:
            found[technique] = [
                bench.measured(renderer, package, volume, view, math.hypot(*grid.extent_mm_zyx) / n) for n in steps
            ]
    table = PaperTable(
        f"Figure 21: quality by number of steps, {volume.name} voxels, {pixels}² pixels",
        ("technique", *(f"{n} steps" for n in steps)),
        tuple((TECHNIQUES[technique].text, *cells) for technique, cells in found.items()),
    )
    lines = tuple(
        Line(TECHNIQUES[technique].text, tuple((cell.ms, cell.rmse or 0.0) for cell in cells))
        for technique, cells in found.items()
    )
    return table, PaperCurves("Figure 21 as error against time", "milliseconds", "RMSE", lines)


def _finding(table3: PaperTable, table4: PaperTable, table5: PaperTable, saved: list[Savings]) -> str:
    (_, calculated, small, full), (_, _, _, full_slices) = table3.rows[0], table3.rows[1]
    (_, colours, palette, texture, *_) = table4.rows[0]
    plain, forward, central, sobel = table5.rows[0][1:]
    fetch, cache, slower = (_ms(full) / _ms(calculated), _ms(full) / _ms(small), _ms(full_slices) / _ms(full))
    no_gain = [each.scan for each in saved if each.times("distance map, blocks of 4³") < 1.03]
    gain = [
        f"{each.scan} ({each.times('distance map, blocks of 4³'):.1f} times)"
        for each in saved
        if each.scan not in no_gain
    ]
    not_seen = [each.times("light where seen") for each in saved]
    early = [f"{each.times('early exit'):.1f}" for each in saved]
    wrong = [each.scan for each in saved if each.kept == (each.scan in no_gain)]
    return (
        f"Table 3: with voxels rays take {fetch:.1f} times as long as with a computed sphere, so that fetching is the "
        f"limit here, as on most of the thesis' devices; a volume of 16³ voxels is {cache:.2f} times as fast as the whole "
        f"one, so that it is the filter and not memory that costs, unlike on Adreno and Mali. Slices take {slower:.1f} times "
        f"as long as rays: the thesis finds them faster, because of blending hardware that this driver has not. Table 4: "
        f"colours in the volume take {_ms(colours) / _ms(texture):.2f} of the time of a texture for the transfer function, a "
        f"palette {_ms(palette) / _ms(texture):.2f}; the thesis finds no order that holds for all devices. Table 5: light costs a "
        f"factor of {_ms(sobel) / _ms(plain):.1f} with normals in a volume, {_ms(forward) / _ms(plain):.1f} with forward and "
        f"{_ms(central) / _ms(plain):.1f} with central differences: here, as on the thesis' faster devices, stored normals are "
        f"the cheapest light. Table 6: lighting only what is seen is {min(not_seen):.2f} to {max(not_seen):.2f} times as fast, "
        f"where the thesis gains a factor of two: this driver runs both sides of a branch for eight pixels at a time. An "
        f"early exit is {', '.join(early)} times as fast ({', '.join(each.scan for each in saved)}). A distance map "
        f"gains on {', '.join(gain) or 'no scan'}, and not on {', '.join(no_gain) or 'none of them left out'}. "
        f"{'The plan decides otherwise on ' + ', '.join(wrong) if wrong else 'The plan takes and leaves it out accordingly'}."
    )


def _ms(cell: Cell) -> float:
    assert isinstance(cell, Measured)
    return cell.ms
