"""Faces of the volume's box: the ones that face the viewer, and the others."""

import numpy as np

from volprep_formats.arrays import Float32Array, Float64Array

_SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]], np.float32)

_EDGE = 1e-6
"""Sine of the angle under which a face counts as seen from its edge."""


def face_corners(box_from_clip: Float64Array, extent_mm_xyz: Float64Array, *, front: bool) -> Float32Array:
    """Return the corners of two triangles for each face [6 · faces, 3], 0 or 1 along each axis."""
    faces = []
    for (axis, side), is_front in faces_from(box_from_clip, extent_mm_xyz).items():
        if is_front == front:
            face = np.full((6, 3), float(side), np.float32)
            face[:, [dimension for dimension in range(3) if dimension != axis]] = _SQUARE
            faces.append(face)
    return np.concatenate(faces) if faces else np.empty((0, 3), np.float32)


def faces_from(box_from_clip: Float64Array, extent_mm_xyz: Float64Array) -> dict[tuple[int, int], bool]:
    """Return for each face, by its axis (xyz) and side (0 or 1), whether it faces the viewer.

    It does if the eye, or the origin of parallel rays, is on its outer side; faces seen edge-on are left out.
    """
    # The eye of a perspective matrix; with parallel rays a point at infinity, w = 0.
    eye = box_from_clip @ np.array([0.0, 0.0, -1.0, 0.0])
    if eye[3] != 0.0 and abs(eye[3]) * np.abs(extent_mm_xyz).max() > 1e-9 * np.linalg.norm(eye[:3]):
        eye = eye / eye[3]
    else:
        near, far = (place[:3] / place[3] for place in (box_from_clip @ [0, 0, depth, 1] for depth in (-1, 1)))
        eye = np.append(near - far, 0.0)
    looks: dict[tuple[int, int], bool] = {}
    for axis in range(3):
        for side in (0, 1):
            outside = (eye[axis] - side * extent_mm_xyz[axis] * eye[3]) * (1 if side else -1)
            # A face seen edge-on covers only pixels that are due to rounding.
            if abs(outside) > _EDGE * np.linalg.norm(eye[:3]):
                looks[axis, side] = bool(outside > 0)
    return looks
