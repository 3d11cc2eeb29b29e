"""Measure on the scan whether precomputed light is worth its texture, and choose its resolution.

Small pictures are path traced, and compared with pictures without the light, and with fields that are fitted to a part
of the samples.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from volprep.parts.light import solve
from volprep.parts.light.codes import coded
from volprep.parts.light.lit import behind_a_cut, lit_volume
from volprep.plan.decisions import LightChoice
from volprep.plan.records import CropPlan
from volprep.scan.slabs import RawVolume
from volprep.scene.scene import Scene
from volprep.truth.camera import Camera, standard_views, view_from
from volprep.truth.lit import BakedField
from volprep.truth.path_traced import LUMINANCE, LitVolume, squares_beyond_noise, traced_picture
from volprep.truth.refined import refined_picture
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo

MOST_TEXELS = 4_000_000
"""Texels up to which half the resolution is possible; fitting these takes 700 MB at most."""
_FACTORS: tuple[Literal[4], Literal[2]] = (4, 2)
_COARSER = 2
"""The grid that the fit begins with has cells of so many of the coarsest."""
_BATCHES = 4
"""Samples of a trial, in batches."""
_SHARE = 0.5
"""Part of the tolerance below which an error does not count."""
_NEARLY = 1.1
"""A quarter of the resolution, with an eighth of the bytes, may have so many times the error."""
_VIEWS = ("anterior", "anterior-left", "superior")
_PIXELS = 24
_PATHS = 128
_PICTURE_TOLERANCE = 1e-3

Error = Float64Array
"""[3]: mean square over seen pixels without the light, with a quarter of the resolution, and with half of it. Trials
add two: half of the resolution for the half of the volume behind a cut, and its brightness against light in colour."""


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
    lit = [lit_volume(volume, info, crop, grid, function, model) for function in functions]
    *errors, cut, brightness = np.sqrt(np.max([_errors(each, progress) for each in lit], axis=0)).tolist()
    found = choice(np.array(errors), scene.tolerance.rmse, scene.lighting.resolution, texels(grid, 2))
    if found.factor is None:
        return found
    reason = f"{found.reason}; {cut:.2g} for a volume that is cut through its middle"
    if brightness > 0.0 and not model.turnable:
        reason += f"; a brightness is RMSE {brightness:.2g} from light in colour (lighting.channels)"
    return replace(found, reason=reason)


def choice(errors: Error, tolerance: float, wanted: Literal["auto", 2, 4], half_texels: int) -> LightChoice:
    """Decide by root mean square errors: without the light, at a quarter of the resolution, and at half of it."""
    unlit, quarter, half = errors.tolist()
    told = f"in small pictures RMSE {half:.2g} from path tracing at half the resolution, {quarter:.2g} at a quarter"
    without = f"{unlit:.2g} without the light"
    if wanted == "auto" and unlit <= _SHARE * tolerance:
        half_of = f"less than half of the tolerance of {tolerance:.2g}"
        return LightChoice(None, f"pictures hardly change: RMSE {without}, {half_of}")
    if wanted != "auto":
        return LightChoice(wanted, f"as the scene states; {told}, {without}")
    if half_texels > MOST_TEXELS:
        return LightChoice(4, f"{told}, {without}; half would be more than {MOST_TEXELS} texels")
    is_enough = quarter <= max(_SHARE * tolerance, _NEARLY * half)
    return LightChoice(4 if is_enough else 2, f"{told}, {without}")


def texels(grid: Grid, factor: int) -> int:
    """Return how many texels the light of a grid has at a resolution."""
    return math.prod(-(-n // factor) for n in grid.shape_zyx)


def _errors(lit: LitVolume, progress: Progress) -> Error:
    """Return the mean squares over seen pixels of pictures of one function; 0 if nothing is seen."""
    fields = solve.solve_fields(lit, [_COARSER * _FACTORS[0], *_FACTORS], _BATCHES * solve.BATCH, progress)
    ways = (None, *(baked_field(coded(field).decoded(field), lit.grid) for field in fields[1:]))
    views = standard_views(lit.grid)
    half = behind_a_cut(lit)
    cut = _squares(half, ways[-1:], [_facing_the_cut(half.grid)])
    cameras = [views[name] for name in _VIEWS]
    return np.concatenate([_squares(lit, ways, cameras), cut, _of_brightness(lit, fields[-1], cameras)])


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
    brightness = replace(field, texels=(field.texels @ weights[:, None]).astype(np.float32))
    in_colour = replace(lit, model=model.model_copy(update={"channels": "rgb"}))
    return _squares(in_colour, [baked_field(coded(brightness).decoded(brightness), lit.grid)], views)


def _facing_the_cut(grid: Grid) -> Camera:
    extent_xyz = np.array(grid.extent_mm_zyx[::-1])
    x, y, z = (np.array(grid.world_from_box) @ [*(extent_xyz * [0.5, -1.0, 0.5]), 1.0])[:3].tolist()
    return view_from(grid, (x, y, z))


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
    return refined_picture(
        lit.volume,
        lit.grid,
        lit.slope,
        lit.intercept,
        lit.transfer_function,
        camera,
        (_PIXELS, _PIXELS),
        _PICTURE_TOLERANCE,
        baked=baked,
    ).rgba
