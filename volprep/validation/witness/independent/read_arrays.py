"""Raw voxels and NumPy files, with NumPy alone."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.scan import CannotWitnessError, WitnessedScan, affine


def read_raw(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read a file without a header, whose layout is in the scene."""
    layout = source.get("raw")
    if not layout:
        raise CannotWitnessError("the scene has no table [source.raw] for a file without a header")
    order = ">" if layout.get("byte_order", "little") == "big" else "<"
    dtype = np.dtype(layout["dtype"]).newbyteorder(order)
    offset, shape = int(layout.get("header_bytes", 0)), tuple(layout["shape_zyx"])
    stored = np.fromfile(path, dtype, count=int(np.prod(shape)), offset=offset).reshape(shape)
    return _at_origin(stored, layout.get("spacing_mm_zyx", (1.0, 1.0, 1.0)))


def read_npy(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read an array [z, y, x]."""
    layout = source.get("array") or {}
    loaded = np.load(path, allow_pickle=False)
    stored = loaded[layout.get("name") or loaded.files[0]] if path.suffix == ".npz" else loaded
    return _at_origin(stored, layout.get("spacing_mm_zyx", (1.0, 1.0, 1.0)))


def _at_origin(stored: NDArray[Any], spacing_mm_zyx: tuple[float, float, float]) -> WitnessedScan:
    return WitnessedScan(stored, 1.0, 0.0, affine(np.diag(spacing_mm_zyx[::-1]), np.zeros(3)), "")
