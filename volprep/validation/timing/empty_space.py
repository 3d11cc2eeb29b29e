"""Measure the savings of skip tables and proxy geometry: the same views with neither, with each alone, and as shipped.

Both leave out samples that show nothing and move no other sample, so the pictures must be the same. A table is left out
by composing the shader without it; a mesh, by drawing with the program that begins at the volume's box.

Pictures without a table take three times as long. So every second row and column is compared in the view of the sweep
and where there is a mesh, every fourth in other views. Before that, validation compares each entry of a table with one
computed from the scan. The remaining faults, of the shader that walks over blocks or of the rule for entries, change
many blocks.

A ray that begins at a mesh differs only by rounding. That has no effect if the driver filters texels with float
weights. A GPU has few weights, usually 256: a sample that rounding moves to the next weight changes by a step. Where
pictures differ by more than a step of the target, validation measures how much rays moved by that rounding change a
picture on this driver.
"""

import re
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from volprep.render.renderer import Renderer
from volprep.render.renderers import ray_caster_of
from volprep.truth.seen import largest_channel
from volprep.validation.bench import Bench
from volprep.validation.comparison.altered import Altered
from volprep.validation.comparison.colours import coloured
from volprep.validation.comparison.precise_target import NO_SUCH_TARGET
from volprep.validation.comparison.views import ViewedProgram
from volprep.validation.folder import PICTURES
from volprep.validation.results.measurements import EmptySpace, SavingView, SavingWay, WayName
from volprep.validation.subjects.subject import Subject
from volprep.validation.timing.full_rays import unskipped
from volprep.validation.timing.rays import chords_mm, settled
from volprep.validation.timing.sweep import SWEEP_VIEW
from volprep.validation.timing.turns import Milliseconds
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.meshes import read_glb
from volprep_formats.package.program import PictureProgram
from volprep_formats.package.reader import Package

_MAIN = "void main() {\n"
_SAMPLE = re.compile(r"^( *)(?!//)\S.*\bstride \* (?:\(?i|reached)\b", re.MULTILINE)
"""The first line that reads the volume at sample i, or at the end of a piece of the ray in one cell."""
_ON_GRIDS = re.compile(r"^( *)vec4 medium = classify_\w+\(i\);", re.MULTILINE)
"""Lines that read media on several grids, one in each loop."""
_LOOK = re.compile(r"^( *)float (?:entry = skip_entry|later = seen_from_\d)\(", re.MULTILINE)
_PICTURE = re.compile(r"^( *(?:picture|gl_FragColor) = )(.*);$", re.MULTILINE)


def counting(package: Package, program: PictureProgram) -> Package:
    """Return the package with a shader that writes samples taken into red and entries of the skip table into green."""
    text = package.read_text(program.fragment)
    head, main, rest = text.partition(_MAIN)
    rest, loops = _ON_GRIDS.subn(r"\1taken++;\n\g<0>", rest)
    rest = rest if loops else _SAMPLE.sub(r"\1taken++;\n\g<0>", rest, count=1)
    rest = _LOOK.sub(r"\1looked++;\n\g<0>", rest)
    # The picture stays in the sum, so that no uniform of the program becomes inactive.
    rest = _PICTURE.sub(r"\1vec4(taken, looked, 0.0, 1.0) + 1e-9 * \2;", rest)
    text = f"{head}{main}  float taken = 0.0;\n  float looked = 0.0;\n{rest}"
    return Altered(package, {program.fragment: text})


def samples_of_views(
    package: Package,
    program: PictureProgram,
    level: int,
    views: Sequence[tuple[Float64Array, tuple[int, int]]],
    *,
    kind: type[Renderer],
) -> list[tuple[Float64Array, Float64Array]]:
    """Return the samples taken, and the entries of the skip table read, for each pixel [H, W] of each view.

    A view is a camera, and height and width of the picture. `kind` is the renderer that draws with `program`. Raises
    the errors of `Renderer`; needs a float32 target.
    """
    counted = counting(package, program)
    with kind(counted, level=level, transfer=program.transfer, target="rgba32f") as renderer:
        pictures = [np.rint(renderer.render(*view)).astype(np.float64) for view in views]
    return [(picture[..., 0], picture[..., 1]) for picture in pictures]


_READS = 3
_LEAST_COUNTED = 32
"""Width and height of the smallest pictures whose samples are counted."""
_STEP_OF_TARGET = 1 / 255
_NOISE = 1e-6
"""Pictures in 8 bits are whole steps apart, but are read as float32."""
_MOVED = 2.0**-17
"""Shift of a ray by interpolation between the corners of a mesh, as a part of the volume's longest side. On an NVIDIA
H100 meshes of a shell change pixels by 0.03 at most (RMSE 0.0001 to 0.0002), rays moved by this much by 0.04
(0.0002)."""
_DIRECTIONS_XYZ = ((1.0, 1.0, 1.0), (-1.0, 1.0, -1.0), (1.0, -1.0, -1.0), (-1.0, -1.0, 1.0))

