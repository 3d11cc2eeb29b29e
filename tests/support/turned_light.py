"""The edit of an app that turns the light around a volume."""

from dataclasses import replace

from volprep.render.inputs import Edit, Inputs
from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.light.environment import environment_of, environment_uniform, turned
from volprep_formats.package.reader import Package


def turned_by(turn: Float64Array) -> Edit:
    """Return the edit that turns the light around the volume, by a rotation [3, 3] of the patient's space."""

    def edit(_package: Package, inputs: Inputs) -> Inputs:
        models = [texture.light.model for texture in inputs.textures if texture.light is not None]
        environment = turned(environment_of(models[0]), turn)
        return replace(inputs, values={**inputs.values, "environment": environment_uniform(environment)})

    return edit
