"""Draw and judge coarse levels and pieces of level 0 in nine views.

A coarse level is for pictures in which one of its voxels is about one pixel. It is compared at that size: its picture
and the truth are drawn as large as in the report, and averaged down, so that the error of neither depends on
which detail a pixel's centre happens to meet. With one ray for such a pixel level 0 itself is beyond every tolerance:
0.04 to 0.06 on eight scans, as much as level 1. The box reference (references.py) is treated the same way: no level may
be worse. The report also has the size of the largest picture in which a level is within its tolerance.

A level for previews has a tolerance of its own. It may be beyond it only if the reference is. The reference is drawn in
three views; if none of them excuses a level that is beyond, it is also drawn in the level's worst view.

Pieces are drawn eight at a time, as a device holds them: blocks around points of the grid that share no cell and
together are the whole level, composited in the order in which rays meet them, and compared with the truth. Only
emission and absorption and first hits can be composited like this. For other pictures each block is compared with the
same part of the scan, small and in three views.
"""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from volprep.parts.subvolumes.decision import PUT_TOGETHER
from volprep.render.renderer import Renderer
from volprep.render.renderers import ray_caster_of
from volprep.truth.decoded import light_of_program
from volprep.truth.oracle import DEFAULT_TOLERANCE
from volprep.truth.part import picture_of_part
from volprep.validation.bench import Bench
from volprep.validation.comparison.edits_and_cuts import OBLIQUE, judge_cut, judge_edit, part_of_scan
from volprep.validation.comparison.kept_light import kept_light
from volprep.validation.comparison.on_demand import judge_on_demand
from volprep.validation.comparison.pixels import Picture, errors_by_size, judged, judged_level, pixels_of
from volprep.validation.comparison.references import REFERENCE_VIEWS, References, reference_view
from volprep.validation.comparison.seen import width_pixels
from volprep.validation.comparison.views import ViewedProgram
from volprep.validation.results.measurements import ProgramResult
from volprep.validation.results.seen import (
    FullSize,
    KeptLight,
    OtherDrawing,
    OtherView,
    SeenNumbers,
    as_order,
    least_light,
)
from volprep.validation.subjects.subject import Subject
from volprep.validation.verdicts.verdict import may_be_preview, share_of
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import Level
from volprep_formats.package.manifest import Manifest, Tolerance
from volprep_formats.package.parts.subvolumes.places import ends_mm, sides_of, voxels_of
from volprep_formats.package.parts.subvolumes.record import Cuts, SubvolumeGrid, decode_grid
from volprep_formats.package.program import PictureProgram

Index = tuple[int, int, int]
_FAR = 1e6
"""Distance of the origin of parallel rays from the volume, in diagonals."""
_PIXELS_APART = 64
"""Width and height of the pictures of blocks that are compared one by one."""
_NEAR = 0.05
"""Distance from a limit, as a share of it, in which the truth of a level is sharp: a drafted one moves RMSE by a
hundredth of the usual tolerance at most, and averages of pixels by less."""
_TILINGS = (1, 0)
"""First points of the blocks along each axis: both together hold points of every kind."""


def judge_others(
    bench: Bench, program: PictureProgram, viewed: ViewedProgram, references: References
) -> tuple[tuple[OtherDrawing, ...], tuple[KeptLight, ...]]:
    """Draw coarse levels, pieces, edits and a cut with the transfer function of `program`, whose truth is known.

    Return them, and where each coarse level keeps the least light of a thin thing.
    """
    levels = _coarse_levels(bench, program, viewed, references)
    drawings = [drawing for drawing, _ in levels]
    previews = {drawing.level for drawing in drawings if drawing.preview_only and drawing.level is not None}
    others = (
        *drawings,
        *_pieces(bench, program, viewed),
        *judge_on_demand(bench, program, viewed),
        *judge_edit(bench, program, previews),
        *judge_cut(bench, program.transfer),
    )
    return others, tuple(kept for _, kept in levels if kept is not None)


