"""Contents of a figure of a package's layout: panels of shapes in box millimetres, and their file format for VTK."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array, UInt8Array

Colour = str
"""A CSS colour, #rrggbb."""
GREY, BLUE, ORANGE, TEAL, RED = "#9aa0a6", "#3566a8", "#d9822b", "#2a9d8f", "#b3372f"


@dataclass(frozen=True)
class Surface:
    """Polygons of three or four corners each."""

    points_mm_xyz: Float64Array
    """Corners, [n, 3]."""
    faces: NDArray[np.int64]
    """Corners of each polygon, [m, 3] or [m, 4]."""
    colour: Colour
    """Its colour."""
    opacity: float = 1.0
    """Its opacity."""


@dataclass(frozen=True)
class Strokes:
    """Straight lines."""

    ends_mm_xyz: Float64Array
    """Begin and end of each, [n, 2, 3]."""
    colour: Colour
    """Their colour."""
    width: float = 1.0
    """Their width in pixels; from 4 they are tubes."""


@dataclass(frozen=True)
class Points:
    """Round points."""

    points_mm_xyz: Float64Array
    """Positions, [n, 3]."""
    colour: Colour
    """Their colour."""
    size: float = 9.0
    """Their width in pixels."""


@dataclass(frozen=True)
class Slice:
    """A picture in space."""

    corners_mm_xyz: Float64Array
    """Corner of the texel that is stored first, and the corners at the end of a row and of a column, [3, 3]."""
    texels: UInt8Array
    """sRGB and opacity, not multiplied, [row, column, RGBA]."""


Shape = Surface | Strokes | Points | Slice


@dataclass(frozen=True)
class Panel:
    """One part of the figure."""

    title: str
    """Title of the panel."""
    extent_mm_xyz: tuple[float, float, float]
    """Size of the box."""
    direction: NDArray[np.float64]
    """Columns are the unit world vectors along x, y and z of the box: a head is shown upright."""
    shapes: Sequence[Shape]
    """Shapes, in box millimetres."""


_KINDS = {kind.__name__: kind for kind in (Surface, Strokes, Points, Slice)}


def save_panels(panels: Sequence[Panel], path: Path) -> None:
    """Write panels as an archive of arrays."""
    arrays: dict[str, NDArray[np.generic]] = {}
    record = []
    for panel in panels:
        shapes = []
        for shape in panel.shapes:
            entry: dict[str, object] = {"kind": type(shape).__name__}
            for name, value in vars(shape).items():
                if isinstance(value, np.ndarray):
                    arrays[key := f"array{len(arrays)}"] = value
                    entry[name] = {"array": key}
                else:
                    entry[name] = value
            shapes.append(entry)
        plain = {"title": panel.title, "extent_mm_xyz": panel.extent_mm_xyz, "direction": panel.direction.tolist()}
        record.append(plain | {"shapes": shapes})
    np.savez(path, record=json.dumps(record), **arrays)  # type: ignore[arg-type]  # names are not allow_pickle


def load_panels(path: Path) -> list[Panel]:
    """Read the panels that `save_panels` has written."""
    with np.load(path) as arrays:
        return [
            Panel(
                panel["title"],
                tuple(panel["extent_mm_xyz"]),
                np.array(panel["direction"]),
                [
                    _KINDS[shape.pop("kind")](
                        **{
                            name: arrays[value["array"]] if isinstance(value, dict) else value
                            for name, value in shape.items()
                        }
                    )
                    for shape in panel["shapes"]
                ],
            )
            for panel in json.loads(str(arrays["record"]))
        ]


def box_surface(low_mm_xyz: Float64Array, high_mm_xyz: Float64Array) -> tuple[Float64Array, NDArray[np.int64]]:
    """Return corners and faces of boxes, whose lower and upper corners are [n, 3]."""
    low, high = np.atleast_2d(low_mm_xyz), np.atleast_2d(high_mm_xyz)
    corner = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
    points = low[:, None, :] + corner * (high - low)[:, None, :]
    sides = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    faces = sides[None] + 8 * np.arange(len(low))[:, None, None]
    return points.reshape(-1, 3), faces.reshape(-1, 4)


def box_lines(low_mm_xyz: Float64Array, high_mm_xyz: Float64Array) -> Float64Array:
    """Return the twelve edges of each box, [n, 2, 3]."""
    points, _ = box_surface(low_mm_xyz, high_mm_xyz)
    edges = np.array([(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit])
    lines: Float64Array = points.reshape(-1, 8, 3)[:, edges].reshape(-1, 2, 3)
    return lines
