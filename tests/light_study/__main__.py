"""`python -m tests.light_study` measures light that is computed once against path tracing, on thinned scans.

It prints a table in Markdown: decibels over seen pixels beyond the noise of the paths, three views, with the field at
half and at a quarter of the grid. "Floats" is the field before it has codes of 8 bits, so that the difference is what
the bits cost. "Cut" is the middle plane through the volume: the half behind it is lit with the light of the whole, and
compared with path tracing of the half alone; "own" is the light of the half, as `lighting.clip_aware` stores it.
"""

import argparse
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tests.light_study.subjects import KINDS, SCANS, subjects
from volprep.parts.light.codes import coded, coded_alike
from volprep.parts.light.decision import sample_count
from volprep.parts.light.lit import middle_plane, views_of_a_cut
from volprep.parts.light.solve import BATCH, LightField, solve_fields
from volprep.parts.light.trial import baked_field
from volprep.truth.camera import Camera, standard_views
from volprep.truth.lit import BakedField
from volprep.truth.path_traced import LitVolume, TracedPicture, squares_beyond_noise, traced_picture
from volprep.truth.refined import refined_lit
from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.progress import Silent

VIEWS = ("anterior", "anterior-left", "superior")
TOLERANCE = 1e-3
_FACTORS = (16, 8, 4, 2)


@dataclass(frozen=True)
class Truth:
    """A volume, and its path-traced pictures of some views."""

    lit: LitVolume
    cameras: list[Float64Array]
    pictures: list[TracedPicture]

    def decibels(self, baked: BakedField | None) -> float:
        """Return decibels over seen pixels beyond the noise."""
        squares = [
            squares_beyond_noise(drawn(self.lit, camera, truth.rgba.shape[0], baked), truth)
            for camera, truth in zip(self.cameras, self.pictures, strict=True)
        ]
        return float(-10 * np.log10(max(float(np.concatenate(squares).mean()), 1e-8)))


def traced(lit: LitVolume, views: Sequence[Camera], pixels: int, paths: int) -> Truth:
    """Path trace the views of a volume."""
    cameras = [view.box_from_clip(lit.grid, 1.0) for view in views]
    return Truth(lit, cameras, [traced_picture(lit, camera, (pixels, pixels), paths) for camera in cameras])


def drawn(lit: LitVolume, camera: Float64Array, pixels: int, baked: BakedField | None) -> Float64Array:
    """Draw a view with a field of light, or unlit."""
    return refined_lit(lit, camera, (pixels, pixels), TOLERANCE, baked=baked).rgba


def stored(field: LightField, grid: Grid) -> BakedField:
    """Return a field as a package stores it."""
    return baked_field(coded(field).decoded(field), grid)


def row(name: str, kind: str, lit: LitVolume, asked: argparse.Namespace) -> str:
    """Measure one scan with one function; return a line of the table."""
    views = standard_views(lit.grid)
    truth = traced(lit, [views[name] for name in VIEWS], asked.pixels, asked.paths)
    start = time.process_time()
    z, y, x = (-(-n // _FACTORS[-1]) for n in lit.grid.shape_zyx)
    count = asked.batches * BATCH if asked.batches else sample_count((z, y, x))
    quarter, half = solve_fields(lit, _FACTORS, count, Silent())[2:]
    seconds = time.process_time() - start
    plane = middle_plane(lit.grid)
    half_body = replace(lit, planes=plane)
    cut = traced(half_body, views_of_a_cut(lit.grid, plane), asked.pixels, asked.paths)
    own = solve_fields(half_body, _FACTORS, count, Silent(), curve=half.curve)[-1]
    shape = "×".join(map(str, lit.grid.shape_zyx[::-1]))
    numbers = [
        truth.decibels(None),
        truth.decibels(stored(quarter, lit.grid)),
        truth.decibels(stored(half, lit.grid)),
        truth.decibels(baked_field(half, lit.grid)),
        cut.decibels(None),
        cut.decibels(stored(half, lit.grid)),
        cut.decibels(baked_field(coded_alike([half, own])[1].decoded(own), lit.grid)),
    ]
    return f"| {name}, {shape} | {kind} | {' | '.join(f'{each:.1f}' for each in numbers)} | {seconds:.0f} |"


def main() -> None:
    """Measure the scans that are asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.light_study", description=__doc__)
    parser.add_argument("scans", nargs="*", metavar="SCAN", help=f"of {', '.join(SCANS)}; all if absent")
    parser.add_argument("--data", type=Path, default=os.environ.get("VOLPREP_TEST_DATA"), help="the data for tests")
    parser.add_argument("--function", choices=KINDS, help="both if absent")
    parser.add_argument("--pixels", type=int, default=64)
    parser.add_argument("--paths", type=int, default=256)
    parser.add_argument("--batches", type=int, help="of samples; as many as a build makes if absent")
    asked = parser.parse_args()
    head = (
        "| scan | function | unlit | 1/4 | 1/2 | 1/2, floats | cut, unlit | cut, 1/2 | cut, own 1/2 | processor s |\n"
        + "|---" * 10
    )
    sys.stdout.write(f"{head}|\n")
    for name, kind, lit in subjects(
        asked.data, asked.scans or list(SCANS), [asked.function] if asked.function else KINDS
    ):
        sys.stdout.write(row(name, kind, lit, asked) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
