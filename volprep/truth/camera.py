"""Cameras, and the nine standard views of a patient."""

from dataclasses import dataclass

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid, Vector
from volprep_formats.package.manifest import Projection

_HEAD: Vector = (0.0, 0.0, 1.0)
_FRONT: Vector = (0.0, -1.0, 0.0)

# Name, direction in which the viewer looks, and up direction of the picture, in the patient's space (LPS). As in
# radiology the viewer faces the patient: in the anterior view the patient's left is on the picture's right.
_VIEWS: tuple[tuple[str, Vector, Vector], ...] = (
    ("anterior", (0.0, 1.0, 0.0), _HEAD),
    ("posterior", (0.0, -1.0, 0.0), _HEAD),
    ("left", (-1.0, 0.0, 0.0), _HEAD),
    ("right", (1.0, 0.0, 0.0), _HEAD),
    ("superior", (0.0, 0.0, -1.0), _FRONT),
    ("inferior", (0.0, 0.0, 1.0), _FRONT),
    ("anterior-left", (-1.0, 1.0, -0.5), _HEAD),
    ("anterior-right", (1.0, 1.3, -0.7), _HEAD),
    ("posterior-left", (-0.8, -1.0, 0.6), _HEAD),
)
STANDARD_VIEWS = tuple(name for name, _, _ in _VIEWS)
"""Names of the standard views."""


@dataclass(frozen=True)
class Camera:
    """Position of the viewer. All positions are world millimetres (LPS)."""

    eye_mm_xyz: Vector
    """Position of the eye; with an orthographic projection a point of the plane where rays begin."""
    forward: Vector
    """Direction in which the viewer looks; any length but zero."""
    up: Vector
    """Up direction of the picture; not parallel to `forward`."""
    height_mm: float
    """Height of the picture's field at the distance `focus_mm`; the width follows from the picture's shape."""
    focus_mm: float
    """Distance from the eye to the middle of the volume; rays end at twice this distance."""
    projection: Projection = "orthographic"
    """Whether rays are parallel or leave the eye."""

    def world_from_clip(self, aspect: float) -> Float64Array:
        """4×4 matrix from homogeneous clip coordinates to the world, for a picture of width / height `aspect`."""
        forward = _unit(np.array(self.forward))
        right = _unit(np.cross(forward, np.array(self.up)))
        rotation = np.eye(4)
        rotation[:3, :3] = np.column_stack([right, np.cross(right, forward), -forward])
        rotation[:3, 3] = self.eye_mm_xyz
        half_height = self.height_mm / 2
        half_width = half_height * aspect
        if self.projection == "orthographic":
            eye_from_clip = np.diag([half_width, half_height, -self.focus_mm, 1.0])
            eye_from_clip[2, 3] = -self.focus_mm
            return rotation @ eye_from_clip
        # Near plane at a hundredth of the focus: the ratio of far to near, 200, leaves a float32 shader 5 digits.
        near, far = self.focus_mm / 100, self.focus_mm * 2
        slope = half_height / self.focus_mm
        clip_from_eye = np.array(
            [
                [1 / (slope * aspect), 0.0, 0.0, 0.0],
                [0.0, 1 / slope, 0.0, 0.0],
                [0.0, 0.0, (near + far) / (near - far), 2 * near * far / (near - far)],
                [0.0, 0.0, -1.0, 0.0],
            ]
        )
        return rotation @ np.linalg.inv(clip_from_eye)

    def box_from_clip(self, grid: Grid, aspect: float) -> Float64Array:
        """4×4 matrix from homogeneous clip coordinates to the box space of `grid`."""
        matrix: Float64Array = np.linalg.inv(grid.world_from_box) @ self.world_from_clip(aspect)
        return matrix


def standard_views(grid: Grid, projection: Projection = "orthographic") -> dict[str, Camera]:
    """Six views along the patient's axes and three oblique ones, each holding the whole volume."""
    extent_xyz = np.array(grid.extent_mm_zyx[::-1])
    centre = grid.corner_mm_xyz + np.array(grid.direction) @ (extent_xyz / 2)
    diagonal = float(np.linalg.norm(extent_xyz))
    # The sphere around the volume fits the field in every view, so that all nine pictures have one scale.
    focus = diagonal if projection == "orthographic" else 2 * diagonal
    return {
        name: Camera(
            eye_mm_xyz=_vector(centre - _unit(np.array(forward)) * focus),
            forward=forward,
            up=up,
            height_mm=diagonal if projection == "orthographic" else diagonal * 1.2,
            focus_mm=focus,
            projection=projection,
        )
        for name, forward, up in _VIEWS
    }


def widest_view(grid: Grid) -> str:
    """Return the standard view that shows most of a volume: along its thin axis if it is flat, else an oblique one."""
    if grid.thin_axis is None:
        return "anterior-left"
    normal = np.abs(np.array(grid.direction)[:, grid.thin_axis])
    return ("left", "anterior", "inferior")[int(np.argmax(normal))]


def view_from(grid: Grid, eye_mm_xyz: Vector, projection: Projection = "orthographic") -> Camera:
    """Look from a point of the world at the middle of the volume, with the field and the angle of the standard views.

    The head is up, the front where one looks along the body. Raises VP5020 for an eye in the middle of the volume.
    """
    extent_xyz = np.array(grid.extent_mm_zyx[::-1])
    centre = grid.corner_mm_xyz + np.array(grid.direction) @ (extent_xyz / 2)
    diagonal = float(np.linalg.norm(extent_xyz))
    forward = centre - np.array(eye_mm_xyz)
    distance = float(np.linalg.norm(forward))
    if not 1e-6 * diagonal < distance < float("inf"):
        raise VolprepError("VP5020", what=f"an eye at {eye_mm_xyz}")
    along_body = float(np.linalg.norm(np.cross(forward, _HEAD))) < 1e-3 * distance
    # Rays end at twice the focus, so that it may not come closer when the eye does.
    focus = max(distance, diagonal)
    orthographic = projection == "orthographic"
    return Camera(
        eye_mm_xyz=_vector(centre - forward * (diagonal / distance)) if orthographic else eye_mm_xyz,
        forward=_vector(forward),
        up=_FRONT if along_body else _HEAD,
        height_mm=diagonal if orthographic else focus * 0.6,
        focus_mm=diagonal if orthographic else focus,
        projection=projection,
    )


def _unit(vector: Float64Array) -> Float64Array:
    unit: Float64Array = vector / np.linalg.norm(vector)
    return unit


def _vector(array: Float64Array) -> Vector:
    x, y, z = array.tolist()
    return x, y, z
