"""Progressive pictures, finished while people look at them (Díaz-García et al. 2018, section 4).

While the view changes, an app draws a coarse level in few pixels and enlarges them with a filter. When it rests, the
picture is drawn part by part, within the time of a frame, and replaces that low resolution. Pixels replace enlarged
pixels. Slabs cover the nearer part of all rays, and everything behind them stays in low resolution until its slab is
drawn. A pixel has the same samples as in a picture that is drawn at once: the choice and order of the parts change no
pixel of the final picture.
"""

import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import islice
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep.render.gl_records import PicturePart
from volprep.render.renderer import Renderer
from volprep.render.timing import Clock
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.reader import Package

Order = Literal["classic", "slabs", "tiles", "random", "structured"]
"""How a picture is finished. classic: at once. slabs: some samples of all rays at a time, for a program with slabs.
tiles: tile by tile, cheapest first, for a program that sorts them. random, structured: single pixels from all over the
picture, in random order, or in the order of a grid that gets finer."""

FEWER = 4
"""Factor of the low resolution: it divides the number of pixels along both axes, and multiplies the step."""
REFINEMENTS = 16
"""Parts of the pixels of `random` and `structured`."""
_MOST_FRAMES = 64
"""Of a picture that is finished by tiles: what a frame takes beside its tiles is more than smaller shares of them."""
_DRAWN = np.float32(0.5)
"""Number of the pixels of a part that is drawn alone."""
_LEAST = 1e-12
"""Milliseconds of a cost where a clock with coarse steps sees none."""
_GRID = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]])
"""Order of the pixels of 4×4: each is as far as possible from the earlier ones."""
_SEED = 4


@dataclass(frozen=True)
class ShownFrame:
    """Picture that a user sees at one time."""

    picture: Float32Array
    """[H, W, 4] as `Renderer.render` gives it."""
    finished: float
    """Part of the picture's pixels, or of its samples along a ray, that is finished."""
    ms: float
    """Milliseconds that drawing took since the frame before, without reading it back."""


def coarse_level(package: Package, transfer: str | None = None) -> int | None:
    """Return the level of the low resolution: the coarsest whose voxels are at most `FEWER` of the finest, if any."""
    programs = package_of_transfer(package, transfer).manifest.level_programs
    held = {index for program in programs[:1] for index in program.levels}
    levels = [level for level in package.manifest.levels if level.index in held]
    if not levels:
        return None
    finest = np.array(min(levels, key=lambda level: level.index).grid.spacing_mm_zyx)
    fit = [level.index for level in levels if (np.array(level.grid.spacing_mm_zyx) <= finest * (FEWER + 0.01)).all()]
    return max(fit, default=None)


