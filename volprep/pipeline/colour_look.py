"""Default look of a scan in colour without a scene: what its colours and its margin say about the extinction.

Alpha is taken if it says anything. Else the margin of the slices has the colour of the background, and extinction
follows the distance to it; slices without such a margin, or of that colour alone, show all of their bright parts.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from volprep.scan.repair import open_scan
from volprep.scene.scene import Scene
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import format_of_source
from volprep_formats.readers.colour import unpacked
from volprep_formats.source import ColourChannel, OpacityOf, SourceSpec
from volprep_formats.srgb import srgb_of_linear

IN_COLOUR = frozenset(("VP1022", "VP1035", "VP1101", "VP1121", "VP1141", "VP1164", "VP1202", "VP1221", "VP1282"))
"""Errors of readers that colours may cause."""
_CHANNELS = "VP1221"
"""Several channels, which in OME-Zarr are rather stains than colours."""
_COMPONENTS, _LIST = "VP1101", "list"
"""Several values at each voxel of an NRRD file, which in an axis of this kind are frames or directions."""
_NO_COLOURS = "VP1290"
_SLICES, _PIXELS = 9, 512
"""Slices that are looked at, and rows and columns of each that are taken, about."""
_DENSE_SHARE = 150.0
"""Extinction of visible voxels: 78 % are hidden after a hundredth of the diagonal, so that it looks solid."""
_MOST_MARGIN = 0.15
"""Distance of sRGB colours, from 0 to 1, up to which a pixel of the margin has the colour of the background."""
_LEAST_SHARE = 0.5
"""Part of the margin that must have it."""
_NOISE = 98.0
"""Per cent of those pixels that show nothing."""

_BRIGHT: dict[str, object] = {"extinction": "luminance"}
_BRIGHT_ENDS = (0.05, 0.6)
"""Luminance, from 0 to 1, where pixels of a scan without a background begin to show, and where they are solid."""


@dataclass(frozen=True)
class _Pixels:
    """A few slices: sRGB colours [slice, row, column, 3] and alpha, None if it says nothing; and the diagonal."""

    colours: Float64Array
    alpha: Float64Array | None
    diagonal_mm: float


def in_colour(scene: Scene, error: VolprepError) -> Scene:
    """Return the scene of a scan in colour that no scene describes, drawn in its colours.

    Raises `error`, which says that the scan cannot be read as values, again if colours are not the reason, and another
    error if colours are not the only reason.
    """
    spec = scene.source
    if error.code not in IN_COLOUR or spec.rgb is not None or spec.colour is not None or spec.channels:
        raise error
    if error.code == _COMPONENTS and error.fields["kind"] == _LIST:
        raise error
    if error.code == _CHANNELS and format_of_source(spec, Path("/")) == "ome-zarr":
        raise error
    try:
        pixels = _pixels(spec)
    except VolprepError as other:
        # Colours were found, and something else is wrong, which the user has to know.
        is_about_colours = other.code in IN_COLOUR or other.code == _NO_COLOURS
        raise (error if is_about_colours else other) from None
    said, table = _look(pixels)
    tables = scene.model_dump(mode="json", exclude_unset=True, exclude={"source", "transfer", "recognised"})
    text = f"recognised as a volume in colour, {said}; a scene with [colour], or --rgb luminance, draws it otherwise"
    tables |= {"source": spec.model_dump(mode="json", exclude_unset=True), "colour": table, "recognised": text}
    try:
        return Scene.model_validate(tables)
    except ValidationError:
        raise error from None


def _pixels(spec: SourceSpec) -> _Pixels:
    """Read a few slices. Raises the errors of the reader."""
    alpha: Float64Array | None = None
    try:
        light, alpha, diagonal_mm = _read(spec, "alpha", ((0.0, 0.0), (1.0, 1.0)))
    except VolprepError:
        light, _, diagonal_mm = _read(spec, "luminance", ((0.0, 1.0), (1.0, 1.0)))
    if alpha is not None:
        # Light is multiplied by alpha.
        light = np.divide(light, alpha[..., None], out=np.zeros_like(light), where=alpha[..., None] > 0.0)
        alpha = None if alpha.min() == alpha.max() else alpha
    return _Pixels(srgb_of_linear(np.minimum(light, 1.0)), alpha, diagonal_mm)


def _read(
    spec: SourceSpec, opacity_of: OpacityOf, shares: tuple[tuple[float, float], ...]
) -> tuple[Float64Array, Float64Array, float]:
    """Return light [slice, row, column, 3] and extinction of a few slices, and the diagonal in millimetres."""
    wanted = ColourChannel(part="all", opacity_of=opacity_of, shares=shares)
    with open_scan(spec.model_copy(update={"colour": wanted}), Path("/"), Silent()) as source:
        grid = source.info.grid
        depth = grid.shape_zyx[0]
        places = np.unique(np.linspace(0, depth - 1, min(depth, _SLICES)).round().astype(int)).tolist()
        step = max(1, max(grid.shape_zyx[1:]) // _PIXELS)
        values = np.concatenate([unpacked(source.read_slab(z, z + 1)[:, ::step, ::step]) for z in places]) / 65535
    return values[..., :3], values[..., 3], math.hypot(*grid.extent_mm_zyx)


def _look(pixels: _Pixels) -> tuple[str, dict[str, object]]:
    """Return the kind that was recognised, and the table [colour]."""
    dense_per_mm = _DENSE_SHARE / pixels.diagonal_mm
    if pixels.alpha is not None:
        return "whose alpha says what is seen", {"extinction": "alpha", "points": _ramp(0.0, 1.0, dense_per_mm)}
    rows = pixels.colours[:, [0, -1]].reshape(-1, 3)
    columns = pixels.colours[:, :, [0, -1]].reshape(-1, 3)
    margin = np.concatenate([rows, columns])
    background = np.median(margin, axis=0)
    distances = np.linalg.norm(margin - background, axis=1) / math.sqrt(3.0)
    near = distances[distances <= _MOST_MARGIN]
    if len(near) < _LEAST_SHARE * len(margin):
        return "without a margin of one colour", _BRIGHT | {"points": _ramp(*_BRIGHT_ENDS, dense_per_mm)}
    code = "#" + "".join(f"{round(255 * part):02x}" for part in background.tolist())
    low = round(max(0.04, 1.5 * float(np.percentile(near, _NOISE))), 3)
    # From the background's colour to the object's own. Pixels at outlines are a mixture of both: if they were solid,
    # dark ones and bright ones would lie on a curved surface in rings.
    away = np.linalg.norm(pixels.colours - background, axis=-1) / math.sqrt(3.0)
    shown = away[away > low]
    if not shown.size:
        return "without a background of its own", _BRIGHT | {"points": _ramp(*_BRIGHT_ENDS, dense_per_mm)}
    usual = float(np.median(shown))
    low, high = max(low, round(0.25 * usual, 3)), max(2.0 * low, round(usual, 3))
    said = f"on a background of {code}"
    table: dict[str, object] = {
        "extinction": "background",
        "background": code,
        "points": _ramp(low, high, dense_per_mm),
    }
    return said, table


def _ramp(low: float, high: float, dense_per_mm: float) -> list[dict[str, float]]:
    return [
        {"value": low, "extinction_per_mm": 0.0},
        {"value": min(high, 1.0), "extinction_per_mm": float(f"{dense_per_mm:.3g}")},
    ]
