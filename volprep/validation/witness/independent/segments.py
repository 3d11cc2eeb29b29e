"""Segments as a scene and its label volume state them: numbers, places, volumes and looks of the labels."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.colours import linear_light
from volprep.validation.witness.independent.scan import CannotWitnessError, Floats, WitnessedScan
from volprep.validation.witness.independent.sources import read_scan

Json = Mapping[str, Any]

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


def read_labels(settings: Json, base: Path) -> WitnessedScan:
    """Read the label volume of a scene, whose values are the numbers of segments and 0 outside."""
    path = base / str(settings["source"])
    if path.is_dir() or path.name.endswith((".seg.nrrd", ".dcm")):
        raise CannotWitnessError("only label volumes are read a second time")
    if settings.get("smoothing_mm"):
        raise CannotWitnessError("its borders are smoothed")
    return read_scan({"path": str(path)})


def volume_ml(labels: WitnessedScan, number: int) -> float:
    """Return the volume of a segment: its voxels, each as large as its three edges span."""
    voxel_mm3 = abs(float(np.linalg.det(labels.world_from_index[:3, :3])))
    return float((labels.physical(labels.stored) == number).sum()) * voxel_mm3 / 1000.0


def labels_of(texels: NDArray[Any]) -> NDArray[np.int64]:
    """Return the labels [z, y, x] of texels [z, y, x, component] of one or two bytes, the low one first."""
    codes = texels.astype(np.int64)
    if texels.shape[-1] == 1:
        return codes[..., 0] & _SMALL
    return (codes[..., 0] + 256 * codes[..., 1]) & _WIDE


def looks_of(texels: NDArray[Any], count: int) -> Floats:
    """Return linear tint and opacity of each label [label, 4]; tints are held as square roots."""
    table = texels.reshape(-1, 4)[:count].astype(np.float64) / 255.0
    table[:, :3] **= 2
    return table
