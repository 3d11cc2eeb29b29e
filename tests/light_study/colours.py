"""`python -m tests.light_study.colours` measures what one texel of light in colour costs, on thinned scans.

A texel has two numbers at each end of the share, so that light lies in a plane of colours through grey. The table has
decibels over seen pixels beyond the noise of paths that are traced in colour: of the field's six numbers as floats, and
of two colours, as packages store them. Decibels of one beside the other have no noise. "Left out" is the root mean
square of the light beyond the plane at places that the field was not fitted to. All is at half of the scan's grid, with
tissue of several colours.
"""

import argparse
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.light_study.__main__ import VIEWS, drawn, stored, traced
from tests.light_study.subjects import KINDS, SCANS, subjects
from volprep.parts.light import solve
from volprep.parts.light.codes import left_out
from volprep.parts.light.trial import baked_field
from volprep.truth.camera import standard_views
from volprep.truth.path_traced import LitVolume, squares_beyond_noise
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel, Sun
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.progress import Silent

_SKY, _GROUND = (0.6, 0.8, 1.0), (0.5, 0.4, 0.3)
_FRONT, _LEFT, _RIGHT = (-0.5, -0.6, 0.62), (0.9, -0.3, 0.3), (-0.9, -0.3, 0.3)
LIGHTS = {
    "white sky": LightModel(kind="scattering", channels="rgb"),
    "sky and ground": LightModel(kind="scattering", channels="rgb", sky=_SKY, ground=_GROUND),
    "sun": LightModel(
        kind="scattering",
        channels="rgb",
        sky=(0.5, 0.75, 1.0),
        ground=(0.45, 0.3, 0.2),
        suns=(Sun(direction=_FRONT, colour=(1.6, 1.2, 0.7), size_degrees=20.0),),
    ),
    "two suns of other hues": LightModel(
        kind="scattering",
        channels="rgb",
        sky=(0.2, 0.2, 0.2),
        ground=(0.2, 0.2, 0.2),
        suns=(
            Sun(direction=_LEFT, colour=(1.5, 0.2, 0.2), size_degrees=40.0),
            Sun(direction=_RIGHT, colour=(0.2, 0.2, 1.5), size_degrees=40.0),
        ),
    ),
}
"""Light around the volume. Of a sun of 20 degrees half of the grid does not resolve the shadows."""
_TISSUE = ((0.9, 0.4, 0.3), (0.95, 0.6, 0.35), (0.95, 0.9, 0.8))
_FACTORS = (8, 4, 2)


def tissue(look: TransferFunction) -> TransferFunction:
    """Return a function of two points with colours of tissue; colours of a hard one change behind its step, too."""
    first, last = look.points
    rises = last.extinction_per_mm - first.extinction_per_mm
    ends = (0.0, 0.5, 1.0) if look.name == "soft" else (0.0, 1.0, 20.0)
    points = (
        TransferPoint(
            value=first.value + end * (last.value - first.value),
            colour=colour,
            extinction_per_mm=first.extinction_per_mm + min(end, 1.0) * rises,
        )
        for end, colour in zip(ends, _TISSUE, strict=True)
    )
    return TransferFunction(name=look.name, points=tuple(points))


def thinned(lit: LitVolume, n: int) -> LitVolume:
    """Return every `n`th voxel along each axis. Extinctions for each voxel stay."""
    voxels = np.ascontiguousarray(lit.volume[::n, ::n, ::n])
    z, y, x = (n * each for each in lit.grid.spacing_mm_zyx)
    look = lit.transfer_function
    points = [each.model_copy(update={"extinction_per_mm": each.extinction_per_mm / n}) for each in look.points]
    thin = look.model_copy(update={"points": tuple(points)})
    return replace(lit, volume=voxels, grid=Grid.of(voxels.shape, (z, y, x)), transfer_function=thin)


def row(lit: LitVolume, asked: argparse.Namespace) -> str:
    """Measure one scan under one light; return the numbers of a line of the table."""
    start = time.process_time()
    field = solve.solve_fields(lit, _FACTORS, solve.BATCH, Silent())[-1]
    assert field.hues is not None
    views = standard_views(lit.grid)
    truth = traced(lit, [views[each] for each in VIEWS], asked.pixels, asked.paths)
    floats, codes = (
        [drawn(lit, camera, asked.pixels, way) for camera in truth.cameras]
        for way in (baked_field(field, lit.grid), stored(field, lit.grid))
    )
    beyond = [
        np.concatenate([squares_beyond_noise(one, other) for one, other in zip(each, truth.pictures, strict=True)])
        for each in (floats, codes)
    ]
    seen = [picture.rgba[..., 3] > 0 for picture in truth.pictures]
    apart = [(one - other)[mask, :3] ** 2 for one, other, mask in zip(floats, codes, seen, strict=True)]
    numbers = [_decibels(each) for each in (*beyond, np.concatenate(apart))]
    cells = " | ".join(f"{each:.1f}" for each in numbers)
    return f"{cells} | {left_out(field.hues):.4f} | {time.process_time() - start:.0f}"


def _decibels(squares: Float64Array) -> float:
    return float(-10 * np.log10(max(float(squares.mean()), 1e-8)))


def main() -> None:
    """Measure the scans that are asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.light_study.colours", description=__doc__)
    parser.add_argument("scans", nargs="*", metavar="SCAN", help=f"of {', '.join(SCANS)}; all if absent")
    parser.add_argument("--data", type=Path, default=os.environ.get("VOLPREP_TEST_DATA"), help="the data for tests")
    parser.add_argument("--light", choices=LIGHTS, help="all if absent")
    parser.add_argument("--function", choices=KINDS, help="both if absent")
    parser.add_argument("--pixels", type=int, default=48)
    parser.add_argument("--paths", type=int, default=128)
    parser.add_argument("--places", type=int, default=solve.BATCH, help="that a field is fitted to")
    parser.add_argument("--thin", type=int, default=1, help="takes every Nth voxel of the study's scans")
    asked = parser.parse_args()
    solve.BATCH = asked.places
    head = "| scan | light | function | six floats | two colours | one beside the other | left out | processor s |\n"
    sys.stdout.write(f"{head}{'|---' * 8}|\n")
    kinds = [asked.function] if asked.function else KINDS
    for name, kind, whole in subjects(asked.data, asked.scans or list(SCANS), kinds):
        lit = thinned(whole, asked.thin)
        for light, model in LIGHTS.items():
            if asked.light in {None, light}:
                coloured = replace(lit, transfer_function=tissue(lit.transfer_function), model=model)
                shape = "×".join(map(str, lit.grid.shape_zyx[::-1]))
                sys.stdout.write(f"| {name}, {shape} | {light} | {kind} | {row(coloured, asked)} |\n")
                sys.stdout.flush()


if __name__ == "__main__":
    main()
