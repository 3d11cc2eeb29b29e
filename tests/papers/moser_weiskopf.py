"""Moser and Weiskopf 2008: slices without shaders, hybrid resolution, opacity without alpha (figures 2 to 6)."""

import math
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from typing import get_args

import numpy as np

from tests.benchmarks.drawing_time import best_ms, honest_clock
from tests.benchmarks.waking import is_software
from volprep.render.box_lines import box_lines
from volprep.render.egl import context
from volprep.render.gl1 import Gl1
from volprep.render.hybrid import OpacitySource, small_picture
from volprep.render.slices import SliceRenderer
from volprep.transfer.preclassified import code_colours
from volprep.truth.camera import Camera, standard_views, view_from
from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.textures import paletted

from .bench import ALONE, Bench, View, rmse
from .lines import Line
from .record import Cell, Measured, Paper, PaperCurves, PaperTable
from .volumes import Volume, scan

SCREEN_HW = (640, 480)
SMALL_HW = (128, 128)
_SWEPT = (16, 32, 64, 128, 256, 512)
"""Pixels of small pictures along each axis."""
_FORMS = {"palette": 'form = "palette"', "RGBA": 'form = "rgba"'}
_ALONG_Z = 'stacks = ["z"]'
"""The only stack that is seen along its axis; three do not fit into the memory of the profile where n is largest."""
_ROUNDS = 3
_TOO_LARGE = "VP3022"
"""Code of a volume that a profile cannot hold."""
_NAME, _TITLE = "moser-weiskopf", "Interactive volume rendering on mobile devices"


def measure(bench: Bench) -> Paper:
    """Measure figures 2 to 6; nothing where there is no OpenGL ES 1.1."""
    missing = _missing()
    if missing is not None:
        bench.driver = bench.driver or "a driver without OpenGL ES 1.1"
        finding = f"Nothing can be measured here: {missing}"
        return Paper(_NAME, _TITLE, "Moser and Weiskopf 2008", (), finding, ("All figures: they need OpenGL ES 1.1.",))
    head = scan("MR head").reduced(3)
    sizes = (32, 64) if bench.quick else (16, 32, 48, 64, 96, 128)
    estimates = _estimates(bench, head.resized((64, 64, 64)))
    by_size = _by_size(bench, head, sizes)
    by_pixels = _by_pixels(bench, head)
    close = _close(bench, head.resized((64, 64, 64)))
    sweep = _sweep(bench, head.resized((64, 64, 64)))
    updates = _updates(bench, head, sizes)
    return Paper(
        _NAME,
        _TITLE,
        "Moser and Weiskopf 2008",
        (estimates, by_size, by_pixels, close, sweep, updates),
        _finding(estimates, by_size, by_pixels, close, updates),
    )


def _missing() -> str | None:
    try:
        with context("es1.1"):
            return None
    except VolprepError as error:
        return str(error)


def _package(bench: Bench, volume: Volume, form: str = "RGBA", stacks: str = "", *, editable: bool = False) -> Package:
    more = f"{ALONE}[slices]\n[lab.slices]\n{_FORMS[form]}\n{stacks}\n"
    head = "editable = true" if editable else 'crop = "none"'
    return bench.package(volume, "mr-head", profile="gles1", head=head, more=more)


def _along_z(package: Package, shape_hw: tuple[int, int], zoom: float = 1.0) -> View:
    """Look along the axis of the slices, as the paper does."""
    grid = package.manifest.levels[0].grid
    middle = grid.corner_mm_xyz + np.array(grid.direction) @ (np.array(grid.extent_mm_zyx[::-1]) / 2)
    x, y, z = (middle + np.array(grid.direction)[:, 2] * 2 * math.hypot(*grid.extent_mm_zyx)).tolist()
    camera: Camera = view_from(grid, (x, y, z))
    return View(replace(camera, height_mm=camera.height_mm / zoom), shape_hw)


def _estimates(bench: Bench, volume: Volume) -> PaperTable:
    package = _package(bench, volume)
    grid = package.manifest.levels[0].grid
    camera = standard_views(grid)["anterior-left"].box_from_clip(grid, SCREEN_HW[1] / SCREEN_HW[0])
    lines = box_lines(camera, np.array(grid.extent_mm_zyx[::-1]))
    rows: list[tuple[Cell, ...]] = []
    with SliceRenderer(package) as renderer:
        alpha = small_picture(renderer, camera, SMALL_HW, "alpha")
        full = small_picture(renderer, camera, SCREEN_HW, "alpha")
        truth = renderer.render_with_lines(camera, SCREEN_HW, full, (lines,))
        for source in get_args(OpacitySource):
            found = small_picture(renderer, camera, SMALL_HW, source)
            shown = renderer.render_with_lines(camera, SCREEN_HW, found, (lines,))
            ms = _ms(renderer, lambda source=source: small_picture(renderer, camera, SMALL_HW, source))
            opacity = float(np.sqrt(np.mean((found[..., 3] - alpha[..., 3]) ** 2)))
            rows.append((source, Measured(ms, opacity), rmse(shown[..., :3], truth[..., :3])))
    return PaperTable(
        f"Figure 2: where the opacity of the small picture comes from, {volume.name} voxels",
        ("source", "small picture with its opacity", "RMSE of the screen"),
        tuple(rows),
        "The error of the small picture is that of its opacity against the alpha of the buffer. That of the screen is "
        "against volume and lines with all pixels.",
    )


