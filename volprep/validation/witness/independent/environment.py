"""Light around a volume that an app turns: the light from a direction, as the scene states it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from volprep.validation.witness.independent.scan import Floats

_CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]) / np.sqrt(3.0)


def stated_light(lighting: Mapping[str, Any], directions: Floats, turn: Floats) -> Floats:
    """Return the light [n, RGB] from directions [n, 3] after a rotation, of the table [lighting] of a scene.

    Light changes from the ground to the sky with the cosine, and a sun is spread over the whole sky.
    """
    from_here = directions @ turn
    sky, ground = (np.array(lighting.get(name, (1.0, 1.0, 1.0)), dtype=np.float64) for name in ("sky", "ground"))
    part = 0.5 + 0.5 * from_here[:, 2:]
    light: Floats = part * sky + (1.0 - part) * ground
    for sun in lighting.get("suns") or ():
        towards = np.array(sun["direction"], dtype=np.float64)
        towards /= np.linalg.norm(towards)
        light = light + (1.0 + from_here @ towards)[:, None] * np.array(sun.get("colour", (1.0, 1.0, 1.0)))
    return light


def light_of_uniform(matrix: Floats, directions: Floats) -> Floats:
    """Return the light [n, RGB] from directions [n, 3] of a mat4 with the shares of four environments as columns."""
    light: Floats = (1.0 + directions @ _CORNERS.T) @ matrix[:3].T
    return light
