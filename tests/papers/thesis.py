"""The mobile volume rendering thesis: tables 3 to 7, and what figures 16, 19 and 21 show."""

import math
import re
from dataclasses import replace

import numpy as np

from volprep.techniques import TECHNIQUES
from volprep.truth.camera import standard_views
from volprep.validation.comparison.altered import Altered
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.program import TechniqueName
from volprep_formats.package.reader import Package

from .bench import ALONE, Bench, View, techniques_of
from .browsers import about_browsers, native_and_browser
from .lines import Line
from .reading import about_refinement, about_ways, diagonal_step, figure19, mosaic_cell, ways_to_read
from .record import Cell, Measured, Paper, PaperCurves, PaperTable
from .savings import PLAIN, WAYS, Savings, savings
from .volumes import Volume, scan

_STEPS = 512
_QUALITY_STEPS = (64, 128, 256, 512)
_RAYS: TechniqueName = "ray-casting"
_SLICES: TechniqueName = "view-slices"
_MOSAIC_SLICES: tuple[TechniqueName, ...] = ("axis-slices", "view-slices")
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
_MAP = "distance map, blocks of 4³"
_NOISE = 0.04
"""Times repeat within so much."""
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
    ways = ways_to_read(bench, volume, pixels)
    pictures19, table19 = figure19(bench, volume, pixels // 2)
    scans = {volume: "micro-ct"}
    if not bench.quick:
        scans |= {scan("ch2 head"): "mr-head", scan("MR head").reduced(2): "mr-head"}
        scans |= {scan(name): "micro-ct" for name in ("fly", "shell")}
    saved = [savings(bench, each, look) for each, look in scans.items()]
    table7 = native_and_browser(bench, dict([*scans.items()][:3]), pixels)
    return Paper(
        "thesis",
        "Thesis: volume rendering on mobile devices",
        "A master's thesis on algorithms for mobile GPUs, with OpenGL ES and WebGL",
        (
            table3,
            table4,
            table5,
            *_table6(saved),
            _figure16(saved),
            ways,
            pictures19,
            table19,
            *_figure21(bench, volume, 128 if bench.quick else 256),
            *([] if table7 is None else [table7]),
        ),
        _finding(table3, table4, table5, saved, software=bench.software)
        + about_ways(ways)
        + about_refinement(table19)
        + about_browsers(table7),
        () if table7 else ("Table 7, a browser against a native program: here is no Chromium with WebGL 2.",),
    )


def _table3(bench: Bench, volume: Volume, pixels: int, techniques: tuple[TechniqueName, ...]) -> PaperTable:
    rows: list[tuple[Cell, ...]] = []
    for technique in techniques:
        render = f'technique = "{technique}"\nstep_voxels = 0.5\n{_PLAIN_RAYS}'
        cells: list[Cell] = []
        for which in ("calculated", "small", "full"):
            drawn = volume.resized((16, 16, 16)) if which == "small" else volume
            package = bench.package(drawn, "micro-ct", render=render, more=ALONE + _NO_SKIP)
            grid = package.manifest.levels[0].grid
            step_mm = math.hypot(*grid.extent_mm_zyx) / _STEPS
            view = View(standard_views(grid)[_VIEW], (pixels, pixels))
            shown = _calculated(package) if which == "calculated" else package
            with bench.renderer(shown) as renderer:
                found = bench.measured(renderer, package, drawn, view, step_mm)
            cells.append(replace(found, rmse=None) if which == "calculated" else found)
        rows.append((TECHNIQUES[technique].text, *cells))
    for technique in _MOSAIC_SLICES:
        drawn = [volume.resized((16, 16, 16)), volume]
        cells = [mosaic_cell(bench, each, technique, pixels, "lookup", diagonal_step(each, _STEPS)) for each in drawn]
        rows.append((f"{TECHNIQUES[technique].text}, in 2D textures", None, *cells))
    return PaperTable(
        f"Table 3: {_STEPS} steps through {volume.name} voxels, {pixels}² pixels",
        ("technique", "volume calculated", "small volume", "full volume"),
        tuple(rows),
        "Calculated: a sphere by arithmetic in place of the fetch. Small: 16³ voxels, as many samples. Rays and "
        "slices run to their end. The thesis has slices through 2D textures: the last rows, which read a mosaic; the "
        "others read a 3D texture.",
    )


def _calculated(package: Package) -> Package:
    """Return the package whose shader computes a sphere instead of reading voxels."""
    program = package.manifest.level_programs[0]
    text = package.read_text(program.fragment)
    assert _VOLUME_FETCH in text
    # The texture stays in the sum, so that no uniform of the program becomes idle; it is read once for a pixel.
    text = text.replace(_VOLUME_FETCH, _SPHERE)
    text = _PICTURE.sub(r"\1\2 + 1e-9 * textureLod(u_volume, vec3(0.5), 0.0).r;", text)
    return Altered(package, {program.fragment: text})


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
    for technique in _MOSAIC_SLICES:
        cells = [
            mosaic_cell(bench, volume, technique, pixels, name, None)
            if name in TECHNIQUES[technique].classifications
            else "not possible"
            for name in _CLASSIFICATIONS
        ]
        rows.append((f"{TECHNIQUES[technique].text}, in 2D textures", *cells))
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


def _table6(saved: list[Savings]) -> tuple[PaperTable, PaperTable]:
    drawn = PaperTable(
        "Table 6: work that is left out, alone and together, lit from the viewer, 256² pixels, three views",
        ("left out", *(each.scan for each in saved)),
        tuple((way.name, *(each.of(way.name) for each in saved)) for way in WAYS),
        "Samples are those of a pixel on the average. The thesis has light where seen, early exit and a table of 16³ "
        "blocks, one after the other.",
    )
    decided = PaperTable(
        "Beside table 6: what the plan takes where it decides for itself",
        ("scan", "item", "alone, times as fast", "beside the other, times as fast", "the plan", "reason"),
        tuple(
            (each.scan, item.name, *_gains(each, item), "takes it" if item.kept else "leaves it out", item.reason)
            for each in saved
            for item in each.decided
        ),
    )
    return drawn, decided


def _gains(saved: Savings, item: PlanItem) -> tuple[float, float]:
    """Return how many times as fast a scan is with an item, alone and where light and the other item are there."""
    both = saved.of("these and the distance map").ms
    if item.name.startswith("skip table"):
        return saved.times(_MAP), saved.of("light where seen, early exit").ms / both
    return saved.times("early exit"), saved.of("light where seen, distance map").ms / both


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


def _finding(
    table3: PaperTable, table4: PaperTable, table5: PaperTable, saved: list[Savings], *, software: bool
) -> str:
    (_, calculated, small, full) = table3.rows[0]
    full_slices = next(row[-1] for row in table3.rows if row[0] == TECHNIQUES[_SLICES].text)
    (_, colours, palette, texture, points, *_) = table4.rows[0]
    plain, forward, central, sobel = table5.rows[0][1:]
    fetch, cache, slower = _ms(full) / _ms(calculated), _ms(full) / _ms(small), _ms(full_slices) / _ms(full)
    gains = {each.scan: each.times(_MAP) for each in saved}
    no_gain = [name for name, times in gains.items() if times < 1.0 + _NOISE]
    gain = [f"{name} ({times:.2f} times)" for name, times in gains.items() if name not in no_gain]
    wrong = [
        f"{item.name} of {each.scan}"
        for each in saved
        for item in each.decided
        # Beside the other is how a package is drawn; what neither gains nor costs may be either way.
        if abs(_gains(each, item)[1] - 1.0) > _NOISE and item.kept != (_gains(each, item)[1] > 1.0)
    ]
    seen = [each.times("light where seen") for each in saved]
    early = ", ".join(f"{each.scan} {each.times('early exit'):.2f}" for each in saved)
    together = ", ".join(f"{each.scan} {each.times('these and the distance map'):.2f}" for each in saved)
    proxy = ", ".join(f"{each.scan} {each.times('proxy'):.2f}" for each in saved)
    cached = (
        "memory does not limit, unlike on Adreno and Mali" if cache < 1.3 else "memory limits, as on Adreno and Mali"
    )
    blending = ", because of blending hardware, which a software driver has not" if software and slower > 1.0 else ""
    both = "so that the driver runs both sides of the branch"
    sides = (
        f"{both}, and eight pixels at a time"
        if max(seen) < 1.2 and software
        else both
        if max(seen) < 1.2
        else "as in the thesis, where it gains up to a factor of two"
    )
    cheapest = min(("normals in a volume", sobel), ("forward differences", forward), key=lambda each: _ms(each[1]))
    return (
        f"Table 3: reading voxels takes {fetch:.1f} times as long as computing a sphere. The whole volume takes "
        f"{cache:.2f} times as long as one of 16³ voxels: {cached}. Slices take {slower:.1f} times as long as rays; "
        f"the thesis finds them faster{blending}. Table 4: colours in the volume take "
        f"{_ms(colours) / _ms(texture):.2f} of the time of a texture for the transfer function, a palette "
        f"{_ms(palette) / _ms(texture):.2f}, control points {_ms(points) / _ms(texture):.2f}; the thesis finds no "
        "order that holds for all devices. What its frame rates do not show: colours in the volume are off most, "
        f"because colours are filtered and not values. Table 5: light takes {_ms(sobel) / _ms(plain):.1f} times as "
        f"long with normals in a volume, {_ms(forward) / _ms(plain):.1f} with forward and "
        f"{_ms(central) / _ms(plain):.1f} with central differences; {cheapest[0]} are cheapest here. The thesis has "
        f"stored normals first on its fast devices. Table 6: lighting only what is seen is {min(seen):.2f} to "
        f"{max(seen):.2f} times as fast, {sides}. An early exit gains: {early} times. A distance map gains on "
        f"{', '.join(gain) or 'no scan'}{'; not on ' + ', '.join(no_gain) if no_gain else ''}. Together with light "
        f"and early exit: {together} times. A proxy alone: {proxy} times; its triangles cost more than they save "
        "where the mesh of a noisy scan has many. "
        + (
            f"The plan decides otherwise on {', '.join(wrong)}."
            if wrong
            else "The plan takes and leaves out tables and early ends as these times say."
        )
    )


def _ms(cell: Cell) -> float:
    assert isinstance(cell, Measured)
    return cell.ms
