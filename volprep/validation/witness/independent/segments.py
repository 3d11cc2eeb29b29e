"""Segments as a scene states them: their looks, their places on the grid of a package, and its labels and looks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.colours import linear_light
from volprep.validation.witness.independent.package import world_from_index
from volprep.validation.witness.independent.scan import CannotWitnessError, Floats, WitnessedScan

Json = Mapping[str, Any]

_OFF_VOXEL = 0.01
_SMALL, _WIDE = 0x7F, 0x7FFF
"""Bits of a label in a texel of one and of two bytes; the bit above them marks cells of several labels."""


@dataclass(frozen=True)
class WitnessedLook:
    """How the scene lets a segment look at first."""

    transfer: str
    """Transfer function that shows it."""
    tint: Floats | None
    """Linear red, green and blue; None if the scene leaves the colour to the source."""
    opacity: float
    visible: bool


def look_of(settings: Json, functions: Sequence[str], number: int) -> WitnessedLook:
    """Return the look of the segment with this number; `functions` are the scene's transfer functions in order.

    Of several styles that name a segment the last one counts.
    """
    found: Json = {}
    for style in settings.get("style") or ():
        labels = style.get("labels") or ()
        if any(isinstance(label, str) for label in labels):
            raise CannotWitnessError("its styles name segments by words")
        if not labels or number in labels:
            found = style
    tint = found.get("tint")
    return WitnessedLook(
        transfer=found.get("transfer") or settings.get("inside") or functions[-1],
        tint=None if tint is None else np.array(linear_light(tint, linear=False)),
        opacity=float(found.get("opacity", 1.0)),
        visible=bool(found.get("visible", True)),
    )


def labels_on(labels: WitnessedScan, grid: Json) -> Floats:
    """Return the numbers of segments [z, y, x] of the voxels of a grid record; 0 outside of the labels.

    Raises CannotWitnessError for labels between the voxels.
    """
    between = np.linalg.inv(labels.world_from_index) @ world_from_index(grid)
    counts = np.array(grid["shape_zyx"][::-1])
    if np.abs((between - np.rint(between)) @ [*counts, 1]).max() > _OFF_VOXEL:
        raise CannotWitnessError("its labels lie on another grid than the scan")
    turn, start = np.rint(between[:3, :3]).astype(np.intp), np.rint(between[:3, 3]).astype(np.intp)
    across = np.abs(turn).argmax(axis=1)
    places, inside = [], []
    for axis in (2, 1, 0):
        place = turn[axis, across[axis]] * np.arange(counts[across[axis]]) + start[axis]
        inside.append((place >= 0) & (place < labels.counts_xyz[axis]))
        places.append(np.clip(place, 0, int(labels.counts_xyz[axis]) - 1))
    slices, rows, columns = inside
    seen = slices[:, None, None] & rows[:, None] & columns
    found: Floats = labels.physical(labels.stored[np.ix_(*places)]) * seen
    return found.transpose(*(2 - np.abs(turn).argmax(axis=0)[::-1]))


def labels_of(texels: NDArray[Any]) -> NDArray[np.int64]:
    """Return the labels [z, y, x] of texels [z, y, x, component] of one or two bytes, the low one first."""
    codes = texels.astype(np.int64)
    if texels.shape[-1] == 1:
        return codes[..., 0] & _SMALL
    return (codes[..., 0] + 256 * codes[..., 1]) & _WIDE


def looks_of(texels: NDArray[Any], count: int) -> Floats:
    """Return linear tint and opacity of each label [label, 4], which are held as square roots."""
    held = texels.reshape(-1, 4)[:count].astype(np.float64)
    roots: Floats = held if texels.dtype.kind == "f" else held / 255.0
    return roots**2