def low_resolution(
    renderer: Renderer, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float
) -> Float32Array:
    """Draw a picture for a view that changes: `FEWER` times fewer pixels, enlarged with a bilinear filter.

    Raises VP5009 and VP5019 as `Renderer.render`.
    """
    small_hw = -(-shape_hw[0] // FEWER), -(-shape_hw[1] // FEWER)
    return _enlarged(renderer.render(box_from_clip, small_hw, step_mm * FEWER), shape_hw)


def _behind(
    coarse: Renderer, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float, samples: int
) -> None:
    """Draw everything behind this number of samples of `step_mm`: a coarse level with longer steps, in all pixels.

    With half of the pixels along each axis this takes a quarter of the time, but silhouettes blur, and the DSSIM of an
    MR from above rises by up to 4e-5 from one slab to the next; with a quarter by 6e-4. With all pixels it never does.
    """
    for _ in coarse.draw_slabs(box_from_clip, shape_hw, step_mm * FEWER, first_sample=samples / FEWER):
        pass
    coarse.finish()


def _enlarged(small: Float32Array, shape_hw: tuple[int, int]) -> Float32Array:
    """Enlarge a picture [h, w, 4] with a bilinear filter, as a GPU shows a small texture; edges are repeated."""
    found = small
    for axis, size in enumerate(shape_hw):
        count = small.shape[axis]
        at = np.clip((np.arange(size) + 0.5) * count / size - 0.5, 0, count - 1)
        low = np.floor(at).astype(np.intp)
        share = (at - low).astype(np.float32).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        high = np.minimum(low + 1, count - 1)
        found = found.take(low, axis) * (1 - share) + found.take(high, axis) * share
    return np.ascontiguousarray(found)


def frames(
    renderer: Renderer,
    order: Order,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    step_mm: float,
    *,
    budget_s: float = 0.1,
    clock: Clock = time.perf_counter,
    coarse: Renderer | None = None,
) -> Iterator[ShownFrame]:
    """Draw a picture frame by frame, each in about `budget_s`. The first is that of a view that changes.

    `coarse` draws the low resolution: an open renderer of a coarse level, `coarse_level`; if absent, `renderer` does.
    `clock` returns the time in seconds. Raises VP5041 for an order that the program does not have, and the errors of
    `Renderer.render`.
    """
    if order == "slabs" and renderer.program.slab_samples is None:
        raise VolprepError("VP5041", technique=renderer.program.technique)
    drawing, coarse = _Drawing(renderer, box_from_clip, shape_hw, step_mm, budget_s * 1000, clock), coarse or renderer
    if order == "classic":
        renderer.draw(box_from_clip, shape_hw, step_mm)
        ms = drawing.lap_ms()
        yield ShownFrame(renderer.drawn(shape_hw), 1.0, ms)
        return
    first = ShownFrame(low_resolution(coarse, box_from_clip, shape_hw, step_mm), 0.0, drawing.lap_ms())
    yield first
    if order == "slabs":
        with ExitStack() as stack:
            if coarse is renderer:
                # Slabs keep the picture of their renderer, so that the part behind them needs one of its own.
                coarse = stack.enter_context(type(renderer)(renderer.package, transfer=renderer.program.transfer))
            yield from _by_slabs(drawing, coarse)
        return
    # Sorting tiles counts in their first frame.
    drawing.start()
    if order == "tiles":
        yield from _by_tiles(drawing, first)
        return
    share = pixel_order(order, shape_hw)
    with renderer.in_order(share):
        numbers = ((PicturePart(share=float(value)), share == value) for value in np.unique(share))
        yield from _by_parts(drawing, first.picture, numbers)


@dataclass
class _Drawing:
    """A picture that is drawn in frames, and a watch for the time of a frame."""

    renderer: Renderer
    box_from_clip: Float64Array
    shape_hw: tuple[int, int]
    step_mm: float
    budget_ms: float
    clock: Clock
    began: float = 0.0

    def __post_init__(self) -> None:
        self.start()

    def start(self) -> None:
        """Begin to measure a frame."""
        self.began = self.clock()

    def lap_ms(self) -> float:
        """Wait for the driver; return the milliseconds since the start."""
        self.renderer.finish()
        return (self.clock() - self.began) * 1000


def _by_slabs(drawing: _Drawing, coarse: Renderer) -> Iterator[ShownFrame]:
    """Draw slabs until the time of a frame is over, over the low resolution of the part behind them."""
    renderer, view = drawing.renderer, (drawing.box_from_clip, drawing.shape_hw, drawing.step_mm)
    samples = renderer.samples(drawing.step_mm)
    drawing.start()
    for finished in renderer.draw_slabs(*view):
        ms = drawing.lap_ms()
        if ms < drawing.budget_ms and finished < 1.0:
            continue
        picture = renderer.drawn(drawing.shape_hw)
        if finished < 1.0:
            drawing.start()
            _behind(coarse, *view, round(finished * samples))
            ms += drawing.lap_ms()
            picture = picture + (1 - picture[..., 3:]) * coarse.drawn(drawing.shape_hw)
        yield ShownFrame(picture, finished, ms)
        drawing.start()


Part = tuple[PicturePart, NDArray[np.bool_]]
"""A part to draw, and its pixels in the picture."""


def pixel_order(order: Literal["random", "structured"], shape_hw: tuple[int, int]) -> Float32Array:
    """Return a number from 0 to 1 for each pixel [H, W]: those with the least come first."""
    rows, columns = np.indices(shape_hw)
    numbers = _GRID[rows % 4, columns % 4]
    if order == "random":
        numbers = np.random.default_rng(_SEED).integers(0, REFINEMENTS, shape_hw)
    # Quarters of quarters: floats of any precision hold them.
    share: Float32Array = (numbers / REFINEMENTS).astype(np.float32)
    return share


@dataclass(frozen=True)
class TileOrder:
    """The tiles of a picture, cheapest first."""

    place: NDArray[np.intp]
    """Place of the tile of each pixel in this order, [H, W], row 0 on top."""
    until: Float64Array
    """For each tile the cost of all tiles up to it; its unit is arbitrary."""

    def pixels(self, first: int, stop: int) -> NDArray[np.bool_]:
        """Say of each pixel whether it belongs to these tiles."""
        return (self.place >= first) & (self.place < stop)


def tile_order(renderer: Renderer, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float) -> TileOrder:
    """Sort the tiles of a picture by their cost."""
    found, costs = renderer.sorted_tiles(box_from_clip, shape_hw, step_mm)
    size = renderer.program.tiles.size if renderer.program.tiles else 1
    place = np.empty(len(found), np.intp)
    place[found] = np.arange(len(found))
    rows, columns = np.indices(shape_hw) // size
    # Tiles count from below.
    place_of = place[rows * -(-shape_hw[1] // size) + columns][::-1]
    # A tile without samples takes time, too.
    return TileOrder(place_of, np.cumsum(costs + 1.0))


def draw_tiles(renderer: Renderer, box_from_clip: Float64Array, step_mm: float, pixels: NDArray[np.bool_]) -> None:
    """Draw these pixels of a picture in one draw."""
    with renderer.in_order(np.where(pixels, _DRAWN, np.float32(0.0))):
        renderer.draw_part(box_from_clip, pixels.shape, step_mm, PicturePart(share=float(_DRAWN)))


def _by_tiles(drawing: _Drawing, first: ShownFrame) -> Iterator[ShownFrame]:
    """Draw tiles in one draw for each frame: as many as their costs allow, by the time of the frame before.

    Of 3600 tiles on a software driver, a draw for each takes nine times as long as one for all, 64 draws 1.4 times.
    Waiting within a frame, to see whether there is time for more, takes up to a fifth longer.
    """
    renderer, low = drawing.renderer, first.picture
    tiles = tile_order(renderer, drawing.box_from_clip, drawing.shape_hw, drawing.step_mm)
    until, least = tiles.until, max(1, len(tiles.until) // _MOST_FRAMES)
    # The whole picture has so many times the samples of the small one: a guess that is rather too slow than too fast.
    ms_of_cost, done, spent = first.ms * FEWER**3 / until[-1], 0, 0.0
    while done < len(until):
        affordable = spent + drawing.budget_ms / max(ms_of_cost, _LEAST)
        stop = min(len(until), max(done + least, int(np.searchsorted(until, affordable, side="right"))))
        draw_tiles(renderer, drawing.box_from_clip, drawing.step_mm, tiles.pixels(done, stop))
        ms = drawing.lap_ms()
        finished = tiles.pixels(0, stop)
        picture = np.where(finished[..., None], renderer.drawn(drawing.shape_hw), low)
        yield ShownFrame(picture, float(finished.mean()), ms)
        found = ms / (until[stop - 1] - spent)
        # In the first frame the driver may compile shaders.
        ms_of_cost = found if done else min(found, ms_of_cost)
        done, spent = stop, float(until[stop - 1])
        drawing.start()


def _more(drawn: int, ms: float, budget_ms: float) -> int:
    """Return the number of parts to draw before waiting again: waiting takes longer than a small tile.

    Half of the parts that still fit, because later ones cost more; at most the number that is already drawn.
    """
    if ms <= 0.0:
        return drawn
    return max(1, int(min(drawn, drawn * (budget_ms - ms) / (2 * ms))))


def _by_parts(drawing: _Drawing, low: Float32Array, parts: Iterator[Part]) -> Iterator[ShownFrame]:
    """Draw parts until the time of a frame is over, and show the rest as it was in `low`. The watch runs already."""
    renderer, shape_hw = drawing.renderer, drawing.shape_hw
    finished = np.zeros(shape_hw, bool)
    while not finished.all():
        ms, drawn, more = 0.0, 0, 1
        while batch := [*islice(parts, more)]:
            for part, pixels in batch:
                renderer.draw_part(drawing.box_from_clip, shape_hw, drawing.step_mm, part)
                finished[pixels] = True
            drawn += len(batch)
            ms = drawing.lap_ms()
            if ms >= drawing.budget_ms:
                break
            more = _more(drawn, ms, drawing.budget_ms)
        picture = np.where(finished[..., None], renderer.drawn(shape_hw), low)
        yield ShownFrame(picture, float(finished.mean()), ms)
        drawing.start()
