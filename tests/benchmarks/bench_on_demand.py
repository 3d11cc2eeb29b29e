"""Bricks on demand: error against bytes by the order in which bricks come, the bound, and jumps between levels.

    python -m tests.benchmarks.bench_on_demand PACKAGE [PACKAGE ...]

Three orders: by the loss for each byte, as readers choose; the largest voxel on the screen first, as viewers with
octrees do; the nearest brick first, whatever its level. The error is the root mean square over seen
pixels against the picture of all bricks. Jumps: the difference of two neighbouring pixels, less that in the picture of
all bricks, in the mean where bricks of two levels meet in the middle of the view, and elsewhere.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from volprep.render.on_demand.bricks import BrickFile, Held
from volprep.render.on_demand.choice import Place, held_of, in_order
from volprep.render.on_demand.inputs import edit_of
from volprep.render.on_demand.rays import ViewLoss, levels_at_cells, view_loss
from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.reader import Package

PIXELS = 96
SHARES = (0.05, 0.1, 0.2, 0.4, 0.8)
SEEN = 0.5 / 255


def views(bricks: BrickFile) -> dict[str, Float64Array]:
    """Return a view of the whole, one four times as large, and one from the middle of the volume."""
    camera = standard_views(bricks.grid)["anterior-left"]
    inside = standard_views(bricks.grid, "perspective")["anterior-left"]
    half = np.diag([1.0, 1.0, 0.5, 1.0])
    half[2, 3] = 0.5
    near = replace(camera, height_mm=camera.height_mm / 4)
    return {
        "whole": camera.box_from_clip(bricks.grid, 1.0),
        "four times": near.box_from_clip(bricks.grid, 1.0),
        "inside": inside.box_from_clip(bricks.grid, 1.0) @ half,
    }


def ranked(bricks: BrickFile, view: ViewLoss, score: Callable[[int, Float64Array], float]) -> list[Place]:
    """Return the visible bricks, those with the greatest score first: a function of its level and its middle in mm."""
    edges = np.array(bricks.grid.spacing_mm_zyx) * bricks.layout.size

    def middle(level: int, place: tuple[int, int, int]) -> Float64Array:
        return (np.array(place) + 0.5) * edges * bricks.layout.factors_zyx[level]

    visible = list(in_order(bricks, view.gains(bricks)))
    return sorted(visible, key=lambda each: -score(each[0], middle(*each)))


def orders(bricks: BrickFile, matrix: Float64Array, view: ViewLoss) -> dict[str, list[Place]]:
    """Return the three orders."""
    inverse = np.linalg.inv(matrix)
    eye = matrix @ np.array([0.0, 0.0, -1.0, 1.0])
    eye_zyx = (eye[:3] / eye[3])[::-1]

    def pixels(level: int, place_mm: Float64Array) -> float:
        clip = inverse @ np.append(place_mm[::-1], 1.0)
        size = bricks.layout.factors_zyx[level + 1][2] / max(abs(clip[3]), 1e-6)
        # Equal ones, which are all in parallel projection: the nearest first.
        return float(size * (1.0 - 1e-6 * np.linalg.norm(place_mm - eye_zyx)))

    def near(_level: int, place_mm: Float64Array) -> float:
        return -float(np.linalg.norm(place_mm - eye_zyx))

    return {
        "by loss": list(in_order(bricks, view.gains(bricks))),
        "by voxels on the screen": ranked(bricks, view, pixels),
        "by distance": ranked(bricks, view, near),
    }


def error(picture: Float32Array, truth: Float32Array) -> float:
    """Return the root mean square over seen pixels."""
    seen = np.maximum(picture, truth).max(axis=-1) > SEEN
    return float(np.sqrt(((picture - truth)[seen] ** 2).mean())) if seen.any() else 0.0


def jumps(bricks: BrickFile, matrix: Float64Array, held: Held, change: Float32Array) -> tuple[float, float]:
    """Return the mean jumps where levels meet in the middle of the view, and elsewhere."""
    y, x = np.meshgrid(*(np.arange(PIXELS),) * 2, indexing="ij")
    clip = np.stack([(x + 0.5) / PIXELS * 2 - 1, 1 - (y + 0.5) / PIXELS * 2, np.zeros(x.shape), np.ones(x.shape)])
    middle = np.einsum("ij,jyx->iyx", matrix, clip)
    cell = (middle[2::-1] / middle[3]).reshape(3, -1)
    edges = np.array(bricks.grid.spacing_mm_zyx)[:, None] * bricks.layout.size
    shape = np.array(bricks.records[0].shape)[:, None]
    number = np.clip((cell / edges).astype(int), 0, shape - 1)
    level = levels_at_cells(bricks, held)[tuple(number)].reshape(PIXELS, PIXELS)
    apart = np.abs(np.diff(change, axis=1)).max(axis=-1)
    seen = np.abs(change).max(axis=-1)[:, 1:] > SEEN
    face = np.diff(level, axis=1) != 0
    one, other = (float(apart[seen & where].mean()) if (seen & where).any() else 0.0 for where in (face, ~face))
    return one, other


def table(path: Path) -> None:
    """Print the numbers of one package."""
    package = Package.open(path)
    bricks = BrickFile.of(package)
    for name, matrix in views(bricks).items():

        def draw(held: Held, matrix: Float64Array = matrix) -> Float32Array:
            with Renderer(package, target="rgba32f", edit=edit_of(bricks, held, None)) as renderer:
                return renderer.render(matrix, (PIXELS, PIXELS))

        truth, view = draw(bricks.stored), view_loss(bricks, matrix, (PIXELS, PIXELS), one_ray=True)
        for kind, order in orders(bricks, matrix, view).items():
            sizes = np.cumsum([int(bricks.records[level]["size_bytes"][place]) for level, place in order])
            line = []
            for share in SHARES:
                held = held_of(bricks, order[: int(np.searchsorted(sizes, share * sizes[-1]))])
                picture = draw(held)
                face, within = jumps(bricks, matrix, held, picture - truth)
                line.append(
                    f"{error(picture, truth):.4f} (bound {view.bound(bricks, held):.3f}, {face:.4f}/{within:.4f})"
                )
            print(f"{path.stem} | {name} | {kind} | " + " | ".join(line), flush=True)


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        table(Path(argument))
