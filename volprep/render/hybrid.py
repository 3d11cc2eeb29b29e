"""Hybrid resolution (Moser and Weiskopf 2008, section 4): the volume in a small picture, lines with all pixels.

Lines behind the volume are attenuated by its opacity, lines before it are drawn over it; a line through the volume
counts as behind it. Where the buffer has no alpha, opacity is estimated: from pictures before black and before white,
which is exact; from a picture of a white volume, which is exact and here needs no textures of its own, because texture
combiners take the alpha of a texel as its colour; or from the luminance of the picture, averaged or as perceived, which
takes dark parts for transparent ones. With shaders the small picture has alpha, and needs no estimate.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np

from volprep.render.box_lines import box_lines
from volprep.render.renderer import Renderer
from volprep.render.slices import SliceRenderer
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.parts.hybrid.record import Hybrid, OpacitySource

_LUMINANCE: dict[OpacitySource, tuple[float, float, float]] = {
    "luminance-average": (1 / 3, 1 / 3, 1 / 3),
    "luminance-perceived": (0.3, 0.59, 0.11),
}


@dataclass(frozen=True)
class HybridWish:
    """Settings for combining the picture of a volume with the lines around it."""

    small_hw: tuple[int, int] | None = None
    """Height and width of the picture of the volume; equal to the whole picture's if absent."""
    lines: bool = True
    """Whether the box of the volume and its middle axes are drawn."""
    opacity: OpacitySource = "alpha"
    """Source of the volume's opacity."""

    @classmethod
    def of_package(cls, hybrid: Hybrid, shape_hw: tuple[int, int]) -> Self:
        """Return the settings of a package, for a picture of this size."""
        return cls(hybrid.small_hw(shape_hw), hybrid.has_lines, hybrid.opacity)


def hybrid_picture(
    renderer: Renderer | SliceRenderer,
    wanted: HybridWish,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    step_mm: float | None = None,
) -> Float32Array:
    """Return a picture [H, W, 4], premultiplied linear: lines at full size, the volume at the requested size.

    Raises the errors of `render`, and VP5050 for an estimate of the opacity if the picture of the volume has alpha.
    """
    small_hw = wanted.small_hw or shape_hw
    extent_mm_xyz = np.array(renderer.level.grid.extent_mm_zyx[::-1])
    lines = [box_lines(box_from_clip, extent_mm_xyz)] if wanted.lines else []
    if isinstance(renderer, Renderer):
        if wanted.opacity != "alpha":
            raise VolprepError("VP5050", source=wanted.opacity)
        return renderer.render_with_lines(box_from_clip, shape_hw, small_hw, lines, step_mm)
    if step_mm is not None:
        # The renderer says why.
        return renderer.render(box_from_clip, small_hw, step_mm)
    small = small_picture(renderer, box_from_clip, small_hw, wanted.opacity)
    return renderer.render_with_lines(box_from_clip, shape_hw, small, lines)


def small_picture(
    renderer: SliceRenderer, box_from_clip: Float64Array, shape_hw: tuple[int, int], source: OpacitySource
) -> Float32Array:
    """Return a picture [H, W, 4] whose opacity comes from this source; all but "alpha" read no alpha."""
    picture = renderer.render(box_from_clip, shape_hw)
    if source != "alpha":
        picture[..., 3] = np.clip(_ESTIMATES[source](renderer, box_from_clip, picture), 0.0, 1.0)
    return picture


Estimate = Callable[[SliceRenderer, Float64Array, Float32Array], Float32Array]


def _black_and_white(renderer: SliceRenderer, box_from_clip: Float64Array, picture: Float32Array) -> Float32Array:
    white = renderer.render_on(box_from_clip, picture.shape[:2], 1.0)[..., :3]
    opacity: Float32Array = 1 - (white - picture[..., :3]).mean(axis=-1)
    return opacity


def _white_volume(renderer: SliceRenderer, box_from_clip: Float64Array, picture: Float32Array) -> Float32Array:
    return renderer.render_on(box_from_clip, picture.shape[:2], 0.0, white=True)[..., 0]


def _luminance(weights: tuple[float, float, float]) -> Estimate:
    def estimate(_renderer: SliceRenderer, _camera: Float64Array, picture: Float32Array) -> Float32Array:
        luminance: Float32Array = picture[..., :3] @ np.array(weights, np.float32)
        return luminance

    return estimate


_ESTIMATES: dict[OpacitySource, Estimate] = {
    "black-and-white": _black_and_white,
    "white-volume": _white_volume,
    **{source: _luminance(weights) for source, weights in _LUMINANCE.items()},
}
