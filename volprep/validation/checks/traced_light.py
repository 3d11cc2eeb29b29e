"""Precomputed light against path tracing of the scan, beyond the noise of the paths.

Nothing else lights these pictures. Both are of the scan at full precision, so that only the light is measured: its
grid, its bits, and its fit. The variance of a pixel's paths is subtracted from its squared error, so that noise does
not count; the remaining mean is known up to a standard error.
"""

from dataclasses import replace
from itertools import product

import numpy as np

from volprep.parts.light.lit import views_of_a_cut
from volprep.truth.decoded import baked_fields
from volprep.truth.path_traced import LitVolume, squares_beyond_noise, traced_picture
from volprep.truth.refined import refined_lit
from volprep.validation.bench import Bench
from volprep.validation.results.measurements import TracedLight
from volprep.validation.subjects.subject import Subject
from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.light.environment import environment_of, turned
from volprep_formats.package.parts.light.planes import plane_numbers
from volprep_formats.package.parts.light.record import StoredLight
from volprep_formats.package.program import PictureProgram

_VIEWS = ("anterior", "anterior-left", "superior")
_PIXELS = 48
_PATHS = 128
_TURN = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""The second orientation of light that apps may turn: a third of a turn, x to y, y to z and z to x."""
_STANDARD_ERRORS = 3.0
"""Number of standard errors that a mean square may lie above the tolerance, by chance."""


def measure_light(bench: Bench, program: PictureProgram) -> TracedLight | None:
    """Compare the precomputed light of a program with path tracing; None if it has none."""
    subject = bench.subject
    light = _light_of(subject, program, cut=False)
    if light is None:
        return None
    scan = replace(subject.scan, normals=None)
    lit = _lit(subject, program, light)
    lights = [(lit, subject)]
    if light.model.turnable:
        environment = turned(environment_of(light.model), _TURN)
        lights.append((replace(lit, environment=environment), subject.turned(_TURN)))
    beyond: list[Float64Array] = []
    noise: list[Float64Array] = []
    for (value, drawn), name in product(lights, _VIEWS):
        camera = subject.cameras[name].box_from_clip(scan.grid, aspect=1.0)
        truth = traced_picture(value, camera, (_PIXELS, _PIXELS), _PATHS)
        picture = drawn.through(scan, program.transfer, camera, (_PIXELS, _PIXELS)).rgba
        beyond.append(squares_beyond_noise(picture, truth))
        noise.append(truth.variance[truth.rgba[..., 3] > 0.0, :3].mean(axis=1))
    found = _judged(np.concatenate(beyond), np.concatenate(noise), subject.render.tolerance.rmse)
    return found.model_copy(update={"orientations": len(lights)})


def measure_cut_light(bench: Bench, program: PictureProgram) -> TracedLight | None:
    """Compare the light of the cut volume with path tracing of this volume; None without such light."""
    subject = bench.subject
    light = _light_of(subject, program, cut=True)
    if light is None:
        return None
    scan = subject.scan
    # The package's box begins elsewhere if the scan was cropped.
    scan_from_package = np.linalg.inv(subject.grid.world_from_box) @ scan.grid.world_from_box
    lit = replace(_lit(subject, program, light), planes=plane_numbers(light.planes) @ scan_from_package)
    field = baked_fields(subject.package, cut=True)[program.transfer]
    beyond: list[Float64Array] = []
    noise: list[Float64Array] = []
    for view in views_of_a_cut(subject.grid, plane_numbers(light.planes)):
        camera = view.box_from_clip(scan.grid, aspect=1.0)
        truth = traced_picture(lit, camera, (_PIXELS, _PIXELS), _PATHS)
        picture = refined_lit(lit, camera, (_PIXELS, _PIXELS), baked=field)
        beyond.append(squares_beyond_noise(picture.rgba, truth))
        noise.append(truth.variance[truth.rgba[..., 3] > 0.0, :3].mean(axis=1))
    return _judged(np.concatenate(beyond), np.concatenate(noise), subject.render.tolerance.rmse)


def _light_of(subject: Subject, program: PictureProgram, *, cut: bool) -> StoredLight | None:
    texture = subject.package.manifest.lights(cut=cut).get(program.transfer) if program.baked else None
    return None if texture is None else texture.light


def _lit(subject: Subject, program: PictureProgram, light: StoredLight) -> LitVolume:
    scan, function = subject.scan, subject.function(program.transfer)
    stored = np.ascontiguousarray(scan.stored)
    return LitVolume(stored, scan.grid, scan.slope, scan.intercept, function, light.model)


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
