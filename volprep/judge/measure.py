"""Measure the levels of a pyramid against its finest one: the exact integral of each, in the same views and pixels."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import cache, partial
from pathlib import Path

import numpy as np

from volprep.judge.records import Judged, JudgedLevel, StoreFidelity
from volprep.scene.points import Measure
from volprep.scene.request import UNNAMED, load_request
from volprep.truth.camera import standard_views
from volprep.truth.kept_contrast import kept_contrast
from volprep.truth.oracle import oracle_picture
from volprep.truth.seen import seen_error
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.installation import generator
from volprep_formats.look_files import read_looks
from volprep_formats.package.look import LookMedium, VolumeLook
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress, Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec

VIEWS = ("anterior-left", "left", "superior")
"""An oblique view, and two along axes of the patient."""
PIXELS_PER_VOXEL = (0.5, 1.0, 2.0)
"""Sizes of a voxel of a level on the screen."""
MOST_PIXELS = 512
"""Largest width and height of a picture."""
_RAYS = 2
"""Rays of a pixel along each axis."""
_ACCURACY = 1e-4
_MOST_VOXELS = 2**29
_NO_LEVEL = frozenset(("VP1222", "VP1250"))
"""Codes of a level that is not there."""


def judge(store: Path, look: Path, progress: Progress, *, channel: str | None = None) -> StoreFidelity:
    """Measure the levels of a store or package with the transfer functions of a scene, or of a record of looks.

    Raises VP1334 (nothing to judge), the errors of the scene or the record and of reading.
    """
    volumes = [*_levels(store, channel)]
    if len(volumes) < 2:
        raise VolprepError("VP1334", path=store, problem="it has one level, and nothing is coarser than it")
    if volumes[0].stored.size > _MOST_VOXELS:
        raise VolprepError("VP1334", path=store, problem=f"its finest level has more than {_MOST_VOXELS} voxels")
    looks = _looks(look, volumes[0], channel)
    tolerance = looks[0].tolerance
    progress.start("judging levels", len(looks) * (len(volumes) - 1))
    measured: list[Judged] = []
    for function in (look.media[0].function for look in looks):
        # Two levels of which one has twice the spacing share pictures of the finest one.
        truth_of = cache(partial(_picture, volumes[0], volumes[0].grid, function))
        for level in range(1, len(volumes)):
            measured += _judged(volumes[level], level, volumes[0].grid, function, truth_of)
            progress.advance()
    return StoreFidelity(
        generator=generator(),
        views=VIEWS,
        rays_per_pixel=_RAYS**2,
        levels=tuple(
            JudgedLevel(level=level, shape_zyx=volume.grid.shape_zyx, spacing_mm_zyx=volume.grid.spacing_mm_zyx)
            for level, volume in enumerate(volumes)
        ),
        looks=looks,
        tolerance_rmse=tolerance.rmse,
        least_kept_contrast=tolerance.kept_light,
        measured=tuple(measured),
    )


def _looks(path: Path, finest: Volume, channel: str | None) -> tuple[VolumeLook, ...]:
    """Return the transfer functions of a scene or of the looks of a file, each as a look without light.

    The looks of `channel` count, or all if it is None.
    """
    if path.suffix.lower() == ".toml":
        scene = load_request(path).scene
        tolerance = scene.tolerance
        functions = {
            (transfer.channel, transfer.name): transfer.resolved(_measure(finest)) for transfer in scene.transfer
        }
    else:
        looks = read_looks(path).looks
        tolerance = looks[0].tolerance if looks else Tolerance()
        media = [medium for look in looks for medium in look.media if channel in {None, medium.channel}]
        functions = {(medium.channel, medium.function.name): medium.function for medium in media}
    if not functions:
        raise VolprepError("VP1334", path=path, problem="it has no transfer function for these values")
    return tuple(
        VolumeLook(
            name=function.name,
            media=(LookMedium(channel=of or channel or UNNAMED, function=function),),
            tolerance=tolerance,
        )
        for (of, _), function in functions.items()
    )


def _levels(store: Path, channel: str | None) -> Iterator[Volume]:
    """Yield the levels, finest first."""
    for level in range(64):
        with ExitStack() as opened:
            spec = SourceSpec(path=path_text(store.absolute()), level=level, channel=channel)
            try:
                source = opened.enter_context(open_source(spec, Path(), Silent()))
            except VolprepError as error:
                if level and error.code in _NO_LEVEL:
                    return
                raise
            info = source.info
            stored = np.ascontiguousarray(source.read_slab(0, info.grid.shape_zyx[0]))
        yield Volume(stored, info.grid, info.slope, info.intercept)


def _measure(volume: Volume) -> Measure:
    ends = (float(end) * volume.slope + volume.intercept for end in (volume.stored.min(), volume.stored.max()))
    low, high = sorted(ends)
    return Measure(low, high, float(np.linalg.norm(volume.grid.extent_mm_zyx)))


def _judged(
    coarse: Volume, level: int, grid: Grid, function: TransferFunction, truth_of: Callable[[str, int], Float64Array]
) -> Iterator[Judged]:
    """Yield the error of a level at each size of a voxel whose picture is not too large."""
    height_mm = standard_views(grid)[VIEWS[0]].height_mm
    for size in PIXELS_PER_VOXEL:
        pixels = round(height_mm * size / min(coarse.grid.spacing_mm_zyx))
        if not 8 <= pixels <= MOST_PIXELS:
            continue
        errors, kept = [], []
        for view in VIEWS:
            truth, drawn = truth_of(view, pixels), _picture(coarse, grid, function, view, pixels)
            errors.append(seen_error(drawn, truth))
            kept.append(kept_contrast(drawn, truth, 2 * size))
        yield Judged(
            look=function.name,
            level=level,
            pixels_per_voxel=size,
            pixels=pixels,
            rmse=max(error.rmse for error in errors),
            maximum=max(error.maximum for error in errors),
            off=max(error.off for error in errors),
            kept_contrast=min((value for value in kept if value is not None), default=None),
        )


def _picture(volume: Volume, grid: Grid, function: TransferFunction, view: str, pixels: int) -> Float64Array:
    """Draw a level as the camera of the finest grid sees it."""
    matrix = standard_views(grid)[view].box_from_clip(volume.grid, 1.0)
    rays = oracle_picture(volume, function, matrix, (_RAYS * pixels,) * 2, _ACCURACY).rgba
    mean: Float64Array = rays.reshape(pixels, _RAYS, pixels, _RAYS, 4).mean(axis=(1, 3))
    return mean
