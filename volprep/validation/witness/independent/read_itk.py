"""MetaImage, NRRD and NIfTI files, and DICOM series, with SimpleITK, whose space is the patient's (LPS)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from volprep.validation.witness.independent.scan import CannotWitnessError, WitnessedScan, affine


def read(path: Path, source: Mapping[str, Any]) -> WitnessedScan:  # noqa: ARG001 - as every reader
    """Read a volume of one component."""
    import SimpleITK  # noqa: PLC0415 - only for this format

    return _scan(SimpleITK.ReadImage(str(path)))


def read_series(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read a DICOM series of single frames, compressed or not."""
    import SimpleITK  # noqa: PLC0415 - as above

    reader: Any = SimpleITK.ImageSeriesReader
    wanted = str(source.get("series") or "")
    found = [uid for uid in reader.GetGDCMSeriesIDs(str(path)) if uid.endswith(wanted)] if path.is_dir() else []
    if len(found) != 1:
        raise CannotWitnessError(f"{len(found)} series with single frames were found")
    return _scan(SimpleITK.ReadImage(reader.GetGDCMSeriesFileNames(str(path), found[0])))


def _scan(image: Any) -> WitnessedScan:
    import SimpleITK  # noqa: PLC0415 - as above

    if image.GetDimension() != 3 or image.GetNumberOfComponentsPerPixel() != 1:
        raise CannotWitnessError(f"the file has {image.GetDimension()} axes")
    axes = np.array(image.GetDirection()).reshape(3, 3) * np.array(image.GetSpacing())
    return WitnessedScan(SimpleITK.GetArrayFromImage(image), 1.0, 0.0, affine(axes, np.array(image.GetOrigin())), "")