def _coarse_levels(
    bench: Bench, program: PictureProgram, viewed: ViewedProgram, references: References
) -> list[tuple[OtherDrawing, KeptLight | None]]:
    subject = bench.subject
    wanted = [index for index in subject.levels(program) if index != viewed.level]
    levels = [level for level in subject.package.manifest.levels if level.index in wanted]
    bench.progress.start(f"coarse levels of {program.transfer}", len(levels))
    found: list[Future[tuple[OtherDrawing, KeptLight | None]]] = []
    # Comparing leaves other processors idle: two comparisons run while the next level is drawn.
    with ThreadPoolExecutor(2) as beside:
        for level in levels:
            reference = references.get((program.transfer, level.index))
            boxes = beside.submit(_boxes, bench, viewed, level, reference or {})
            kind = ray_caster_of(subject.package, level.index, program.transfer)
            kinds: tuple[type[Renderer], ...] = (kind, Renderer)
            for fromkey in dict.fromkeys(kinds):
                renderer = fromkey(subject.package, level=level.index, transfer=program.transfer)
                with renderer, bench.clock.part("drawing"):
                    pictures = {
                        name: renderer.render(camera, subject.shape_hw) for name, camera in subject.views.items()
                    }
                found.append(beside.submit(_coarse_level, bench, renderer, viewed, pictures, boxes, reference))
            bench.progress.advance()
        return [view.result() for view in found]


@dataclass(frozen=True)
class _Box:
    """Errors of the box reference in one view."""

    seen: SeenNumbers
    """Where a voxel of the level is a pixel."""
    full: FullSize | None
    """In pictures as large as the report's."""


def _boxes(bench: Bench, viewed: ViewedProgram, level: Level, drawn: Mapping[str, Float64Array]) -> dict[str, _Box]:
    """Compare the box reference of a level with the truth as the level is compared."""
    with bench.clock.part("comparing"):
        found = [
            judged_level(name, box.astype(np.float32), viewed.truths[name], Tolerance(), bench.subject, level)
            for name, box in drawn.items()
        ]
    return {view.view: _Box(view.seen, view.full) for view in found}


def _coarse_level(  # noqa: PLR0917 - pictures, and their references
    bench: Bench,
    chosen: Renderer,
    viewed: ViewedProgram,
    pictures: Mapping[str, Picture],
    boxes_in_views: Future[dict[str, _Box]],
    box_pictures: Mapping[str, Float64Array] | None,
) -> tuple[OtherDrawing, KeptLight | None]:
    """Judge the pictures of a level; `chosen`, which is closed, has drawn them."""
    subject, level, boxes = bench.subject, chosen.level, boxes_in_views.result()
    tolerance = subject.render.tolerance
    is_preview = level.index in subject.package.manifest.previews and _excuse(boxes, tolerance)
    if is_preview:
        tolerance = tolerance.of_previews

    def judged_views() -> list[OtherView]:
        with bench.clock.part("comparing"):
            return [
                judged_level(name, drawn, viewed.truths[name], tolerance, subject, level, box_pictures)
                for name, drawn in pictures.items()
            ]

    found = judged_views()
    if unsure := _unsure(viewed, found, tolerance):
        with bench.clock.part("oracle"):
            sharp = {name: subject.truth(chosen.program.transfer, name).rgba.astype(np.float32) for name in unsure}
        viewed = replace(viewed, truths={**viewed.truths, **sharp})
        found = judged_views()
    if is_preview and not _excuse(boxes, tolerance):
        boxes = {**boxes, **_box_in_worst_view(bench, viewed, chosen, found)}
    with bench.clock.part("comparing"):
        sizes = errors_by_size(pictures, viewed.truths, found, tolerance, subject, level)
    views = tuple(_with_box(view, boxes.get(view.view)) for view in found)
    drawing = OtherDrawing(
        item=f"level {level.index} with {chosen.program.transfer}",
        program=chosen.program.name,
        level=level.index,
        preview_only=is_preview,
        excused=is_preview and _excuse(boxes, tolerance),
        pixels=pixels_of(subject, level),
        sizes=sizes,
        right_up_to_pixels=next((size.pixels for size in sizes if size.passed), None),
        styles=subject.kept_styles(level, tolerance.kept_light),
        views=views,
    )
    return drawing, _least_kept(bench, chosen, views, pictures, viewed)


def _unsure(viewed: ViewedProgram, found: Sequence[OtherView], tolerance: Tolerance) -> list[str]:
    """Return the views with a drafted truth in which a level is so near a limit that a sharper one might decide."""
    allowed = tolerance.model_copy(update={"maximum": 1.0})
    drafted = {view.view for view in viewed.views if view.truth_bound > DEFAULT_TOLERANCE}
    near = (view.view for view in found if abs(share_of(view.seen, allowed) - 1.0) < _NEAR)
    return [name for name in near if name in drafted]


def _excuse(boxes: Mapping[str, _Box], tolerance: Tolerance) -> bool:
    """Return whether box means are beyond the tolerance in a view."""
    return may_be_preview([box.seen for box in boxes.values()], tolerance)


def _with_box(view: OtherView, box: _Box | None) -> OtherView:
    return view if box is None else view.model_copy(update={"box": box.seen, "box_full": box.full})