Counts = list[tuple[Float64Array, Float64Array]]
_Rays = tuple[Float64Array, tuple[int, int]]
"""Camera of a view, and height and width of its pictures."""


@dataclass(frozen=True)
class SkippingWay:
    """One way to draw a program: with or without skip table and proxy mesh."""

    name: WayName
    """Empty-space technique in use."""
    kind: type[Renderer]
    """Description of the renderer."""
    package: Package
    """The package, or the same with another shader."""
    program: PictureProgram
    """The program."""

    def open(self, level: int) -> Renderer:
        """Return the renderer of a level."""
        return self.kind(self.package, level=level, transfer=self.program.transfer)


@dataclass(frozen=True)
class _Drawn:
    pictures: dict[str, Float32Array]
    """By view."""
    counts: Counts | None
    """Samples and looks of each view, in fewer pixels; None without a float target."""


def ways_of(subject: Subject, program: PictureProgram) -> tuple[SkippingWay, ...]:
    """Return the ways to draw with a program, the plainest first; the last one is how the package is drawn.

    None if the package has neither table nor mesh, or if its shader is not the one that this version of volprep
    composes: then the shader without them is unknown.
    """
    ways = tuple(_ways(subject, program, min(program.levels)))
    return ways if len(ways) > 1 else ()


def measure_empty_space(
    bench: Bench,
    program: PictureProgram,
    viewed: ViewedProgram,
    ways: Sequence[SkippingWay],
    times: Mapping[WayName, Milliseconds],
) -> EmptySpace | None:
    """Draw the finest level of a program in every way that its package has; None if it has none.

    The last way is how the package is `viewed`, with the `times` of its draws.
    """
    subject = bench.subject
    level = min(program.levels)
    if not ways:
        return None
    bench.progress.start(f"empty space, {program.name}", len(ways))
    fewest = 4 if subject.package.manifest.proxy is None else 2
    rays = {name: subject.sparse(2 if name == SWEEP_VIEW else fewest).rays(name) for name in subject.views}
    found = []
    for way in ways:
        known = viewed.drawn if way is ways[-1] else {}
        found.append(_drawn(bench, way, level, rays, known))
        bench.progress.advance()
    results = tuple(
        SavingWay(way=way.name, draw=times[way.name], views=_views(subject, rays, drawn, found[0]))
        for way, drawn in zip(ways, found, strict=True)
    )
    limit, rounding = _limit(subject), 0.0
    largest = max(view.difference for way in results for view in way.views)
    if largest > limit:
        rounding = _rounding(bench, ways[0], level, rays, found[0].pictures)
    return EmptySpace(
        drawn_by=ways[-1].program.name,
        ways=results,
        limit=limit + rounding,
        rounding=rounding,
        passed=largest <= limit + rounding,
        mesh_read_ms=_mesh_read_ms(subject.package, program.transfer, level),
        picture=_picture(bench, program, [drawn.counts for drawn in found]),
    )


def _ways(subject: Subject, program: PictureProgram, level: int) -> Iterator[SkippingWay]:
    """Return the ways, the plainest first, as the package draws last; fewer than two where nothing can be compared."""
    package, transfer = subject.package, program.transfer
    looks_at_tables = package.manifest.skips(program)
    at_mesh = ray_caster_of(package, level, transfer)
    drawers: list[tuple[WayName, WayName, type[Renderer]]] = [("neither", "table", Renderer)]
    if at_mesh is not Renderer:
        drawers.append(("mesh", "both", at_mesh))
    for alone, with_table, kind in drawers:
        own = kind(package, level=level, transfer=transfer).program
        without = unskipped(package, own)
        if without is None:
            return
        yield SkippingWay(alone, kind, without, kind(without, level=level, transfer=transfer).program)
        if looks_at_tables:
            yield SkippingWay(with_table, kind, package, own)


def _drawn(
    bench: Bench, way: SkippingWay, level: int, rays: Mapping[str, _Rays], known: Mapping[str, Float32Array]
) -> _Drawn:
    """Draw the rays of each view, except pictures of the same rays that are `known`."""
    subject = bench.subject
    pictures = {}
    with way.open(level) as renderer, bench.clock.part("drawing"):
        for name, (camera, shape_hw) in rays.items():
            is_known = name in known and known[name].shape[:2] == shape_hw
            pictures[name] = known[name] if is_known else renderer.render(camera, shape_hw)
    with bench.clock.part("counting"):
        return _Drawn(pictures, _counts(way, level, _counted(subject)))


