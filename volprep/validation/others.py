"""What a package ships beside its finest level: coarse levels and pieces of level 0, drawn and judged in nine views.

A coarse level is for pictures in which one of its voxels is about one pixel. There it is compared: both its picture and
the truth are drawn as large as those of the report, and averaged down to that size, so that neither owes its error to
which detail a pixel's centre happens to meet. Its rmse is judged, and its largest error only told: that is the error of
one pixel at an outline, where any smaller picture differs.

Pieces are drawn eight at a time, as a device holds them: blocks around points of the grid that share no cell and
together are the whole level, put together in the order in which rays meet them, and compared with the truth. Only light
that is emitted and absorbed can be put together like this. Of other pictures each block is compared with the same part
of the scan, small and in three views.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from volprep.render.choose import ray_caster_of
from volprep.render.renderer import Renderer
from volprep.truth.averaged import averaged
from volprep.truth.decoded import light_of_program
from volprep.truth.oracle import OraclePicture
from volprep.truth.part import picture_of_part
from volprep.validation.bench import Bench
from volprep.validation.edits_and_cuts import OBLIQUE, judge_cut, judge_edit, part_of_scan
from volprep.validation.pixels import Picture, judged, pixels_of
from volprep.validation.records import OtherDrawing, OtherView, ProgramResult
from volprep.validation.subject import Subject
from volprep.validation.views import ViewedProgram
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import Manifest, Tolerance
from volprep_formats.package.parts.subvolumes.places import ends_mm, sides_of, voxels_of
from volprep_formats.package.parts.subvolumes.record import Cuts, SubvolumeGrid, decode_grid
from volprep_formats.package.program import CompositingName, Program

Index = tuple[int, int, int]
_FAR = 1e6
"""Diagonals between a volume and where parallel rays come from."""
_LAID_OVER: frozenset[CompositingName] = frozenset(("emission-absorption", "back-to-front"))
"""Compositings whose pictures of blocks behind each other make that of the whole."""
_PIXELS_APART = 64
"""Width and height of the pictures of blocks that are compared one by one."""
_TILINGS = (1, 0)
"""First points of the blocks along each axis: both together hold points of every kind."""


def judge_others(bench: Bench, program: Program, viewed: ViewedProgram) -> tuple[OtherDrawing, ...]:
    """Draw coarse levels, pieces, edits and a cut with the transfer function of `program`, whose truth is known."""
    return (
        *_coarse_levels(bench, program, viewed),
        *_pieces(bench, program, viewed),
        *judge_edit(bench, program),
        *judge_cut(bench, program.transfer),
    )


def _coarse_levels(bench: Bench, program: Program, viewed: ViewedProgram) -> Iterator[OtherDrawing]:
    subject = bench.subject
    wanted = [index for index in subject.levels(program) if index != viewed.level]
    levels = [level for level in subject.package.manifest.levels if level.index in wanted]
    bench.progress.start(f"coarse levels of {program.transfer}", len(levels))
    for level in levels:
        kinds: tuple[type[Renderer], ...] = (ray_caster_of(subject.package, level.index, program.transfer), Renderer)
        for kind in dict.fromkeys(kinds):
            yield _coarse_level(bench, kind(subject.package, level=level.index, transfer=program.transfer), viewed)
        bench.progress.advance()


def _coarse_level(bench: Bench, chosen: Renderer, viewed: ViewedProgram) -> OtherDrawing:
    subject = bench.subject
    pixels = pixels_of(subject, chosen.level)
    allowed = Tolerance(rmse=subject.render.tolerance.rmse, maximum=1.0)
    views = []
    with chosen as renderer:
        for name, box_from_clip in subject.views.items():
            with bench.clock.part("drawing"):
                drawn = renderer.render(box_from_clip, subject.shape_hw)
            views.append(judged(name, averaged(drawn, pixels), averaged(viewed.truths[name], pixels), allowed))
    return OtherDrawing(
        item=f"level {chosen.level.index} with {chosen.program.transfer}",
        program=chosen.program.name,
        level=chosen.level.index,
        preview_only=bool(chosen.level.preview_only),
        pixels=pixels,
        views=tuple(views),
    )


def _pieces(bench: Bench, program: Program, viewed: ViewedProgram) -> Iterator[OtherDrawing]:
    subject = bench.subject
    files = subject.package.manifest.subvolumes
    own = next((each for each in files.programs if each.transfer == program.transfer), None) if files else None
    if files is None or own is None:
        return
    grid = decode_grid(subject.package.read_bytes(files.grid), subject.package.path, files.grid)
    lit = _light_of(program, own)
    truths = viewed.truths if lit == "" else _lit_as(bench, own)
    apart = own.compositing not in _LAID_OVER
    for first in _TILINGS:
        blocks = [*_blocks(grid, first)]
        bench.progress.start(f"pieces of {program.transfer}", len(blocks))
        if apart:
            views = _each_apart(bench, own, grid, [point for point, _ in blocks])
        else:
            views = tuple(
                judged(name, picture, truths[name], subject.render.tolerance)
                for name, picture in _put_together(bench, own, grid, first, blocks)
            )
        yield OtherDrawing(
            item=f"pieces around points {first}, {first + 2}, ... with {program.transfer}{lit}",
            program=own.name,
            level=0,
            pixels=min(subject.shape_hw[0], _PIXELS_APART) if apart else subject.shape_hw[0],
            views=views,
        )


def _each_apart(bench: Bench, program: Program, grid: SubvolumeGrid, points: Sequence[int]) -> tuple[OtherView, ...]:
    """Compare each block with the same part of the scan; each view tells of the block that is farthest off."""
    subject = bench.subject
    pixels = min(subject.shape_hw[0], _PIXELS_APART)
    found: dict[str, list[OtherView]] = {name: [] for name in OBLIQUE}
    for point in points:
        with Renderer(subject.package, point=point, transfer=program.transfer) as renderer:
            for name, views in found.items():
                with bench.clock.part("oracle"):
                    truth = _block_of_scan(subject, grid, point, program.transfer, name, pixels)
                with bench.clock.part("drawing"):
                    drawn = renderer.render(subject.views[name], (pixels, pixels))
                views.append(judged(name, drawn, truth, subject.render.tolerance))
        bench.progress.advance()
    return tuple(
        OtherView(
            view=name,
            passed=all(view.passed for view in views),
            rmse=max(view.rmse for view in views),
            maximum=max(view.maximum for view in views),
        )
        for name, views in found.items()
    )


def _block_of_scan(  # noqa: PLR0917 - which block, and how it is seen
    subject: Subject, grid: SubvolumeGrid, point: int, transfer: str, view: str, pixels: int
) -> Picture:
    sides = sides_of(grid, point)
    level_grid = subject.package.manifest.grid or subject.grid
    volume = part_of_scan(subject, level_grid.part(*voxels_of(sides)))

    def draw(stored: NDArray[np.generic], part: Grid, matrix: Float64Array, shape_hw: tuple[int, int]) -> OraclePicture:
        return subject.through(replace(volume, stored=stored, grid=part), transfer, matrix, shape_hw)

    matrix = subject.cameras[view].box_from_clip(volume.grid, 1.0)
    ends = ends_mm(sides, volume.grid.spacing_mm_zyx)
    picture = picture_of_part(draw, volume.stored, volume.grid, matrix, (pixels, pixels), ends)
    return picture.rgba.astype(np.float32)


def _light_of(program: Program, own: Program) -> str:
    """Return how the light on pieces differs from that on the whole; nothing where it does not."""
    if own.lighting != program.lighting:
        return ", without light"
    return "" if own.normals_from == program.normals_from else f", lit by {own.normals_from} differences"


def _lit_as(bench: Bench, own: Program) -> dict[str, Picture]:
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
    bench: Bench, program: Program, grid: SubvolumeGrid, first: int, blocks: Sequence[tuple[int, Index]]
) -> Iterator[tuple[str, Picture]]:
    """Draw all blocks in all views, each block once, and put each view together from front to back."""
    subject = bench.subject
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
            picture += (1 - picture[..., 3:]) * drawn[name, place]
        yield name, picture


def _front_to_back(
    subject: Subject, box_from_clip: NDArray[np.float64], between_zyx: Sequence[Cuts], places: Sequence[Index]
) -> list[Index]:
    """Return the blocks in the order in which rays meet them: by their steps from the block that the eye is at.

    `between_zyx` are the voxels at which a block ends and the next begins, along each axis.
    """
    near, far = (box_from_clip @ [0.0, 0.0, depth, 1.0] for depth in (-1.0, 1.0))
    eye, ahead = near[:3] / near[3], far[:3] / far[3] - near[:3] / near[3]
    if subject.render.projection == "orthographic":
        eye = eye - _FAR * ahead
    voxel_zyx = eye[::-1] / subject.grid.spacing_mm_zyx - 0.5
    at = [int(np.searchsorted(cuts, voxel)) for cuts, voxel in zip(between_zyx, voxel_zyx, strict=True)]
    return sorted(places, key=lambda place: sum(abs(k - start) for k, start in zip(place, at, strict=True)))


def unproved(manifest: Manifest, results: Sequence[ProgramResult]) -> tuple[str, ...]:
    """Return what of a package `results` have not drawn: programs with their levels, by their names."""
    drawn: set[tuple[str, int | None]] = {(each.program, each.level) for each in results}
    drawn |= {(other.program, other.level) for each in results for other in each.others}
    drawn |= {(each.empty_space.drawn_by, each.level) for each in results if each.empty_space is not None}
    pieces = () if manifest.subvolumes is None else manifest.subvolumes.programs
    at_meshes = () if manifest.proxy is None else manifest.proxy.programs
    every = [(each.name, level) for each in (*manifest.programs, *pieces, *at_meshes) for level in each.levels]
    return tuple(f"program {name} at level {level}" for name, level in every if (name, level) not in drawn)
