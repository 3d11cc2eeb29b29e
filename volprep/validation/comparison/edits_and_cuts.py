"""Judge what users make of a package: tables of an edited transfer function, and a box cut out of level 0.

Both are drawn at random with the digest of the scan as seed, so that two validations of one package judge the same.

An editable package holds the inputs for new tables: the lookup table of each level, and the table of empty space. The
edited function keeps the shape of the scene's: its values are shifted, its colours exchanged, its extinctions lowered,
so that the scene's tolerance is fair. It is drawn at all levels in the three oblique views.

A cut is read from pieces or from the whole file. An app draws it like any volume, without a program of the package; so
the oracle draws its texels and the same box of the scan, in nine views.
"""

from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np

from volprep.parts.editing.inputs import FunctionEdit
from volprep.render.cut import Cut, cut
from volprep.render.renderer import Renderer
from volprep.render.renderers import renderer_of
from volprep.truth.camera import standard_views
from volprep.truth.labelled_decoded import joined
from volprep.truth.volume import Volume
from volprep.validation.bench import Bench
from volprep.validation.comparison.pixels import judged, judged_level, pixels_of
from volprep.validation.comparison.seen import width_pixels
from volprep.validation.results.seen import OtherDrawing, OtherView
from volprep.validation.subjects.subject import Subject
from volprep_formats.grid import Grid
from volprep_formats.package.program import PictureProgram
from volprep_formats.package.transfer_function import TransferFunction

OBLIQUE = ("anterior-left", "anterior-right", "posterior-left")
"""Views in which rays meet voxels at every angle."""
_SHIFT = 0.03
_CUT_VOXELS = 64


def judge_edit(bench: Bench, program: PictureProgram, previews: Collection[int]) -> Iterator[OtherDrawing]:
    """Draw an edited transfer function at all levels, if users may edit it; `previews` are levels for previews only."""
    subject = bench.subject
    if subject.package.manifest.editing is None or subject.is_of_several:
        return
    function = edited(subject.function(program.transfer), _chance(subject))
    with bench.clock.part("oracle"):
        truths = {name: subject.of_function(function, name).rgba.astype(np.float32) for name in OBLIQUE}
    levels = [level for level in subject.package.manifest.levels if level.index in subject.levels(program)]
    bench.progress.start(f"edited tables of {program.transfer}", len(levels))
    for level in levels:
        finest = level.index == min(program.levels)
        width = width_pixels(subject.cameras.values(), level.grid, subject.shape_hw[0])
        views: list[OtherView] = []
        with Renderer(
            subject.package, level=level.index, transfer=program.transfer, edit=FunctionEdit(function)
        ) as renderer:
            for name, truth in truths.items():
                with bench.clock.part("drawing"):
                    drawn = renderer.render(subject.views[name], subject.shape_hw)
                tolerance = subject.render.tolerance
                views.append(
                    judged(name, drawn, truth, tolerance, width)
                    if finest
                    else judged_level(name, drawn, truth, tolerance, subject, level)
                )
        yield OtherDrawing(
            item=f"level {level.index} with an edited {program.transfer}",
            program=renderer.program.name,
            level=level.index,
            preview_only=level.index in previews,
            excused=level.index in previews,
            pixels=subject.shape_hw[0] if finest else pixels_of(subject, level),
            views=tuple(views),
        )
        bench.progress.advance()


def judge_edited_slices(bench: Bench, transfer: str, name: str) -> Iterator[OtherDrawing]:
    """Draw the slices of `transfer` with the palettes of an edited function, if users may edit it."""
    subject = bench.subject
    if subject.package.manifest.editing is None:
        return
    function = edited(subject.function(transfer), _chance(subject))
    with bench.clock.part("oracle"):
        truths = {view: subject.of_function(function, view).rgba.astype(np.float32) for view in OBLIQUE}
    with renderer_of(subject.package, transfer=transfer, edit=FunctionEdit(function)) as renderer:
        level = renderer.level
        width = width_pixels(subject.cameras.values(), level.grid, subject.shape_hw[0])
        with bench.clock.part("drawing"):
            drawn = {view: renderer.render(subject.views[view], subject.shape_hw) for view in OBLIQUE}
    yield OtherDrawing(
        item=f"slices with the palettes of an edited {transfer}",
        program=name,
        level=level.index,
        pixels=subject.shape_hw[0],
        views=tuple(judged(view, drawn[view], truths[view], subject.render.tolerance, width) for view in OBLIQUE),
    )


