"""Pictures that get finished while people look at them (Díaz-García et al. 2018, section 4).

While the view changes, an app draws few pixels and enlarges them. When it stands still, the pixels of the picture come
part by part, in the time that a frame has, and take the place of the enlarged ones. The samples of a pixel are those of
a picture that is drawn at once: which parts there are, and in which order, changes no pixel of the end.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from volprep.render.gl import PicturePart
from volprep.render.renderer import Renderer
from volprep.render.timing import Clock
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.diagnostics import VolprepError

Order = Literal["classic", "slabs", "tiles", "random", "structured"]
"""How a picture is finished. classic: at once. slabs: some samples of all rays after the other, of a program that has
slabs. tiles: tiles that cost least first, of a program that sorts them. random, structured: single pixels from all over
the picture, in chance order, or those of a grid that gets finer."""

REFINEMENTS = 16
"""Parts of the pixels of `random` and `structured`."""
_GRID = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]])
"""Which pixel of 4×4 comes when: each is as far as can be from those before it."""
_SEED = 4


@dataclass(frozen=True)
class ShownFrame:
    """What a user sees at a time."""

    picture: Float32Array
    """[H, W, 4] as `Renderer.render` gives it."""
    finished: float
    """Part of the picture's pixels, or of its samples along a ray, that is finished."""
    ms: float
    """Milliseconds that drawing took since the frame before, without reading it back."""


def low_resolution(
    renderer: Renderer, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float, fewer: int = 4
) -> Float32Array:
    """Draw a picture for a view that changes: `fewer` times less pixels along both axes, and steps so much longer.

    Each stands for a square. Raises VP5009 and VP5019 as `Renderer.render`.
    """
    height, width = shape_hw
    small = renderer.render(box_from_clip, (-(-height // fewer), -(-width // fewer)), step_mm * fewer)
    rows, columns = (np.minimum(np.arange(n) * m // n, m - 1) for n, m in zip(shape_hw, small.shape[:2], strict=True))
    return np.ascontiguousarray(small[rows][:, columns])


def frames(
    renderer: Renderer,
    order: Order,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    step_mm: float,
    *,
    budget_s: float = 0.1,
    clock: Clock = time.perf_counter,
) -> Iterator[ShownFrame]:
    """Draw a picture frame by frame, each in about `budget_s`. The first is that of a view that changes.

    `clock` tells the time in seconds. Raises VP5041 for an order that the program does not have, and what
    `Renderer.render` raises.
    """
    if order == "slabs" and renderer.program.slab_samples is None:
        raise VolprepError("VP5041", technique=renderer.program.technique)
    watch = _Watch(renderer, clock)
    if order == "classic":
        renderer.draw(box_from_clip, shape_hw, step_mm)
        ms = watch.lap_ms()
        yield ShownFrame(renderer.drawn(shape_hw), 1.0, ms)
        return
    low = low_resolution(renderer, box_from_clip, shape_hw, step_mm)
    yield ShownFrame(low, 0.0, watch.lap_ms())
    if order == "slabs":
        watch.start()
        for finished in renderer.draw_slabs(box_from_clip, shape_hw, step_mm):
            ms = watch.lap_ms()
            yield ShownFrame(renderer.drawn(shape_hw), finished, ms)
            watch.start()
        return
    if order == "tiles":
        parts = tile_parts(renderer, box_from_clip, shape_hw, step_mm)
        yield from _by_parts(renderer, box_from_clip, step_mm, low, parts, budget_s, watch)
        return
    share = pixel_order(order, shape_hw)
    with renderer.in_order(share):
        numbers = ((PicturePart(share=float(each)), share == each) for each in np.unique(share))
        yield from _by_parts(renderer, box_from_clip, step_mm, low, numbers, budget_s, watch)


class _Watch:
    """Tells how long drawing takes."""

    def __init__(self, renderer: Renderer, clock: Clock) -> None:
        self._finish, self._clock = renderer.finish, clock
        self.start()

    def start(self) -> None:
        """Begin again."""
        self._began = self._clock()

    def lap_ms(self) -> float:
        """Wait for the driver; return the milliseconds since the start."""
        self._finish()
        return (self._clock() - self._began) * 1000


Part = tuple[PicturePart, NDArray[np.bool_] | tuple[slice, slice]]
"""What is drawn, and the pixels of the picture that it is."""


def pixel_order(order: Literal["random", "structured"], shape_hw: tuple[int, int]) -> Float32Array:
    """Return a number from 0 to 1 for each pixel [H, W]: those with the least come first."""
    rows, columns = np.indices(shape_hw)
    numbers = _GRID[rows % 4, columns % 4]
    if order == "random":
        numbers = np.random.default_rng(_SEED).integers(0, REFINEMENTS, shape_hw)
    # Quarters of quarters: floats of any precision hold them.
    share: Float32Array = (numbers / REFINEMENTS).astype(np.float32)
    return share


def tile_parts(
    renderer: Renderer, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float
) -> Iterator[Part]:
    """Return the tiles of a picture, those that cost least first, each with the pixels that it has."""
    found = renderer.sorted_tiles(box_from_clip, shape_hw, step_mm)
    size = renderer.program.tiles.size if renderer.program.tiles else 0
    height, width = shape_hw
    for tile in found:
        row, column = divmod(tile, -(-width // size))
        x, y = column * size, row * size
        rectangle = x, y, min(size, width - x), min(size, height - y)
        yield PicturePart(rectangle=rectangle), (slice(height - y - rectangle[3], height - y), slice(x, x + size))


def _more(drawn: int, ms: float, budget_ms: float) -> int:
    """Return how many parts to draw before waiting again: waiting takes longer than a small tile.

    Half of what still has time, as those to come cost more; no more than there are already.
    """
    if ms <= 0.0:
        return drawn
    return max(1, int(min(drawn, drawn * (budget_ms - ms) / (2 * ms))))


def _by_parts(  # noqa: PLR0917 - those of frames, and the parts
    renderer: Renderer,
    box_from_clip: Float64Array,
    step_mm: float,
    low: Float32Array,
    parts: Iterator[Part],
    budget_s: float,
    watch: _Watch,
) -> Iterator[ShownFrame]:
    """Draw parts until the time of a frame is over, and show the rest as it was in `low`."""
    shape_hw = low.shape[0], low.shape[1]
    finished = np.zeros(shape_hw, bool)
    while not finished.all():
        watch.start()
        ms, drawn, more = 0.0, 0, 1
        while batch := [*islice(parts, more)]:
            for part, pixels in batch:
                renderer.draw_part(box_from_clip, shape_hw, step_mm, part)
                finished[pixels] = True
            drawn += len(batch)
            ms = watch.lap_ms()
            if ms >= budget_s * 1000:
                break
            more = _more(drawn, ms, budget_s * 1000)
        picture = np.where(finished[..., None], renderer.drawn(shape_hw), low)
        yield ShownFrame(picture, float(finished.mean()), ms)
