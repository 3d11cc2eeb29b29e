"""Stacks of pictures: pages of a TIFF file, or a file for each slice, with tifffile or Pillow."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.scan import CannotWitnessError, WitnessedScan, affine

_ASSOCIATED = 1
"""ExtraSamples of TIFF: colours are multiplied by alpha."""


def read_tiff(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read TIFF files with tifffile."""
    import tifffile  # noqa: PLC0415 - only for this format

    def pages(file: Path) -> NDArray[Any]:
        with tifffile.TiffFile(file) as opened:
            if _ASSOCIATED in opened.pages.first.extrasamples:
                raise CannotWitnessError("its colours are multiplied by alpha")
            return np.asarray(opened.asarray())

    return _stacked(path, source, pages)


def read_pictures(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read any pictures with Pillow."""
    from PIL import Image  # noqa: PLC0415 - only for this format

    def pixels(file: Path) -> NDArray[Any]:
        with Image.open(file) as opened:
            return np.asarray(opened)

    return _stacked(path, source, pixels)


def _stacked(path: Path, source: Mapping[str, Any], read: Callable[[Path], NDArray[Any]]) -> WitnessedScan:
    files = sorted(path.iterdir(), key=_numbers) if path.is_dir() else [path]
    slices = [read(file) for file in files if not file.name.startswith(".")]
    axes = 4 if source.get("colour") else 3
    stored = slices[0] if len(slices) == 1 and slices[0].ndim == axes else np.stack(slices)
    spacing_mm_zyx = (source.get("stack") or {}).get("spacing_mm_zyx", (1.0, 1.0, 1.0))
    return WitnessedScan(stored, 1.0, 0.0, affine(np.diag(spacing_mm_zyx[::-1]), np.zeros(3)), "")


def _numbers(file: Path) -> list[int | str]:
    """Return the parts of a name such that slice 10 comes after slice 9."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", file.name)]
