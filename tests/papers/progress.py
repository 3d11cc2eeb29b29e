"""Pictures that get finished frame by frame: how long each frame takes, and how far it is from others."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from tests.benchmarks.drawing_time import LEAST_MS, honest_clock
from tests.benchmarks.waking import wake
from volprep.render.progressive import Order, ShownFrame, coarse_level, draw_tiles, frames, low_resolution, tile_order
from volprep.render.renderer import Renderer
from volprep.truth.metrics import picture_error
from volprep_formats.arrays import Float32Array, Float64Array

from .bench import View, rmse

BUDGET_S = 0.1
"""Of a frame, as in the paper."""
FRAMES = 10
"""A frame has less time where tiles need fewer frames than these, as on most GPUs."""

EQUAL_FRAMES = 20
"""Frames with as many tiles in each."""


@dataclass(frozen=True)
class Progress:
    """How a picture came."""

    frames_ms: tuple[float, ...]
    """Time of each frame, without reading it back."""
    rmse: float
    """Error of the last one."""


@dataclass(frozen=True)
class Opened:
    """A package whose pictures get finished."""

    renderer: Renderer
    """Of the level that is shown in the end."""
    coarse: Renderer
    """Of the coarse level behind it."""


@contextmanager
def opened(renderer: Renderer) -> Iterator[Opened]:
    """Open the renderer of the coarse level beside that of a package."""
    level = coarse_level(renderer.package, renderer.program.transfer)
    with Renderer(renderer.package, level=level, transfer=renderer.program.transfer) as coarse:
        yield Opened(renderer, coarse)


def wake_for(renderer: Renderer, view: View) -> None:
    """Wake a GPU with pictures of a view."""
    camera, step_mm = _seen(renderer, view)
    wake(renderer.driver.renderer, lambda: renderer.time_ms(camera, view.shape_hw, step_mm, repeats=1))


def budget_s_of(shown: Opened, view: View) -> float:
    """Return the time that a frame has: that of the paper, or a tenth of what all tiles take. Wakes a GPU."""
    wake_for(shown.renderer, view)
    *_, whole = finishing(shown, "tiles", view, math.inf)
    return min(BUDGET_S, max(whole.ms, LEAST_MS) / 1000 / FRAMES)


def finishing(shown: Opened, order: Order, view: View, budget_s: float) -> Iterator[ShownFrame]:
    """Finish a picture, in steps of half a voxel. The first frame is the small one of a view that changes."""
    renderer = shown.renderer
    camera, step_mm = _seen(renderer, view)
    if order == "classic":
        yield ShownFrame(low_resolution(renderer, camera, view.shape_hw, step_mm), 0.0, 0.0)
    clock = honest_clock(renderer.driver.renderer)
    yield from frames(
        renderer, order, camera, view.shape_hw, step_mm, budget_s=budget_s, clock=clock, coarse=shown.coarse
    )


def progress(shown: Opened, order: Order, view: View, budget_s: float, truth: Float64Array) -> Progress:
    """Time the frames of a picture; the error is that of the last one with fewer pixels, as `truth` has.

    A GPU must be awake.
    """
    # First the small one: the driver compiles the shaders for it.
    *_, last = finishing(shown, order, View(view.camera, view.small_hw), math.inf)
    times = [max(frame.ms, LEAST_MS) for frame in finishing(shown, order, view, budget_s)]
    return Progress(tuple(times[1:]), rmse(last.picture, truth))


def dssim(picture: Float32Array, other: Float32Array) -> float:
    """Structural dissimilarity over black, (1 - SSIM) / 2."""
    return (1 - picture_error(picture, other).ssim_black) / 2


def seconds_of_equal_frames(renderer: Renderer, view: View) -> list[float]:
    """Finish a picture by as many tiles in each of 20 frames, those that cost least first; times add up."""
    camera, step_mm = _seen(renderer, view)
    tiles = tile_order(renderer, camera, view.shape_hw, step_mm)
    renderer.time_ms(camera, view.shape_hw, step_mm, repeats=1)
    count = len(tiles.until)
    clock, per_frame = honest_clock(renderer.driver.renderer), -(-count // EQUAL_FRAMES)
    began, seconds = clock(), []
    for first in range(0, count, per_frame):
        draw_tiles(renderer, camera, step_mm, tiles.pixels(first, first + per_frame))
        renderer.finish()
        seconds.append(clock() - began)
    return seconds


def _seen(renderer: Renderer, view: View) -> tuple[Float64Array, float]:
    """Return the matrix of a view, and half a voxel."""
    return view.camera.box_from_clip(renderer.level.grid, view.aspect), 0.5 * min(renderer.level.grid.spacing_mm_zyx)