def _least_kept(
    bench: Bench, chosen: Renderer, views: Sequence[OtherView], pictures: Mapping[str, Picture], viewed: ViewedProgram
) -> KeptLight | None:
    """Write the place that keeps the least light in large pictures, which show more thin things than small ones."""
    full = {view.view: view.full for view in views if view.full is not None}
    least = min(full, key=lambda name: as_order(full[name]))
    shown = (pictures[least], viewed.truths[least])
    box = least_light(view.box_full.kept_light for view in views if view.box_full is not None)
    return kept_light(bench.folder, chosen.program.name, chosen.level.index, least, full[least], shown, box)


def _box_in_worst_view(
    bench: Bench, viewed: ViewedProgram, chosen: Renderer, found: Sequence[OtherView]
) -> dict[str, _Box]:
    """Compare the box reference with the truth in the view in which the level is furthest beyond; none if in no view.

    Not in a view in which it was drawn: there it is within.
    """
    tolerance = bench.subject.render.tolerance.of_previews
    beyond = [view for view in found if not view.passed]
    worst = max(beyond, key=lambda view: share_of(view.seen, tolerance), default=None)
    if worst is None or worst.view in REFERENCE_VIEWS:
        return {}
    with bench.clock.part("oracle"):
        box = reference_view(bench.subject, chosen.level, chosen.program.transfer, worst.view)
    return _boxes(bench, viewed, chosen.level, {worst.view: box})


def _pieces(bench: Bench, program: PictureProgram, viewed: ViewedProgram) -> Iterator[OtherDrawing]:
    subject = bench.subject
    files = subject.package.manifest.subvolumes
    picture = subject.package.manifest.picture(program.transfer)
    if files is None or picture is None or picture.pieces is None:
        return
    own = subject.package.manifest.picture_program(picture.pieces.program, picture)
    grid = decode_grid(subject.package.read_bytes(files.grid), subject.package.path, files.grid)
    lit = _light_of(program, own)
    truths = viewed.truths if lit == "" else _lit_as(bench, own)
    apart = own.compositing not in PUT_TOGETHER
    width = width_pixels(subject.cameras.values(), subject.grid, subject.shape_hw[0])
    for first in _TILINGS:
        blocks = [*_blocks(grid, first)]
        bench.progress.start(f"pieces of {program.transfer}", len(blocks))
        if apart:
            views = _each_apart(bench, own, grid, [point for point, _ in blocks])
        else:
            views = tuple(
                judged(name, picture, truths[name], subject.render.tolerance, width)
                for name, picture in _put_together(bench, own, grid, first, blocks)
            )
        yield OtherDrawing(
            item=f"pieces around points {first}, {first + 2}, ... with {program.transfer}{lit}",
            program=own.name,
            level=0,
            pixels=min(subject.shape_hw[0], _PIXELS_APART) if apart else subject.shape_hw[0],
            views=views,
        )


def _each_apart(
    bench: Bench, program: PictureProgram, grid: SubvolumeGrid, points: Sequence[int]
) -> tuple[OtherView, ...]:
    """Compare each block with the same part of the scan; each view reports the block with the largest error."""
    subject = bench.subject
    pixels = min(subject.shape_hw[0], _PIXELS_APART)
    width = width_pixels(subject.cameras.values(), subject.grid, pixels)
    found: dict[str, list[OtherView]] = {name: [] for name in OBLIQUE}
    for point in points:
        with Renderer(subject.package, point=point, transfer=program.transfer) as renderer:
            for name, views in found.items():
                with bench.clock.part("oracle"):
                    truth = _block_of_scan(subject, grid, point, program.transfer, name, pixels)
                with bench.clock.part("drawing"):
                    drawn = renderer.render(subject.views[name], (pixels, pixels))
                views.append(judged(name, drawn, truth, subject.render.tolerance, width))
        bench.progress.advance()
    return tuple(max(views, key=lambda view: share_of(view.seen, subject.render.tolerance)) for views in found.values())


def _block_of_scan(  # noqa: PLR0917 - which block, and how it is seen
    subject: Subject, grid: SubvolumeGrid, point: int, transfer: str, view: str, pixels: int
) -> Picture:
    sides = sides_of(grid, point)
    level_grid = subject.package.manifest.grid or subject.grid
    volume = part_of_scan(subject, level_grid.part(*voxels_of(sides)))
    matrix = subject.cameras[view].box_from_clip(volume.grid, 1.0)
    ends = ends_mm(sides, volume.grid.spacing_mm_zyx)
    picture = picture_of_part(
        lambda part, camera, shape_hw: subject.through(part, transfer, camera, shape_hw),
        volume,
        matrix,
        (pixels, pixels),
        ends,
    )
    return picture.rgba.astype(np.float32)


