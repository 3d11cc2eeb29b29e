"""What skip tables and proxy geometry save: the same views without both, with each alone, and as the package draws.

Both leave out samples that show nothing and move no other, so that the pictures must be the same. A table is left out
by composing the shader without it; a mesh, by drawing with the program that begins at the volume's box.

A ray that begins at a mesh is the same but for rounding. That is nothing where the driver mixes texels with float
weights. A GPU has few weights, 256 for most: a sample that rounding moves to the next one changes by a step. Where
pictures differ by more than a step of the target, it is measured what rays moved by as much do to a picture there.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import median

import numpy as np

from volprep.render.choose import ray_caster_of
from volprep.render.renderer import Renderer
from volprep.validation.bench import Bench
from volprep.validation.counted import samples_of_views
from volprep.validation.folder import PICTURES
from volprep.validation.pictures import coloured
from volprep.validation.precise import NO_SUCH_TARGET
from volprep.validation.rays import chords_mm, settled
from volprep.validation.records import EmptySpace, SavingView, SavingWay, WayName
from volprep.validation.subject import Subject
from volprep.validation.sweep import SWEEP_VIEW
from volprep.validation.uncut import unskipped
from volprep.validation.views import ViewedProgram
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.meshes import read_glb
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package

_DRAWS = 3
_STEP_OF_TARGET = 1 / 255
_NOISE = 1e-6
"""Pictures in 8 bits are whole steps apart, but are read as float32."""
_MOVED = 2.0**-17
"""Of the volume's longest side: what interpolation between the corners of a mesh may move a ray by. On an NVIDIA H100
meshes of a shell change pixels by 0.03 at most (RMSE 0.0001 to 0.0002), rays moved so far by 0.04 (0.0002)."""
_DIRECTIONS_XYZ = ((1.0, 1.0, 1.0), (-1.0, 1.0, -1.0), (1.0, -1.0, -1.0), (-1.0, -1.0, 1.0))

Counts = list[tuple[Float64Array, Float64Array]]


@dataclass(frozen=True)
class _Way:
    name: WayName
    kind: type[Renderer]
    package: Package
    program: Program


@dataclass(frozen=True)
class _Drawn:
    pictures: list[Float32Array]
    draw_ms: float
    counts: Counts | None
    """Samples and looks of each view, in half the width and height; None without a float target."""


def measure_empty_space(bench: Bench, program: Program, viewed: ViewedProgram) -> EmptySpace | None:
    """Draw the finest level of a program in every way that its package has.

    None where it has neither table nor mesh, or where its shader is not the one that this version of volprep composes,
    so that nobody can tell what it would be without. The last way is how the package is `viewed`.
    """
    subject = bench.subject
    level = min(program.levels)
    ways = list(_ways(subject, program, level))
    if len(ways) < 2:
        return None
    bench.progress.start(f"empty space, {program.name}", len(ways))
    found = []
    for way in ways:
        pictures = [*viewed.drawn.values()] if way is ways[-1] else None
        found.append(_drawn(bench, way, level, pictures))
        bench.progress.advance()
    results = tuple(
        SavingWay(way=way.name, draw_ms=drawn.draw_ms, draws=_DRAWS, views=_views(subject, drawn, found[0]))
        for way, drawn in zip(ways, found, strict=True)
    )
    limit, rounding = _limit(subject), 0.0
    largest = max(view.difference for way in results for view in way.views)
    if largest > limit:
        rounding = _rounding(bench, ways[0], level, found[0].pictures)
    return EmptySpace(
        drawn_by=ways[-1].program.name,
        ways=results,
        limit=limit + rounding,
        rounding=rounding,
        passed=largest <= limit + rounding,
        mesh_read_ms=_mesh_read_ms(subject.package, program.transfer, level),
        picture=_picture(bench, program, [drawn.counts for drawn in found]),
    )


def _ways(subject: Subject, program: Program, level: int) -> Iterator[_Way]:
    """Return the ways, the plainest first, as the package draws last; fewer than two where nothing can be compared."""
    package, transfer = subject.package, program.transfer
    skips = any(sampler.role == "skip" for sampler in program.samplers)
    at_mesh = ray_caster_of(package, level, transfer)
    drawers: list[tuple[WayName, WayName, type[Renderer]]] = [("neither", "table", Renderer)]
    if at_mesh is not Renderer:
        drawers.append(("mesh", "both", at_mesh))
    for alone, with_table, kind in drawers:
        own = kind(package, level=level, transfer=transfer).program
        without = unskipped(package, own, subject.render)
        if without is None:
            return
        yield _Way(alone, kind, without, kind(without, level=level, transfer=transfer).program)
        if skips:
            yield _Way(with_table, kind, package, own)


def _drawn(bench: Bench, way: _Way, level: int, drawn: list[Float32Array] | None) -> _Drawn:
    subject = bench.subject
    cameras = list(subject.views.values())
    with way.kind(way.package, level=level, transfer=way.program.transfer) as renderer:
        with bench.clock.part("drawing"):
            pictures = drawn or [renderer.render(camera, subject.shape_hw) for camera in cameras]
        with bench.clock.part("timing"):
            draw_ms = renderer.time_ms(subject.views[SWEEP_VIEW], subject.shape_hw, repeats=_DRAWS)
    with bench.clock.part("counting"):
        return _Drawn(pictures, draw_ms, _counts(way, level, cameras, _half(subject)))


def _rounding(bench: Bench, way: _Way, level: int, pictures: list[Float32Array]) -> float:
    """Return what rays that are moved by rounding change at most, in any view."""
    subject = bench.subject
    moved_mm = _MOVED * max(subject.grid.extent_mm_zyx)
    largest = 0.0
    with bench.clock.part("drawing"), way.kind(way.package, level=level, transfer=way.program.transfer) as renderer:
        for camera, picture in zip(subject.views.values(), pictures, strict=True):
            for direction_xyz in _DIRECTIONS_XYZ:
                moved = camera.copy()
                moved[:3] += np.outer(np.array(direction_xyz) * moved_mm, camera[3])
                found = renderer.render(moved, subject.shape_hw)
                largest = max(largest, _difference(subject, camera, found, picture))
    return largest


def _counts(way: _Way, level: int, cameras: list[Float64Array], shape_hw: tuple[int, int]) -> Counts | None:
    try:
        return samples_of_views(way.package, way.program, level, cameras, shape_hw, kind=way.kind)
    except VolprepError as error:
        if error.code != NO_SUCH_TARGET:
            raise
        return None


def _views(subject: Subject, drawn: _Drawn, plain: _Drawn) -> tuple[SavingView, ...]:
    return tuple(
        SavingView(
            view=name,
            samples_mean=_mean(subject, camera, drawn.counts[number][0]) if drawn.counts else None,
            looks_mean=_mean(subject, camera, drawn.counts[number][1]) if drawn.counts else None,
            difference=_difference(subject, camera, drawn.pictures[number], plain.pictures[number]),
        )
        for number, (name, camera) in enumerate(subject.views.items())
    )


def _mean(subject: Subject, camera: Float64Array, counted: Float64Array) -> float:
    return float(counted[chords_mm(camera, counted.shape[:2], subject.grid) > 0].mean())


def _difference(subject: Subject, camera: Float64Array, one: Float32Array, other: Float32Array) -> float:
    difference = np.abs(one - other).max(axis=-1)
    if subject.render.projection == "perspective":
        # Rounding may give a ray one sample more, which is neither better nor worse.
        chords = chords_mm(camera, subject.shape_hw, subject.grid)
        difference = difference[settled(chords, subject.render.step_mm)]
    return float(difference.max(initial=0.0))


def _limit(subject: Subject) -> float:
    """One step of the target, with what float32 rounds of it, and what the scene lets both take from a ray."""
    manifest = subject.package.manifest
    epsilons = [part.epsilon for part in (manifest.skipping, manifest.proxy) if part is not None]
    return _STEP_OF_TARGET + _NOISE + sum(epsilons)


def _half(subject: Subject) -> tuple[int, int]:
    """A quarter of the pixels tells the samples of a picture to a percent, in a quarter of the time."""
    height, width = subject.shape_hw
    return -(-height // 2), -(-width // 2)


def _mesh_read_ms(package: Package, transfer: str, level: int) -> float | None:
    meshes = package.manifest.proxy.meshes if package.manifest.proxy else ()
    file = next((mesh.file for mesh in meshes if (mesh.transfer, mesh.level) == (transfer, level)), None)
    if file is None:
        return None
    data = package.read_bytes(file)
    times = []
    for _ in range(_DRAWS):
        start = time.perf_counter()
        read_glb(data, file)
        times.append((time.perf_counter() - start) * 1000)
    return median(times)


def _picture(bench: Bench, program: Program, counts: list[Counts | None]) -> str | None:
    """Write the samples of each pixel in the view of the sweep, the ways side by side."""
    view = list(bench.subject.views).index(SWEEP_VIEW)
    taken = [each[view][0] for each in counts if each is not None]
    if len(taken) < len(counts):
        return None
    name = f"{PICTURES}/{program.name}-samples.png"
    # Of the plainest way the longest ray is the brightest.
    bench.folder.picture(name, coloured(np.concatenate(taken, axis=1), 1 / max(float(taken[0].max()), 1.0)))
    return name