def _by_size(bench: Bench, head: Volume, sizes: tuple[int, ...]) -> PaperCurves:
    forms = {
        "n slices of 64²": lambda n: (n, 64, 64),
        "64 slices of n²": lambda n: (64, n, n),
        "n slices of n²": lambda n: (n, n, n),
    }
    lines = []
    for label, shape_of in forms.items():
        points = [(float(n), _slices(bench, head.resized(shape_of(n)), SCREEN_HW).ms) for n in sizes]
        lines.append(Line(label, tuple(points)))
    return PaperCurves(
        "Figure 3: time by resolution of the volume",
        "n",
        "milliseconds",
        tuple(lines),
        "480×640 pixels, seen along the axis of the slices.",
    )


def _by_pixels(bench: Bench, head: Volume) -> PaperCurves:
    lines = []
    for n in (32, 64):
        volume = head.resized((n, n, n))
        points = []
        for percent in (25, 50, 75, 100):
            share = math.sqrt(percent / 100)
            shape_hw = (round(SCREEN_HW[0] * share), round(SCREEN_HW[1] * share))
            points.append((float(percent), _slices(bench, volume, shape_hw).ms))
        lines.append(Line(f"{n}³ voxels", tuple(points)))
    return PaperCurves(
        "Figure 4: time by size of the viewport", "percent of the pixels of 480×640", "milliseconds", tuple(lines)
    )


def _close(bench: Bench, volume: Volume) -> PaperTable:
    package = _package(bench, volume)
    view = _along_z(package, SCREEN_HW, zoom=2.0)
    with SliceRenderer(package) as renderer:
        grid = renderer.level.grid
        camera = view.camera.box_from_clip(grid, view.aspect)
        full = bench.slices(renderer, view, bench.truth(package, volume, view))
        truth = renderer.render(camera, SCREEN_HW)

        def enlarged() -> np.ndarray:
            small = renderer.render(camera, SMALL_HW)
            return renderer.render_with_lines(camera, SCREEN_HW, small, ())

        hybrid = Measured(_ms(renderer, enlarged), rmse(enlarged()[..., :3], truth[..., :3]))
    return PaperTable(
        f"Figure 5: close to {volume.name} voxels, and nearly all slices fill the screen",
        ("", "480×640", "128² enlarged"),
        (("slices", full, hybrid),),
        "The error of the second is against the first, what the enlarging costs; its time includes reading the small "
        "picture back and making a texture of it.",
    )


def _sweep(bench: Bench, volume: Volume) -> PaperCurves:
    """Time the small picture and its enlarging by its size, near to the volume."""
    package = _package(bench, volume)
    view = _along_z(package, SCREEN_HW, zoom=2.0)
    points, errors = [], []
    with SliceRenderer(package) as renderer:
        camera = view.camera.box_from_clip(renderer.level.grid, view.aspect)
        truth = renderer.render(camera, SCREEN_HW)
        full_ms = _ms(renderer, lambda: renderer.render(camera, SCREEN_HW))
        for size in _SWEPT[:3] if bench.quick else _SWEPT:

            def enlarged(size: int = size) -> np.ndarray:
                return renderer.render_with_lines(camera, SCREEN_HW, renderer.render(camera, (size, size)), ())

            points.append((float(size), _ms(renderer, enlarged)))
            errors.append(f"{size}² {rmse(enlarged()[..., :3], truth[..., :3]):.3f}")
    ends = ((points[0][0], full_ms), (points[-1][0], full_ms))
    return PaperCurves(
        "Section 5, low resolution: time by the size of the small picture",
        "pixels along each axis",
        "milliseconds",
        (Line("small picture, enlarged", tuple(points)), Line("480×640 pixels", ends)),
        f"Close to {volume.name} voxels, with reading back. RMSE against 480×640 pixels: {', '.join(errors)}.",
    )


def _updates(bench: Bench, head: Volume, sizes: tuple[int, ...]) -> PaperCurves:
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in _REMADE}
    for n in sizes:
        try:
            package = _package(bench, head.resized((n, n, n)), "palette", editable=True)
        except VolprepError as error:
            if error.code != _TOO_LARGE:
                raise
            break
        for name, form in _REMADE.items():
            found[name].append((float(n), _remake_ms(package, form)))
    return PaperCurves(
        "Figure 6: time to make the textures of all stacks after an edit of the transfer function",
        "n of n³ voxels",
        "milliseconds",
        tuple(Line(name, tuple(points)) for name, points in found.items()),
        "From the edited function to textures that can be drawn; the codes are in memory. A palette is 256 colours for "
        "each stack, uploaded with the codes, because OpenGL ES 1.1 cannot change it. RGBA classifies every voxel on "
        "the processor. The curves end where the profile has no room for three paletted stacks.",
    )


