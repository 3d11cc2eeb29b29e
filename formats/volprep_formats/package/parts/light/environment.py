"""Environments that change with the direction like a cosine, for precomputed light that an app may turn.

The light from the direction w is e0 + e1 · w, for each of red, green and blue: the first two bands of spherical
harmonics. Transport is linear, so the light in a volume is a sum over four environments that span all of these:
1 + w · t, with t the four corners of a tetrahedron. None of them is negative anywhere.
"""

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.light.model import LightModel

CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]) / np.sqrt(3.0)
"""[4, 3]: directions t of the four environments, unit vectors in the patient's space (LPS)."""

WHITE: Float64Array = np.array([[1.0] * 3, [0.0] * 3, [0.0] * 3, [0.0] * 3])
"""[4, RGB]: the environment that is 1 everywhere."""


def environment_of(model: LightModel) -> Float64Array:
    """Return the environment of a turnable light as [4, RGB]: e0, and e1 along x, y and z in the patient's space.

    Sky and ground are exact. A sun of the colour c in the direction d is c · (1 + w · d).
    """
    sky, ground = np.array(model.sky), np.array(model.ground)
    environment: Float64Array = np.zeros((4, 3))
    environment[0], environment[3] = (sky + ground) / 2, (sky - ground) / 2
    for sun in model.suns:
        direction = np.array(sun.direction) / np.linalg.norm(sun.direction)
        environment += np.outer([1.0, *direction], sun.colour)
    return environment


def turned(environment: Float64Array, turn: Float64Array) -> Float64Array:
    """Return the environment after a rotation [3, 3] of the patient's space."""
    return np.concatenate([environment[:1], turn @ environment[1:]])


def shares_of(environment: Float64Array) -> Float64Array:
    """Return how much of each of the four environments an environment is, as [4, RGB]."""
    shares: Float64Array = (environment[0] + 3.0 * (CORNERS @ environment[1:])) / 4.0
    return shares


def environment_uniform(environment: Float64Array) -> Float64Array:
    """Return the mat4 of a shader: times the light of the four environments, it gives red, green, blue and 0."""
    matrix: Float64Array = np.zeros((4, 4))
    matrix[:3] = shares_of(environment).T
    return matrix