def _light_of(program: PictureProgram, own: PictureProgram) -> str:
    """Return the difference between the light on pieces and on the whole, or an empty list."""
    if own.lighting != program.lighting:
        return ", without light"
    return "" if own.normals_from == program.normals_from else f", lit by {own.normals_from} differences"


def _lit_as(bench: Bench, own: PictureProgram) -> dict[str, Picture]:
    """Draw the truth with the light that falls on pieces."""
    subject = bench.subject
    light = None if own.lighting == "none" else light_of_program(subject.package.manifest, own)
    scan = replace(subject.scan, normals=light)
    with bench.clock.part("oracle"):
        return {name: subject.on_volume(scan, own.transfer, name).rgba.astype(np.float32) for name in subject.views}


def _blocks(grid: SubvolumeGrid, first: int) -> Iterator[tuple[int, Index]]:
    """Return points whose blocks share no cell and fill the level, with the place of each block among the blocks."""
    counts = grid.counts_zyx
    along = [[*enumerate(range(first, count + 1, 2))] for count in counts]
    for (k, z), (j, y), (i, x) in product(*along):
        yield int(np.ravel_multi_index((z, y, x), [count + 1 for count in counts])), (k, j, i)


def _put_together(
    bench: Bench, program: PictureProgram, grid: SubvolumeGrid, first: int, blocks: Sequence[tuple[int, Index]]
) -> Iterator[tuple[str, Picture]]:
    """Draw all blocks in all views, each block once, and put each view together from front to back."""
    subject, is_first = bench.subject, program.compositing == "first-hit"
    drawn: dict[tuple[str, Index], Picture] = {}
    for point, place in blocks:
        with Renderer(subject.package, point=point, transfer=program.transfer) as renderer, bench.clock.part("drawing"):
            for name, box_from_clip in subject.views.items():
                drawn[name, place] = renderer.render(box_from_clip, subject.shape_hw)
        bench.progress.advance()
    places = [place for _, place in blocks]
    for name, box_from_clip in subject.views.items():
        picture = np.zeros((*subject.shape_hw, 4), np.float32)
        for place in _front_to_back(subject, box_from_clip, [cuts[first + 1 :: 2] for cuts in grid.cuts_zyx], places):
            # A hit hides everything behind it, however transparent it is.
            through = picture[..., 3:] == 0.0 if is_first else 1 - picture[..., 3:]
            picture += through * drawn[name, place]
        yield name, picture


def _front_to_back(
    subject: Subject, box_from_clip: NDArray[np.float64], between_zyx: Sequence[Cuts], places: Sequence[Index]
) -> list[Index]:
    """Return the blocks in the order in which rays meet them: by their distance in blocks from the block of the eye.

    `between_zyx` are the voxels between one block and the next, along each axis.
    """
    near, far = (box_from_clip @ [0.0, 0.0, depth, 1.0] for depth in (-1.0, 1.0))
    eye, ahead = near[:3] / near[3], far[:3] / far[3] - near[:3] / near[3]
    if subject.render.projection == "orthographic":
        eye = eye - _FAR * ahead
    voxel_zyx = eye[::-1] / subject.grid.spacing_mm_zyx - 0.5
    at = [int(np.searchsorted(cuts, voxel)) for cuts, voxel in zip(between_zyx, voxel_zyx, strict=True)]
    return sorted(places, key=lambda place: sum(abs(k - start) for k, start in zip(place, at, strict=True)))


def unproved(manifest: Manifest, results: Sequence[ProgramResult]) -> tuple[str, ...]:
    """Return the programs of a package, with levels, that `results` have not drawn, by their names."""
    drawn: set[tuple[str, int | None]] = {(result.program, result.level) for result in results}
    drawn |= {(other.program, other.level) for result in results for other in result.others}
    drawn |= {(result.empty_space.drawn_by, result.level) for result in results if result.empty_space is not None}
    every = [(drawing.program, drawing.level) for _, drawing in manifest.drawings if drawing.program is not None]
    every += [
        (drawing.at_mesh.program, drawing.level) for _, drawing in manifest.drawings if drawing.at_mesh is not None
    ]
    beside = (value for picture in manifest.pictures for value in (picture.pieces, picture.on_demand))
    every += [(part.program, 0) for part in beside if part is not None]
    return tuple(f"program {name} at level {level}" for name, level in every if (name, level) not in drawn)
