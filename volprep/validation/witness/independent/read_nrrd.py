"""NRRD files, with pynrrd."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from volprep.validation.witness.independent.scan import CannotWitnessError, WitnessedScan, affine


def read(path: Path, source: Mapping[str, Any]) -> WitnessedScan:  # noqa: ARG001 - as every reader
    """Read a volume of three spatial axes."""
    import nrrd  # noqa: PLC0415 - only for this format

    stored, header = nrrd.read(str(path), index_order="C")
    if stored.ndim != 3:
        raise CannotWitnessError(f"the file has {stored.ndim} axes")
    space = str(header.get("space", "")).lower()
    signs = {"right-anterior-superior": (-1.0, -1.0, 1.0), "ras": (-1.0, -1.0, 1.0)}
    if space in {"left-anterior-superior", "las"}:
        signs[space] = (1.0, -1.0, 1.0)
    sign = np.array(signs.get(space, (1.0, 1.0, 1.0)))
    if "space directions" in header:
        axes = np.array(header["space directions"], dtype=np.float64).T
    else:
        axes = np.diag(np.array(header.get("spacings", (1.0, 1.0, 1.0)), dtype=np.float64))
    origin = np.array(header.get("space origin", (0.0, 0.0, 0.0)), dtype=np.float64)
    return WitnessedScan(stored, 1.0, 0.0, affine(sign[:, None] * axes, sign * origin), "")
