"""A series of single-frame DICOM files, with pydicom."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.scan import CannotWitnessError, WitnessedScan, affine

_ONE_PLACE_MM = 1e-4
_OF_COPIES = ("ImagePositionPatient", "RescaleSlope", "RescaleIntercept", "PixelData")
"""Elements that are equal in copies of an image."""


def read(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read the series; slices are in the order of their positions along the normal of the first."""
    from pydicom.pixels.utils import pixel_array  # noqa: PLC0415 - only for this format

    headers = _series(path, source.get("series"))
    if source.get("volume"):
        raise CannotWitnessError("the series has several volumes")
    first = headers[0]
    if int(getattr(first, "NumberOfFrames", 1) or 1) != 1 or "PixelData" not in first:
        raise CannotWitnessError("the files have several frames each")
    if int(first.SamplesPerPixel) != 1 and not source.get("colour"):
        raise CannotWitnessError("the pictures have colours")
    along_row, along_column = np.array(first.ImageOrientationPatient, dtype=np.float64).reshape(2, 3)
    normal = np.cross(along_row, along_column)
    places = np.array([header.ImagePositionPatient for header in headers], dtype=np.float64)
    order = _without_copies(headers, places @ normal)
    places = places[order]
    between_rows_mm, between_columns_mm = (float(value) for value in first.PixelSpacing)
    thickness_mm = float(getattr(first, "SliceThickness", None) or 1.0)
    step = (places[-1] - places[0]) / (len(places) - 1) if len(places) > 1 else normal * thickness_mm
    axes = np.column_stack([along_row * between_columns_mm, along_column * between_rows_mm, step])
    slopes = [
        (float(getattr(header, "RescaleSlope", 1)), float(getattr(header, "RescaleIntercept", 0))) for header in headers
    ]
    slices = [pixel_array(headers[number]) for number in order]
    if len(set(slopes)) == 1:
        return WitnessedScan(np.stack(slices), *slopes[0], affine(axes, places[0]), "")
    scaled = [(slopes[number], slice_) for number, slice_ in zip(order, slices, strict=True)]
    physical = [(slope * plane + intercept).astype(np.float32) for (slope, intercept), plane in scaled]
    return WitnessedScan(np.stack(physical), 1.0, 0.0, affine(axes, places[0]), "")


def _without_copies(headers: Sequence[Any], along_mm: NDArray[np.float64]) -> list[int]:
    """Return the numbers of slices in their order along the normal; of equal ones at one place the first."""
    order: list[int] = []
    for number in map(int, np.argsort(along_mm, kind="stable")):
        if not order or along_mm[number] - along_mm[order[-1]] > _ONE_PLACE_MM:
            order.append(number)
        elif any(headers[number].get(name) != headers[order[-1]].get(name) for name in _OF_COPIES):
            raise CannotWitnessError("several slices lie at one place")
    return order


def _series(path: Path, wanted: str | None) -> list[Any]:
    import pydicom  # noqa: PLC0415 - as above
    from pydicom.errors import InvalidDicomError  # noqa: PLC0415 - as above

    found: dict[str, list[Any]] = {}
    for file in sorted(path for path in path.rglob("*") if path.is_file()) if path.is_dir() else [path]:
        try:
            header = pydicom.dcmread(file)
        except InvalidDicomError:
            continue
        if "PixelData" in header and "ImagePositionPatient" in header:
            found.setdefault(str(header.SeriesInstanceUID), []).append(header)
    chosen = [series for uid, series in found.items() if wanted is None or uid.endswith(wanted)]
    if len(chosen) != 1:
        raise CannotWitnessError(f"{len(chosen)} series with single frames were found")
    return chosen[0]