def edited(function: TransferFunction, chance: np.random.Generator) -> TransferFunction:
    """Return a function of the same shape with other values, colours and extinctions, none of them larger."""
    first, last = function.points[0].value, function.points[-1].value
    shift = chance.uniform(-_SHIFT, _SHIFT) * (last - first)
    factor = chance.uniform(0.5, 0.9)
    turn = int(chance.integers(1, 3))
    points = tuple(
        point.model_copy(
            update={
                "value": point.value + shift,
                "colour": (*point.colour[turn:], *point.colour[:turn]),
                "extinction_per_mm": point.extinction_per_mm * factor,
            }
        )
        for point in function.points
    )
    return function.model_copy(update={"points": points})


def judge_cut(bench: Bench, transfer: str) -> Iterator[OtherDrawing]:
    """Cut a box out of level 0, if the package has sub-volumes, and compare it with the same box of the scan."""
    subject, manifest = bench.subject, bench.subject.package.manifest
    if manifest.subvolumes is None or (subject.is_of_several and manifest.segments is None):
        return
    found = random_cut(subject)
    record, taken = found.record, found.volume
    if found.numbers is not None:
        taken = replace(taken, stored=joined(taken.stored, found.numbers))
    with bench.clock.part("oracle"):
        truth = part_of_scan(subject, record.grid)
        views = []
        cameras = standard_views(record.grid, subject.render.projection)
        width = width_pixels(cameras.values(), record.grid, subject.shape_hw[0])
        for name, camera in cameras.items():
            matrix = camera.box_from_clip(record.grid, 1.0)
            pictures = [subject.through(value, transfer, matrix, subject.shape_hw).rgba for value in (taken, truth)]
            one, other = (picture.astype(np.float32) for picture in pictures)
            views.append(judged(name, one, other, subject.render.tolerance, width))
    at = ", ".join(str(start) for start in record.start_zyx[::-1])
    size = "×".join(str(n) for n in record.grid.shape_zyx[::-1])
    yield OtherDrawing(
        item=f"a cut of {size} voxels at {at} with {transfer}",
        program="oracle on its texels",
        level=None,
        pixels=subject.shape_hw[0],
        views=tuple(views),
    )


def random_cut(subject: Subject) -> Cut:
    """Cut a box around a voxel that chance chooses."""
    shape = subject.package.manifest.levels[0].grid.shape_zyx
    grid = subject.package.manifest.grid
    shape = shape if grid is None else grid.shape_zyx
    z, y, x = (int(n) for n in _chance(subject).integers(0, shape))
    return cut(subject.package, (x, y, z), _CUT_VOXELS)


def part_of_scan(subject: Subject, grid: Grid) -> Volume:
    """Return the same voxels of the scan, which may have a border that the package lost; with segments, joined ones."""
    scan = subject.scan
    start_xyz = (np.linalg.inv(scan.grid.world_from_index) @ [*grid.origin_mm_xyz, 1.0])[:3]
    z, y, x = (slice(round(start), round(start) + n) for start, n in zip(start_xyz[::-1], grid.shape_zyx, strict=True))
    stored = np.ascontiguousarray(subject.voxels((z, y, x)))
    return Volume(stored, grid, scan.slope, scan.intercept, scan.nearest)


def _chance(subject: Subject) -> np.random.Generator:
    return np.random.default_rng(int(subject.package.manifest.source.sha256[:16], 16))