def _as_palette(texture: Texture, colours: UInt8Array, indices: UInt8Array) -> tuple[Texture, bytes]:
    return texture, b"".join(paletted.encode(colours, indices))


def _as_rgba(texture: Texture, colours: UInt8Array, indices: UInt8Array) -> tuple[Texture, bytes]:
    return texture.model_copy(update={"format": "rgba8unorm"}), colours[indices].tobytes()


_Remade = Callable[[Texture, UInt8Array, UInt8Array], tuple[Texture, bytes]]
_REMADE: dict[str, _Remade] = {"palette": _as_palette, "RGBA": _as_rgba}


def _remake_ms(package: Package, form: _Remade) -> float:
    """Return the milliseconds from an edited transfer function to the textures of all its stacks."""
    manifest = package.manifest
    assert manifest.quantization is not None
    function, window = manifest.transfer_functions[0], manifest.quantization.window
    read = [(each, package.read_bytes(each.file)) for each in manifest.textures]
    held = [(each, *paletted.decode(data, each.shape_zyx[1:], each.file)) for each, data in read]
    times = []
    with context("es1.1") as opened:
        gl = Gl1(opened)
        software = is_software(gl.driver.renderer)
        for _ in range(_ROUNDS):
            wall, cpu = time.perf_counter(), time.process_time()
            with ExitStack() as stack:
                for texture, _, indices in held:
                    colours = code_colours(function, window, texture.reference_mm or 1.0)
                    record, texels = form(texture, colours, indices)
                    stack.enter_context(gl.texture(record, texels))
                gl.finish()
                # One core makes and uploads them, on whatever driver.
                times.append((time.process_time() - cpu if software else time.perf_counter() - wall) * 1000)
        gl.close()
    return min(times)


def _slices(bench: Bench, volume: Volume, shape_hw: tuple[int, int]) -> Measured:
    package = _package(bench, volume, stacks=_ALONG_Z)
    view = _along_z(package, shape_hw)
    truth: Float64Array = bench.truth(package, volume, view)
    with SliceRenderer(package) as renderer:
        return bench.slices(renderer, view, truth)


def _ms(renderer: SliceRenderer, draw: Callable[[], object]) -> float:
    clock = honest_clock(renderer.driver.renderer)

    def ms_of(pictures: int) -> float:
        began = clock()
        for _ in range(pictures):
            draw()
        return (clock() - began) * 1000 / pictures

    return best_ms(renderer.driver.renderer, ms_of, rounds=_ROUNDS)


def _finding(
    estimates: PaperTable, by_size: PaperCurves, by_pixels: PaperCurves, close: PaperTable, updates: PaperCurves
) -> str:
    def growth(line: Line) -> float:
        return line.points[-1][1] / line.points[0][1]

    slices, texels, _ = by_size.lines
    _, full, small = close.rows[0]
    palette, colours = (dict(line.points) for line in updates.lines)
    largest = max(palette.keys() & colours.keys())
    assert isinstance(full, Measured)
    assert isinstance(small, Measured)
    opacity = {str(row[0]): row[1].rmse or 0.0 for row in estimates.rows if isinstance(row[1], Measured)}
    larger = slices.points[-1][0] / slices.points[0][0]
    return (
        "The paper finds that time goes with fragments, that is, with the number of slices and the pixels that they "
        f"cover. That holds: {larger:g} times as many slices take {growth(slices):.1f} times as long, {larger:g} "
        f"times as many texels along each axis of a slice {growth(texels):.1f} times; four times the pixels take "
        f"{growth(by_pixels.lines[-1]):.1f} times as long. Close to the volume the picture of 128² pixels is "
        f"{full.ms / small.ms:.1f} times as fast as that of the screen, with reading back and enlarging; the paper "
        f"has 652 against 101 milliseconds. Enlarging costs an error of {small.rmse:.3f}. Opacity from black and "
        f"white backgrounds ({opacity['black-and-white']:.4f}) and from a white volume "
        f"({opacity['white-volume']:.4f}) is the alpha but for rounding; luminance is off by "
        f"{opacity['luminance-average']:.3f} averaged and by {opacity['luminance-perceived']:.3f} as perceived, so "
        "that, as in the paper, neither is better by much. After an edit, textures with palettes take "
        f"{palette[largest] / colours[largest]:.2f} of the time of RGBA textures at {largest:g}³ voxels. "
        + (
            "That palettes are the faster ones holds here, too."
            if palette[largest] < colours[largest]
            else "In the paper palettes are several times as fast; this driver expands them itself, texel by texel."
        )
    )
