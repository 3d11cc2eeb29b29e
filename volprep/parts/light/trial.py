"""Measure on the scan whether precomputed light is worth its texture, and choose its resolution.

Small pictures are path traced, and compared with pictures without the light, and with fields that are fitted to a part
of the samples.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from volprep.parts.light import solve
from volprep.parts.light.codes import coded, coded_alike, left_out
from volprep.parts.light.lit import lit_volume, middle_plane, views_of_a_cut
from volprep.plan.decisions import CutChoice, LightChoice
from volprep.plan.records import CropPlan
from volprep.scan.slabs import RawVolume
from volprep.scene.scene import LightResolution, Scene
from volprep.truth.camera import Camera, standard_views
from volprep.truth.lit import BakedField
from volprep.truth.path_traced import LUMINANCE, LitVolume, squares_beyond_noise, traced_picture
from volprep.truth.refined import refined_lit
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.parts.light.planes import plane_numbers, planes_in_box
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo

MOST_TEXELS = 4_000_000
"""Texels up to which a resolution is chosen; fitting these takes 700 MB at most."""
_FACTORS: tuple[Literal[4], Literal[2]] = (4, 2)
_COARSER = 2
"""The grid that the fit begins with has cells of so many of the coarsest."""
_BATCHES = 4
"""Most samples of a trial, in batches."""
_PER_VOXEL = 4
"""Samples of a trial for each voxel."""
_SHARE = 0.5
"""Part of the tolerance below which an error does not count."""
_NEARLY = 1.1
"""A resolution with an eighth of the bytes may have so many times the error."""
_VIEWS = ("anterior", "anterior-left", "superior")
_PIXELS = 24
_PATHS = 128
_PICTURE_TOLERANCE = 1e-3
_LEAST_RMSE = 1e-3

Error = Float64Array
"""[3]: mean square over seen pixels without the light, with a quarter of the resolution, and with half of it. Trials
add three: half of the resolution for the cut volume, with the light of the whole and with its own; and its brightness
against light in colour."""


def light_model(scene: Scene) -> LightModel | None:
    """Return the light that a scene wants to be computed once; None if it wants none."""
    wanted = scene.lighting
    if wanted.baked == "none":
        return None
    return LightModel(
        kind=wanted.baked,
        channels=wanted.channels,
        turnable=wanted.turnable,
        sky=wanted.sky,
        ground=wanted.ground,
        suns=wanted.suns,
        radius_mm=wanted.radius_mm,
        light_mm=wanted.light_mm if wanted.baked == "shadow" else None,
        ambient=wanted.ambient,
    )


def try_light(  # noqa: PLR0917 - the parts of a channel's scan
    scene: Scene,
    volume: RawVolume,
    info: SourceInfo,
    crop: CropPlan,
    grid: Grid,
    functions: Sequence[TransferFunction],
    progress: Progress,
) -> LightChoice | None:
    """Decide whether light that a scene wants is worth its texture, and its resolution; None if it wants none.

    The worst transfer function counts. A resolution that the scene states is taken as it is.
    """
    model = light_model(scene)
    if model is None:
        return None
    if model.turnable:
        # The surroundings may have colours, although the volume scatters as grey.
        model = model.model_copy(update={"channels": "rgb"})
    first = lit_volume(volume, info, crop, grid, functions[0], model)
    progress = _Trying(progress)
    lit = [replace(first, transfer_function=function) for function in functions]
    wanted = scene.lighting
    planes = plane_numbers(planes_in_box(wanted.clip_planes, grid)) if wanted.clip_planes else middle_plane(grid)
    trials = [_tried(value, planes, progress, cut_light=wanted.clip_aware) for value in lit]
    *errors, cut, own, brightness = np.sqrt(np.max([trial.squares for trial in trials], axis=0)).tolist()
    tolerance = scene.tolerance.rmse
    misses = wanted.resolution == "auto" and errors[-1] > tolerance and texels(grid, 1) <= MOST_TEXELS
    full = None
    if wanted.resolution == 1 or misses:
        full = math.sqrt(max(_at_full_resolution(bench, progress) for bench in lit))
    found = choice(np.array(errors), tolerance, wanted.resolution, texels(grid, 2), full)
    if found.factor is None:
        return replace(found, remark=f"baked light is left out: {found.reason}; lighting.resolution = 2 keeps it")
    reason = f"{found.reason}; the fit leaves a residual of {max(trial.residual for trial in trials):.1g}"
    where = (
        f"{len(planes)} plane{'s' if len(planes) > 1 else ''}" if wanted.clip_planes else "a plane through its middle"
    )
    reason += f"; {cut:.2g} for the volume cut by {where}"
    if brightness > 0.0 and not model.turnable:
        reason += f"; a brightness is RMSE {brightness:.2g} from light in colour (lighting.channels)"
    reason += hues_text(max(trial.left_out for trial in trials), tolerance)
    cut_choice = choice_for_a_cut(cut, own, tolerance) if wanted.clip_aware else None
    error = full if found.factor == 1 and full is not None else errors[1 if found.factor == 4 else 2]
    return replace(found, reason=reason, remark=remark_of(error, tolerance), cut=cut_choice)


def choice(
    errors: Error, tolerance: float, wanted: LightResolution, half_texels: int, full: float | None = None
) -> LightChoice:
    """Decide by root mean square errors: without the light, at a quarter of the resolution, and at half of it.

    `full` is the error at the resolution of the scan, if it was measured.
    """
    unlit, quarter, half = errors.tolist()
    told = f"in small pictures RMSE {half:.2g} from path tracing at half the resolution, {quarter:.2g} at a quarter"
    if full is not None:
        told += f", {full:.2g} at all of it"
    without = f"{unlit:.2g} without the light"
    if wanted == "auto" and unlit <= _SHARE * tolerance:
        half_of = f"less than half of the tolerance of {tolerance:.2g}"
        return LightChoice(None, f"pictures hardly change: RMSE {without}, {half_of}")
    if wanted != "auto":
        return LightChoice(wanted, f"as the scene states; {told}, {without}")
    if half_texels > MOST_TEXELS:
        return LightChoice(4, f"{told}, {without}; half would be more than {MOST_TEXELS} texels")
    if full is not None and _NEARLY * full < half:
        return LightChoice(1, f"{told}, {without}; half misses the tolerance of {tolerance:.2g}")
    is_enough = quarter <= max(_SHARE * tolerance, _NEARLY * half)
    return LightChoice(4 if is_enough else 2, f"{told}, {without}")


def remark_of(error: float, tolerance: float) -> str:
    """Return what a user should know of light with an error; empty if it is within the tolerance."""
    if error <= tolerance:
        return ""
    return (
        f"baked light is RMSE {error:.2g} from path tracing in small pictures, more than the tolerance of "
        f"{tolerance:.2g}: volprep validate may refuse it (VP3242) unless tolerance.rmse allows more"
    )


def hues_text(left: float, tolerance: float) -> str:
    """Explain that light has more hues than two colours hold; empty if these leave out little."""
    if left <= tolerance:
        return ""
    return (
        f"; its hues do not lie between two colours, which leave out RMSE {left:.2g} of the light at places that the "
        f"field was not fitted to, more than the tolerance of {tolerance:.2g}: give suns, sky and ground one "
        f'hue beside white, or take lighting.channels = "luminance", which has no wrong hues'
    )


def choice_for_a_cut(whole: float, own: float, tolerance: float) -> CutChoice:
    """Decide by root mean square errors of the cut volume: with the light of the whole volume, and with its own."""
    if whole == 0.0:
        return CutChoice(kept=False, reason="nothing of the volume is seen behind the planes")
    told = f"small pictures of the cut are {_decibels(whole)} dB from path tracing with the light of the whole volume"
    if whole <= _SHARE * tolerance:
        return CutChoice(kept=False, reason=f"{told}, RMSE {whole:.2g}, less than half of the tolerance")
    told += f", {_decibels(own)} dB with their own"
    return CutChoice(kept=_NEARLY * own < whole, reason=told)


def _decibels(rmse: float) -> str:
    """Return an error in decibels; little more than the noise of the paths is left above 60."""
    return "above 60" if rmse < _LEAST_RMSE else f"{-20.0 * math.log10(rmse):.1f}"


def texels(grid: Grid, factor: int) -> int:
    """Return how many texels the light of a grid has at a resolution."""
    return math.prod(-(-n // factor) for n in grid.shape_zyx)


class _Trying:
    """Progress of fits in trials: users see it apart from that of the light that the package holds."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress

    def start(self, _: str, total: int) -> None:
        self._progress.start("trying light", total)

    def advance(self, units: int = 1) -> None:
        self._progress.advance(units)


