"""Where in a picture something is seen, so that it can fill the picture: a scan holds much air."""

import numpy as np

from volprep.render.renderer import Renderer
from volprep.render.slices import SliceRenderer
from volprep_formats.arrays import Float32Array, Float64Array

_FIRST_LOOK = 128
"""Pixels along the longer side of the picture that tells where something is seen."""
_SEEN = 0.02
"""Opacity that a visible pixel exceeds: fainter pixels are ignored when framing."""
_MARGIN = 1.06
_ROOM = 1.1
"""How much more than a standard view the first look shows. That fits the box just into the height, and stacks of few
slices reach beyond the box."""


def filled(
    renderer: Renderer | SliceRenderer,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    step_mm: float | None = None,
) -> Float64Array:
    """Return the matrix of a camera that looks the same way, framed so that the visible part fills `shape_hw`.

    Neither side may be 0. `step_mm` is that of `render`. Raises the errors of the renderer.
    """
    return box_from_clip @ frame_of(first_look(renderer, box_from_clip, shape_hw, step_mm))


def first_look(
    renderer: Renderer | SliceRenderer,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    step_mm: float | None = None,
) -> Float32Array:
    """Return the opacity [row, column] of a small picture that shows more than the camera does."""
    height, width = (-(-_FIRST_LOOK * side // max(shape_hw)) for side in shape_hw)
    return renderer.render(box_from_clip @ _farther((height, width)), (height, width), step_mm)[..., 3]


def frame_of(opacity: Float32Array) -> Float64Array:
    """Return the 4×4 from clip coordinates of the framed picture to the camera's, given its first look."""
    return _farther(opacity.shape) @ window_of_seen(opacity)


def _farther(shape_hw: tuple[int, ...]) -> Float64Array:
    scale = _ROOM * max(shape_hw[0] / shape_hw[1], 1.0)
    return np.diag([scale, scale, 1.0, 1.0])


def window_of_seen(opacity: Float32Array) -> Float64Array:
    """Return the 4×4 from clip coordinates of the framed picture to the whole picture's, given its [row, column].

    The window has the shape of the whole and a margin, and is never larger; where nothing is seen it is the whole.
    """
    window = np.eye(4)
    rows, columns = np.nonzero(opacity > _SEEN)
    if not len(rows):
        return window
    height, width = opacity.shape
    low = np.array([columns.min() / width, 1 - (rows.max() + 1) / height]) * 2 - 1
    high = np.array([(columns.max() + 1) / width, 1 - rows.min() / height]) * 2 - 1
    half = min(float((high - low).max()) / 2 * _MARGIN, 1.0)
    window[:2, :2] *= half
    window[:2, 3] = np.clip((low + high) / 2, half - 1, 1 - half)
    return window