def _rounding(
    bench: Bench, way: SkippingWay, level: int, rays: Mapping[str, _Rays], pictures: Mapping[str, Float32Array]
) -> float:
    """Return the largest change, in any view, of a picture whose rays are moved by rounding."""
    subject = bench.subject
    moved_mm = _MOVED * max(subject.grid.extent_mm_zyx)
    largest = 0.0
    with bench.clock.part("drawing"), way.open(level) as renderer:
        for name, (camera, shape_hw) in rays.items():
            for direction_xyz in _DIRECTIONS_XYZ:
                moved = camera.copy()
                moved[:3] += np.outer(np.array(direction_xyz) * moved_mm, camera[3])
                found = renderer.render(moved, shape_hw)
                largest = max(largest, _difference(subject, camera, found, pictures[name]))
    return largest


def _counts(way: SkippingWay, level: int, views: Sequence[_Rays]) -> Counts | None:
    try:
        return samples_of_views(way.package, way.program, level, views, kind=way.kind)
    except VolprepError as error:
        if error.code != NO_SUCH_TARGET:
            raise
        return None


def _views(subject: Subject, rays: Mapping[str, _Rays], drawn: _Drawn, plain: _Drawn) -> tuple[SavingView, ...]:
    return tuple(
        SavingView(
            view=name,
            samples_mean=_mean(subject, camera, drawn.counts[number][0]) if drawn.counts else None,
            looks_mean=_mean(subject, camera, drawn.counts[number][1]) if drawn.counts else None,
            difference=_difference(subject, rays[name][0], drawn.pictures[name], plain.pictures[name]),
        )
        for number, (name, camera) in enumerate(subject.views.items())
    )


def _mean(subject: Subject, camera: Float64Array, counted: Float64Array) -> float | None:
    """Return the mean over the rays that meet the volume; None if none does: a thin slab, seen from its edge."""
    met = counted[chords_mm(camera, counted.shape[:2], subject.grid) > 0]
    return float(met.mean()) if len(met) else None


def _difference(subject: Subject, camera: Float64Array, one: Float32Array, other: Float32Array) -> float:
    difference = largest_channel(np.abs(one - other))
    if subject.render.projection == "perspective":
        # Rounding may give a ray one sample more, which is neither better nor worse.
        chords = chords_mm(camera, one.shape[:2], subject.grid)
        difference = difference[settled(chords, subject.step_mm)]
    return float(difference.max(initial=0.0))


def _limit(subject: Subject) -> float:
    """One step of the target, its float32 rounding, and the opacity that the scene lets both leave out of a ray."""
    manifest = subject.package.manifest
    epsilons = [part.epsilon for part in (manifest.skipping, manifest.proxy) if part is not None]
    return _STEP_OF_TARGET + _NOISE + sum(epsilons)


def _counted(subject: Subject) -> list[_Rays]:
    """Return the rays whose samples are counted: in the view of the sweep, which the report shows, every fourth.

    In the others every 64th: they give the samples of a picture to a few percent. At least 32² rays are counted.
    """
    least = min(subject.shape_hw[0], _LEAST_COUNTED)
    sizes = {name: max(-(-subject.shape_hw[0] // (2 if name == SWEEP_VIEW else 8)), least) for name in subject.views}
    return [(camera, (sizes[name], sizes[name])) for name, camera in subject.views.items()]


def _mesh_read_ms(package: Package, transfer: str, level: int) -> float | None:
    meshes = package.manifest.proxy.meshes if package.manifest.proxy else ()
    file = next((mesh.file for mesh in meshes if (mesh.transfer, mesh.level) == (transfer, level)), None)
    if file is None:
        return None
    data = package.read_bytes(file)
    times = []
    for _ in range(_READS):
        start = time.perf_counter()
        read_glb(data, file)
        times.append((time.perf_counter() - start) * 1000)
    return median(times)


def _picture(bench: Bench, program: PictureProgram, counts: list[Counts | None]) -> str | None:
    """Write the samples of each pixel in the view of the sweep, the ways side by side."""
    view = list(bench.subject.views).index(SWEEP_VIEW)
    taken = [count[view][0] for count in counts if count is not None]
    if len(taken) < len(counts):
        return None
    name = f"{PICTURES}/{program.name}-samples.png"
    # Of the plainest way the longest ray is the brightest.
    bench.folder.picture(name, coloured(np.concatenate(taken, axis=1), 1 / max(float(taken[0].max()), 1.0)))
    return name
