"""The nine standard views: where rays begin in the patient's space, and where they go.

The viewer faces the patient as in radiology: in the anterior view the patient's left is on the picture's right.
"""

from dataclasses import dataclass

import numpy as np

from volprep.validation.witness.independent.scan import Floats

LEFT, BACK, HEAD = np.eye(3)
"""The axes of the patient's space (LPS)."""

VIEWS: dict[str, tuple[Floats, Floats]] = {
    "anterior": (BACK, HEAD),
    "posterior": (-BACK, HEAD),
    "left": (-LEFT, HEAD),
    "right": (LEFT, HEAD),
    "superior": (-HEAD, -BACK),
    "inferior": (HEAD, -BACK),
    "anterior-left": (-LEFT + BACK - 0.5 * HEAD, HEAD),
    "anterior-right": (LEFT + 1.3 * BACK - 0.7 * HEAD, HEAD),
    "posterior-left": (-0.8 * LEFT - BACK + 0.6 * HEAD, HEAD),
}
"""Direction in which the viewer looks, and the upward direction, for each view."""


@dataclass(frozen=True)
class Box:
    """The box that fills the views, and how it is projected."""

    middle_mm: Floats
    diagonal_mm: float
    projection: str


def rays(view: str, box: Box, pixels: int, rows: Floats, columns: Floats) -> tuple[Floats, Floats]:
    """Return origins [n, 3] and unit directions [n, 3] of pixels of a square picture; row 0 is on top."""
    forward, up = VIEWS[view]
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    upward = np.cross(right, forward)
    half = 0.5 * box.diagonal_mm
    across, above = 2.0 * (columns + 0.5) / pixels - 1.0, 1.0 - 2.0 * (rows + 0.5) / pixels
    if box.projection == "orthographic":
        eye = box.middle_mm - box.diagonal_mm * forward
        origins = eye + half * (across[:, None] * right + above[:, None] * upward)
        return origins, np.tile(forward, (len(origins), 1))
    # The field is 1.2 diagonals high at the middle of the box, two diagonals away.
    eye = box.middle_mm - 2.0 * box.diagonal_mm * forward
    towards = 2.0 * box.diagonal_mm * forward + 1.2 * half * (across[:, None] * right + above[:, None] * upward)
    return np.tile(eye, (len(towards), 1)), towards / np.linalg.norm(towards, axis=1, keepdims=True)
