"""Compare the light that an app turns with what the scene states."""

from collections.abc import Iterator

import numpy as np

from volprep.validation.subjects.subject import Subject
from volprep.validation.witness.check import WitnessCheck
from volprep.validation.witness.independent.environment import light_of_uniform, stated_light
from volprep.validation.witness.independent.scan import CannotWitnessError
from volprep.validation.witness.independent.scene import WitnessedScene
from volprep.validation.witness.read_checks import NUMPY
from volprep_formats.package.parts.light.environment import environment_of, environment_uniform, turned

_TURNS = (np.eye(3), np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
"""None, and a third of a turn: x to y, y to z and z to x."""
_DIRECTIONS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-0.6, 0.0, 0.8], [0.0, -0.8, -0.6]])
_LIMIT = 1e-6


def check_turned_light(subject: Subject, scene: WitnessedScene) -> Iterator[WitnessCheck]:
    """Compare the environments of all light that an app turns, as they are and turned."""
    textures = [each for each in subject.package.manifest.textures if each.light and each.light.model.turnable]
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
