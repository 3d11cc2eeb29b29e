"""NIfTI files, with nibabel."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from volprep.validation.witness.independent.scan import CannotWitnessError, WitnessedScan

_LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])
_MM = {"mm": 1.0, "meter": 1e3, "micron": 1e-3, "unknown": 1.0}


def read(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read a volume; NIfTI has its axes to the right, to the front and up."""
    import nibabel  # noqa: PLC0415 - only for this format

    image: Any = nibabel.load(path)
    header = image.header
    volume = int(source.get("volume") or 0)
    stored = np.asanyarray(image.dataobj.get_unscaled())
    stored = stored.reshape(stored.shape[:3] + tuple(n for n in stored.shape[3:] if n > 1))
    if stored.ndim > 4 or (stored.ndim == 4 and not volume):
        raise CannotWitnessError("the file has several volumes")
    stored = stored[..., volume - 1] if stored.ndim == 4 else stored
    matrix = _LPS_FROM_RAS @ image.affine
    matrix[:3] *= _MM[header.get_xyzt_units()[0]]
    return WitnessedScan(
        stored.T,
        float(image.dataobj.slope),
        float(image.dataobj.inter),
        matrix,
        "",
    )
