"""View from a light with a place, in which its shadow map is drawn."""

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError

_WIDER = 1.01
"""Width of the view over the width of the volume, so that everything at the volume's border is in it."""


def light_from_box(light_mm: Float64Array, extent_mm_xyz: Float64Array) -> Float64Array:
    """Return the 4×4 matrix from box space to clip coordinates of a light's view that just holds the volume.

    The view looks at the place of the volume that is nearest to the light: all of the volume is then in front of it.
    Raises VP5040 for a light in the volume.
    """
    nearest = np.clip(light_mm, 0.0, extent_mm_xyz)
    distance = float(np.linalg.norm(nearest - light_mm))
    if not distance > 1e-6 * np.linalg.norm(extent_mm_xyz):
        raise VolprepError("VP5040", light=tuple(light_mm.round(3).tolist()))
    forward = (nearest - light_mm) / distance
    right = np.cross(forward, np.eye(3)[np.abs(forward).argmin()])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(right, forward), forward])
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * extent_mm_xyz
    across = (corners - light_mm) @ rotation.T
    places = across[:, :2] / across[:, 2:]
    middle, half = (places.max(axis=0) + places.min(axis=0)) / 2, np.ptp(places, axis=0) / 2 * _WIDER
    near, far = distance / _WIDER, across[:, 2].max() * _WIDER
    depth = np.array([far + near, -2 * far * near]) / (far - near)
    seen = np.array(
        [
            [1 / half[0], 0.0, -middle[0] / half[0], 0.0],
            [0.0, 1 / half[1], -middle[1] / half[1], 0.0],
            [0.0, 0.0, *depth],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = rotation, -rotation @ light_mm
    return seen @ moved
