"""Precomputed light against path tracing of the scan, beyond the noise of the paths.

Nothing else lights these pictures. Both are of the scan at full precision, so that only the light is measured: its
grid, its bits, and its fit. The variance of a pixel's paths is subtracted from its squared error, so that noise does
not count; the remaining mean is known up to a standard error.
"""

from dataclasses import replace
from itertools import product

import numpy as np

from volprep.truth.path_traced import LitVolume, squares_beyond_noise, traced_picture
from volprep.validation.bench import Bench
from volprep.validation.records import TracedLight
from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.light.environment import environment_of, turned
from volprep_formats.package.program import Program

_VIEWS = ("anterior", "anterior-left", "superior")
_PIXELS = 48
_PATHS = 128
_TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""The second orientation of light that apps may turn: a third of a turn, x to y, y to z and z to x."""
_STANDARD_ERRORS = 3.0
"""Number of standard errors that a mean square may lie above the tolerance, by chance."""


def measure_light(bench: Bench, program: Program) -> TracedLight | None:
    """Compare the precomputed light of a program with path tracing; None if it has none."""
    if not program.baked:
        return None
    subject = bench.subject
    light = next(
        each.light
        for each in subject.package.manifest.textures
        if each.light is not None and each.transfer == program.transfer
    )
    scan = replace(subject.scan, normals=None)
    lit = LitVolume(
        np.ascontiguousarray(scan.stored),
        scan.grid,
        scan.slope,
        scan.intercept,
        subject.function(program.transfer),
        light.model,
    )
    lights = [(lit, subject)]
    if light.model.turnable:
        environment = turned(environment_of(light.model), _TURN)
        lights.append((replace(lit, environment=environment), subject.turned(_TURN)))
    beyond: list[Float64Array] = []
    noise: list[Float64Array] = []
    for (each, drawn), name in product(lights, _VIEWS):
        camera = subject.cameras[name].box_from_clip(scan.grid, aspect=1.0)
        truth = traced_picture(each, camera, (_PIXELS, _PIXELS), _PATHS)
        picture = drawn.through(scan, program.transfer, camera, (_PIXELS, _PIXELS)).rgba
        beyond.append(squares_beyond_noise(picture, truth))
        noise.append(truth.variance[truth.rgba[..., 3] > 0.0, :3].mean(axis=1))
    found = _judged(np.concatenate(beyond), np.concatenate(noise), subject.render.tolerance.rmse)
    return found.model_copy(update={"orientations": len(lights)})


def _judged(beyond: Float64Array, noise: Float64Array, tolerance: float) -> TracedLight:
    """Judge a picture by its pixels' squared errors beyond the noise."""
    if not len(beyond):
        return TracedLight(rmse=0.0, rmse_below=0.0, noise_rmse=0.0, pixels=0, paths=_PATHS, passed=True)
    mean, error = float(beyond.mean()), float(beyond.std() / np.sqrt(len(beyond)))
    least, most = (max(mean + side * _STANDARD_ERRORS * error, 0.0) for side in (-1.0, 1.0))
    return TracedLight(
        rmse=float(np.sqrt(max(mean, 0.0))),
        rmse_below=float(np.sqrt(most)),
        noise_rmse=float(np.sqrt(noise.mean())),
        pixels=len(beyond),
        paths=_PATHS,
        passed=least <= tolerance**2,
    )
