"""The stack of layers of half-angle slicing: across the middle between the ways to the viewer and to the light."""

import math

import numpy as np

from volprep.render.layers import Layers, layer_corners, view_axes
from volprep_formats.arrays import Float32Array, Float64Array


def half_angle_layers(
    extent_mm_xyz: Float64Array, box_from_clip: Float64Array, light_mm: Float64Array, step_mm: float
) -> tuple[Layers, bool]:
    """Return the stack, its third axis away from the light, and whether the light comes from behind the volume.

    A layer is at most `step_mm` long along the middle rays of both the viewer and the light. If the light comes from
    behind, the viewer's rays run against the stack.
    """
    *_, view = view_axes(box_from_clip)
    to_light = light_mm - extent_mm_xyz / 2
    to_light /= np.linalg.norm(to_light)
    behind = bool(to_light @ -view < 0.0)
    across = to_light + (view if behind else -view)
    across /= -np.linalg.norm(across)
    right = np.cross(across, np.eye(3)[np.abs(across).argmin()])
    right /= np.linalg.norm(right)
    half_mm = float(np.linalg.norm(extent_mm_xyz)) / 2
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([right, np.cross(across, right), across]) * half_mm
    matrix[:3, 3] = extent_mm_xyz / 2
    cosine = abs(float(view @ across))
    return Layers(matrix, max(1, math.ceil(2 * half_mm / (step_mm * cosine) - 1e-9))), behind


def corners_of_layers(layers: Layers, box_from_clip: Float64Array) -> list[Float32Array]:
    """Return the corners of each layer as a viewer needs them, from the light's side on."""
    corners = layer_corners("view-slices", layers, box_from_clip, front_to_back=True)
    numbers = corners[:, 2].astype(np.intp)
    return [np.ascontiguousarray(corners[numbers == number]) for number in range(layers.count)]
