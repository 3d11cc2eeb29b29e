"""Compare the light that an app turns with what the scene states."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from volprep.validation.subjects.subject import Subject
from volprep.validation.witness.check import WitnessCheck
from volprep.validation.witness.independent.scan import CannotWitnessError, Floats
from volprep.validation.witness.independent.scene import WitnessedScene
from volprep.validation.witness.read_checks import NUMPY
from volprep_formats.package.parts.light.environment import environment_of, environment_uniform, turned

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


_TURNS = (np.eye(3), np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
"""None, and a third of a turn: x to y, y to z and z to x."""
_DIRECTIONS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-0.6, 0.0, 0.8], [0.0, -0.8, -0.6]])
_LIMIT = 1e-6


def check_turned_light(subject: Subject, scene: WitnessedScene) -> Iterator[WitnessCheck]:
    """Compare the environments of all light that an app turns, as they are and turned."""
    textures = [
        texture for texture in subject.package.manifest.textures if texture.light and texture.light.model.turnable
    ]
    if not textures:
        raise CannotWitnessError("the package holds none")
    for texture in textures:
        assert texture.light is not None  # noqa: S101 - chosen by it
        environment = environment_of(texture.light.model)
        off = 0.0
        for turn in _TURNS:
            held = light_of_uniform(environment_uniform(turned(environment, turn)), _DIRECTIONS)
            off = max(off, float(np.abs(held - stated_light(scene.light, _DIRECTIONS, turn)).max()))
        yield WitnessCheck(
            item=f"light around {texture.transfer}",
            by=NUMPY,
            what="largest difference of the light from a direction, as it is and turned",
            found=off,
            limit=_LIMIT,
        )
