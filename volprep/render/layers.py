"""The stack of layers that a program draws: its place in a view, and the corners of its squares."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.program import Geometry

RIM = 6.0
"""Extra width of a stack on each side of the volume, in layers, as in its vertex shader."""
_FAR = 1e6
"""Half depths of the stack."""
_CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]], np.float32)


@dataclass(frozen=True)
class Layers:
    """A stack of layers."""

    box_from_slices: Float64Array
    """4×4, from a cube from -1 to 1, whose third axis goes through the layers away from the viewer, to millimetres."""
    count: int
    """Number of layers."""


def layers_of(geometry: Geometry, extent_mm_xyz: Float64Array, box_from_clip: Float64Array, step_mm: float) -> Layers:
    """Return the stack of a view, with layers at most `step_mm` apart along the ray in the middle."""
    across, view = view_axes(box_from_clip)
    if geometry == "view-slices":
        axes = np.column_stack([across, np.cross(view, across), view]) * (np.linalg.norm(extent_mm_xyz) / 2)
    else:
        # Of the stacks along the axes of the volume that one whose slices face the viewer most.
        facing = int(np.abs(view).argmax())
        axes = np.roll(np.diag(extent_mm_xyz / 2), 2 - facing, axis=1)
        axes[:, 2] *= np.sign(view[facing])
    matrix = np.eye(4)
    matrix[:3, :3] = axes
    matrix[:3, 3] = extent_mm_xyz / 2
    depth_mm = 2 * float(np.linalg.norm(axes[:, 2]))
    cosine = abs(float(view @ axes[:, 2])) * 2 / depth_mm
    return Layers(matrix, max(1, math.ceil(depth_mm / (step_mm * cosine) - 1e-9)))


def view_axes(box_from_clip: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return unit vectors in box space: to the picture's right, and at a right angle to it, away from the viewer."""
    clip = np.array([[0, 0, -1, 1], [1, 0, -1, 1], [0, 1, -1, 1], [0, 0, 1, 1]])
    near, right, above, far = (place[:3] / place[3] for place in clip @ box_from_clip.T)
    across, up = (value / np.linalg.norm(value) for value in (right - near, above - near))
    view = np.cross(across, up)
    view *= np.sign(view @ (far - near)) / np.linalg.norm(view)
    return across, view


def layer_corners(
    geometry: Geometry, layers: Layers, box_from_clip: Float64Array, *, front_to_back: bool
) -> Float32Array:
    """Return the corners of triangles [n, 4], in order: x, y, the number of the layer, and which of its sides.

    Of two layers that one is nearer whose distance from the eye along the stack is less; no ray meets layers before and
    behind the eye. A layer across the view is one square, its far side. Of one along an axis it is all faces that rays
    leave it through, because rays may leave it at the rim.
    """
    # With parallel rays w is 0, and the rest is where they come from: as from a point far away.
    eye = np.linalg.inv(layers.box_from_slices) @ (box_from_clip @ np.array([0.0, 0.0, -1.0, 0.0]))
    length = float(np.linalg.norm(eye[:3]))
    eye = eye[:3] * (_FAR / length) if abs(eye[3]) * _FAR <= length else eye[:3] / eye[3]
    numbers = np.arange(layers.count)
    sides = np.stack([2 * numbers, 2 * numbers + 2]) / layers.count - 1
    order = np.argsort(np.abs(sides.mean(axis=0) - eye[2]), kind="stable")
    faces = [(2, side, sides[side] * (2 * side - 1) > eye[2] * (2 * side - 1)) for side in (0, 1)]
    if geometry != "view-slices":
        rim = 1 + 2 * RIM / layers.count * np.linalg.norm(layers.box_from_slices[:3, 2])
        for axis in (0, 1):
            edge = 1 + (rim - 1) / np.linalg.norm(layers.box_from_slices[:3, axis])
            faces += [(axis, side, np.full(layers.count, edge > eye[axis] * (2 * side - 1))) for side in (0, 1)]
    corners = np.stack([_face(axis, side, numbers) for axis, side, _ in faces], axis=1)
    drawn = np.stack([seen for _, _, seen in faces], axis=1)
    order = order if front_to_back else order[::-1]
    return np.ascontiguousarray(corners[order][drawn[order]].reshape(-1, 4))


def _face(axis: int, side: int, numbers: NDArray[np.intp]) -> Float32Array:
    """Return two triangles for a face of each layer [layer, 6, 4]."""
    corners = np.empty((len(numbers), 6, 4), np.float32)
    places = _CORNERS.copy()
    held = [dimension for dimension in range(3) if dimension != axis]
    columns = {held[0]: places[:, 0], held[1]: places[:, 1], axis: np.full(6, 2.0 * side - 1)}
    corners[..., 0], corners[..., 1] = columns[0], columns[1]
    corners[..., 2] = numbers[:, None]
    corners[..., 3] = (columns[2] + 1) / 2
    return corners


def clip_from_box_of(box_from_clip: Float64Array) -> Float64Array:
    """Invert the camera's matrix, with the sign for which w is positive in front of the eye."""
    inverse: Float64Array = np.asarray(np.linalg.inv(box_from_clip), np.float64)
    return -inverse if box_from_clip[3, 3] < 0 else inverse
