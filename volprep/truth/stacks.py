"""Draw a stack of slices in double precision, to separate the error of the texels from that of drawing them.

It blends the same polygons as `volprep.render.slices` back to front, for each pixel's ray.
"""

from collections.abc import Iterable
from typing import Literal

import numpy as np

from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.grid import Grid
from volprep_formats.package.parts.slices.record import StackAxis

_MOST_BRIGHTNESS = 2.0
_TIE = 1e-9
"""Cosines of stacks that differ by less count as equal."""


def facing_axis(box_from_clip: Float64Array, axes: Iterable[StackAxis]) -> tuple[StackAxis, float]:
    """Return the axis of the stack that is drawn, and the cosine of its angle to the direction of view.

    Of stacks at equal angles, the first of x, y, z is drawn, whatever the rounding of a camera is.
    """
    ends = box_from_clip @ np.array([[0.0, 0.0], [0.0, 0.0], [-1.0, 1.0], [1.0, 1.0]])
    near, far = (ends[:3] / ends[3]).T
    along = np.abs(far - near) / np.linalg.norm(far - near)
    cosines = {axis: float(along["xyz".index(axis)]) for axis in sorted(axes)}
    axis = next(value for value, cosine in cosines.items() if cosine >= max(cosines.values()) - _TIE)
    return axis, cosines[axis]


def brightness(cosine: float, largest_opacity: float) -> float:
    """Return the factor of all texels of a stack at this angle: their path is longer, and no opacity passes 1."""
    return min(1 / max(cosine, 1e-6), _MOST_BRIGHTNESS, 1 / largest_opacity)


def stack_picture(  # noqa: PLR0917 - the stack, the camera, and the one thing that is compared
    texels: UInt8Array,
    axis: StackAxis,
    grid: Grid,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    longer: Literal["exact"] | float,
    layers: int = 1,
) -> Float64Array:
    """Composite slices [slice, row, column, RGBA] of a level with this grid, as [H, W, 4], premultiplied linear.

    `longer` is the weight of a texel: the opacity of the path between two slices along its pixel's ray, or a factor for
    all, which ends at 1. Each slice has so many `layers`, which mix the two slices around them.
    """
    place = "xyz".index(axis)
    spacing, extent = np.array(grid.spacing_mm_zyx[::-1]), np.array(grid.extent_mm_zyx[::-1])
    near, along = pixel_rays(box_from_clip, shape_hw)
    path = 1.0 / np.maximum(np.abs(along[:, place]), 1e-6)
    slices = (np.arange(len(texels) * layers) + 0.5) / layers
    centres = np.minimum(slices * spacing[place], extent[place])
    # Between the middles of two slices; before the first and behind the last there is one.
    between = np.clip(slices - 0.5, 0.0, len(texels) - 1.0)
    picture = np.zeros((len(near), 4))
    # With parallel rays, and with an eye outside, all rays meet the slices in the same order.
    order = np.argsort(-centres * np.sign(along[len(along) // 2, place]))
    column, row = (axis for axis in range(3) if axis != place)
    for number in order:
        at = near + along * ((centres[number] - near[:, place]) / along[:, place])[:, None]
        inside = np.flatnonzero(np.all((at >= 0.0) & (at <= extent), axis=1))
        i, j = at[inside, row] / spacing[row] - 0.5, at[inside, column] / spacing[column] - 0.5
        lower = int(between[number])
        source = _bilinear(texels[lower] / 255.0, i, j)
        if between[number] > lower:
            share = between[number] - lower
            source = (1.0 - share) * source + share * _bilinear(texels[lower + 1] / 255.0, i, j)
        source = _lengthened(source, path[inside]) if longer == "exact" else np.minimum(source * longer, 1.0)
        picture[inside] = source + (1.0 - source[:, 3:]) * picture[inside]
    return picture.reshape(*shape_hw, 4)


def pixel_rays(box_from_clip: Float64Array, shape_hw: tuple[int, int]) -> tuple[Float64Array, Float64Array]:
    """Points on the near plane and unit directions [pixel, xyz] in box space."""
    height, width = shape_hw
    y, x = np.meshgrid(1 - (2 * np.arange(height) + 1) / height, (2 * np.arange(width) + 1) / width - 1, indexing="ij")
    ends = []
    for depth in (-1.0, 1.0):
        clip = np.stack([x, y, np.full_like(x, depth), np.ones_like(x)], axis=-1).reshape(-1, 4)
        box = clip @ box_from_clip.T
        ends.append(box[:, :3] / box[:, 3:])
    along = ends[1] - ends[0]
    return ends[0], along / np.linalg.norm(along, axis=1, keepdims=True)


def _bilinear(texels: Float64Array, i: Float64Array, j: Float64Array) -> Float64Array:
    """Filter [row, column, RGBA] at positions in texels, 0 at the first centre; edges are repeated."""
    rows, columns = texels.shape[:2]
    i, j = np.clip(i, 0, rows - 1), np.clip(j, 0, columns - 1)
    above, left = i.astype(np.intp), j.astype(np.intp)
    below, right = np.minimum(above + 1, rows - 1), np.minimum(left + 1, columns - 1)
    down, across = (i - above)[:, None], (j - left)[:, None]
    upper = texels[above, left] * (1 - across) + texels[above, right] * across
    lower = texels[below, left] * (1 - across) + texels[below, right] * across
    filtered: Float64Array = upper * (1 - down) + lower * down
    return filtered


def _lengthened(source: Float64Array, path: Float64Array) -> Float64Array:
    """Colours [pixel, RGBA] of a path that is so many times longer: 1 - (1 - opacity)^path."""
    opacity = source[:, 3]
    longer = -np.expm1(path * np.log1p(-np.minimum(opacity, 1.0 - 1e-9)))
    lengthened: Float64Array = (
        source * np.divide(longer, opacity, out=np.ones_like(opacity), where=opacity > 0.0)[:, None]
    )
    return lengthened