class _Trial(NamedTuple):
    squares: Error  # [6], 0 if nothing is seen, and of the cut's own light if it is not asked for
    residual: float  # of the field at half of the resolution
    left_out: float  # root mean square of the light that two colours leave out; 0 of light that has none


def _tried(lit: LitVolume, planes: Float64Array, progress: Progress, *, cut_light: bool) -> _Trial:
    """Measure pictures of one function, whole and cut by `planes`."""
    factors, count = [_COARSER * _FACTORS[0], *_FACTORS], _sample_count(lit)
    fields = solve.solve_fields(lit, factors, count, progress)
    ways = (None, *(baked_field(coded(field).decoded(field), lit.grid) for field in fields[1:]))
    views = standard_views(lit.grid)
    cut, of_cut = replace(lit, planes=planes), [ways[-1]]
    if cut_light:
        own = solve.solve_fields(cut, factors, count, progress, curve=fields[-1].curve)[-1]
        of_cut.append(baked_field(coded_alike([fields[-1], own])[1].decoded(own), lit.grid))
    cut_squares = _squares(cut, of_cut, views_of_a_cut(lit.grid, planes))
    cameras = [views[name] for name in _VIEWS]
    squares = [_squares(lit, ways, cameras), np.resize(cut_squares, 2), _of_brightness(lit, fields[-1], cameras)]
    hues = fields[-1].hues
    return _Trial(np.concatenate(squares), fields[-1].residual, 0.0 if hues is None else left_out(hues))


