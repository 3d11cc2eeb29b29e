"""What a package ships beside its finest level: coarse levels and pieces of level 0, drawn and judged in nine views.

A coarse level is for pictures in which one of its voxels is about one pixel. There it is compared: both its picture and
the truth are drawn as large as those of the report, and averaged down to that size, so that neither owes its error to
which detail a pixel's centre happens to meet. Its rmse is judged, and its largest error only told: that is the error of
one pixel at an outline, where any smaller picture differs.

Pieces are drawn eight at a time, as a device holds them: blocks around points of the grid that share no cell and
together are the whole level, put together in the order in which rays meet them, and compared with the truth.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from volprep.plan.probe import difference
from volprep.render.choose import ray_caster_of
from volprep.render.renderer import Renderer
from volprep.validation.bench import Bench
from volprep.validation.records import OtherDrawing, OtherView, ProgramResult
from volprep.validation.subject import Subject
from volprep.validation.views import ViewedProgram
from volprep_formats.package.channel import Level
from volprep_formats.package.manifest import Manifest, Tolerance
from volprep_formats.package.parts.subvolumes.record import Cuts, SubvolumeGrid, decode_grid
from volprep_formats.package.program import Program

Picture = NDArray[np.float32]
Index = tuple[int, int, int]
_FAR = 1e6
"""Diagonals between a volume and where parallel rays come from."""
_TILINGS = (1, 0)
"""First points of the blocks along each axis: both together hold points of every kind."""


def judge_others(bench: Bench, program: Program, viewed: ViewedProgram) -> tuple[OtherDrawing, ...]:
    """Draw coarse levels, and pieces, with the transfer function of `program`, whose truth is known."""
    return (*_coarse_levels(bench, program, viewed), *_pieces(bench, program, viewed))


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
    pixels = _pixels(subject, chosen.level)
    allowed = Tolerance(rmse=subject.render.tolerance.rmse, maximum=1.0)
    views = []
    with chosen as renderer:
        for name, box_from_clip in subject.views.items():
            with bench.clock.part("drawing"):
                drawn = renderer.render(box_from_clip, subject.shape_hw)
            views.append(_judged(name, _averaged(drawn, pixels), _averaged(viewed.truths[name], pixels), allowed))
    return OtherDrawing(
        item=f"level {chosen.level.index} with {chosen.program.transfer}",
        program=chosen.program.name,
        pixels=pixels,
        views=tuple(views),
    )


def _pixels(subject: Subject, level: Level) -> int:
    """Return the size of pictures in which a voxel of the level is a pixel, or less than one.

    Half of that of the report at most, so that each pixel is the mean of four rays at least.
    """
    # Orthographic standard views have the height of the diagonal; in perspective it is a fifth more.
    voxels = math.hypot(*level.grid.extent_mm_zyx) / min(level.grid.spacing_mm_zyx)
    return max(1, min(subject.shape_hw[0] // 2, round(voxels)))


def _averaged(picture: NDArray[np.floating], pixels: int) -> Picture:
    """Return the means of a square picture over larger pixels, whose edges may lie within one of its own."""
    size = len(picture)
    edges = np.linspace(0.0, size, pixels + 1)
    own = np.arange(size)
    overlap = np.minimum(edges[1:, None], own + 1) - np.maximum(edges[:-1, None], own)
    weights = np.clip(overlap, 0.0, None) * (pixels / size)
    averaged: Picture = np.einsum("ih,hwc,jw->ijc", weights, picture, weights, optimize=True).astype(np.float32)
    return averaged


def _pieces(bench: Bench, program: Program, viewed: ViewedProgram) -> Iterator[OtherDrawing]:
    subject = bench.subject
    files = subject.package.manifest.subvolumes
    own = next((each for each in files.programs if each.transfer == program.transfer), None) if files else None
    if files is None or own is None:
        return
    grid = decode_grid(subject.package.read_bytes(files.grid), subject.package.path, files.grid)
    truths = viewed.truths if own.lighting == program.lighting else _unlit(bench, program.transfer)
    for first in _TILINGS:
        blocks = [*_blocks(grid, first)]
        bench.progress.start(f"pieces of {program.transfer}", len(blocks))
        views = tuple(
            _judged(name, picture, truths[name], subject.render.tolerance)
            for name, picture in _put_together(bench, own, grid, first, blocks)
        )
        yield OtherDrawing(
            item=f"pieces around points {first}, {first + 2}, ... with {program.transfer}",
            program=own.name,
            pixels=subject.shape_hw[0],
            views=views,
        )


def _unlit(bench: Bench, transfer: str) -> dict[str, Picture]:
    """Draw the truth without light: pieces have no normals."""
    subject = bench.subject
    scan = replace(subject.scan, normals=None)
    with bench.clock.part("oracle"):
        return {name: subject.on_volume(scan, transfer, name).rgba.astype(np.float32) for name in subject.views}


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


def _judged(view: str, drawn: Picture, truth: Picture, tolerance: Tolerance) -> OtherView:
    found = difference(drawn.astype(np.float64), truth.astype(np.float64))
    passed = found.rmse <= tolerance.rmse and found.maximum <= tolerance.maximum
    return OtherView(view=view, passed=passed, rmse=found.rmse, maximum=found.maximum)


def unproved(manifest: Manifest, results: Sequence[ProgramResult]) -> tuple[str, ...]:
    """Return the programs of a package that `results` have not drawn, by their names."""
    drawn = {each.program for each in results} | {other.program for each in results for other in each.others}
    drawn |= {each.empty_space.drawn_by for each in results if each.empty_space is not None}
    pieces = () if manifest.subvolumes is None else manifest.subvolumes.programs
    at_meshes = () if manifest.proxy is None else manifest.proxy.programs
    every = (*manifest.programs, *pieces, *at_meshes)
    return tuple(f"program {each.name}" for each in every if each.name not in drawn)