def _sample_count(lit: LitVolume) -> int:
    return min(_PER_VOXEL * math.prod(lit.grid.shape_zyx), _BATCHES * solve.BATCH)


def _at_full_resolution(lit: LitVolume, progress: Progress) -> float:
    """Return the mean square over seen pixels with a texel for each voxel."""
    field = solve.solve_fields(lit, [*_FACTORS, 1], _sample_count(lit), progress)[-1]
    views = standard_views(lit.grid)
    way = baked_field(coded(field).decoded(field), lit.grid)
    return float(_squares(lit, [way], [views[name] for name in _VIEWS])[0])


def _of_brightness(lit: LitVolume, field: solve.LightField, views: Sequence[Camera]) -> Float64Array:
    """Return the mean square between pictures with the brightness of a light, and with the light in colour [1].

    0 if no light has a colour.
    """
    model, points = lit.model, lit.transfer_function.points
    colours = [model.sky, model.ground, *(sun.colour for sun in model.suns)]
    colours += [point.colour for point in points] if model.kind == "scattering" else []
    if model.kind == "shadow" or all(max(colour) == min(colour) for colour in colours):
        return np.zeros(1)
    weights = LUMINANCE if field.texels.shape[4] == 3 else np.ones(1)
    brightness = replace(field, texels=(field.texels @ weights[:, None]).astype(np.float32), hues=None)
    in_colour = replace(lit, model=model.model_copy(update={"channels": "rgb"}))
    return _squares(in_colour, [baked_field(coded(brightness).decoded(brightness), lit.grid)], views)


def _squares(lit: LitVolume, ways: Sequence[BakedField | None], views: Sequence[Camera]) -> Float64Array:
    """Return the mean square over seen pixels for each way to light a volume; 0 if nothing is seen."""
    cameras = [view.box_from_clip(lit.grid, aspect=1.0) for view in views]
    traced = [traced_picture(lit, camera, (_PIXELS, _PIXELS), _PATHS) for camera in cameras]
    sums = np.zeros(len(ways))
    for row, way in enumerate(ways):
        squares = [
            squares_beyond_noise(_drawn(lit, camera, way), truth) for camera, truth in zip(cameras, traced, strict=True)
        ]
        joined = np.concatenate(squares)
        sums[row] = max(float(joined.mean()), 0.0) if len(joined) else 0.0
    return sums


def baked_field(field: solve.LightField, grid: Grid) -> BakedField:
    """Return a field in the box of a grid, for the oracles."""
    x, y, z = grid.corner_mm_xyz.tolist()
    return BakedField(np.ascontiguousarray(field.texels), field.curve, field.nodes_per_mm_xyz, (x, y, z))


def _drawn(lit: LitVolume, camera: Float64Array, baked: BakedField | None) -> Float64Array:
    return refined_lit(lit, camera, (_PIXELS, _PIXELS), _PICTURE_TOLERANCE, baked=baked).rgba
