"""OME-TIFF files of one volume and one channel, with tifffile."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from volprep.validation.witness.independent.scan import CannotWitnessError, WitnessedScan, affine

_MM = {"mm": 1.0, "µm": 1e-3, "nm": 1e-6, "cm": 10.0, "m": 1e3}


def read(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read the first image; the spacing is that of its OME header, the first voxel is at the origin."""
    import tifffile  # noqa: PLC0415 - only for this format

    with tifffile.TiffFile(path) as file:
        series, header = file.series[0], file.ome_metadata
        axes, stored = series.axes, series.asarray()
    kept = tuple(index for index, axis in enumerate(axes) if axis in "ZYX" or stored.shape[index] > 1)
    stored = stored.reshape([stored.shape[index] for index in kept])
    names = "".join(axes[index] for index in kept)
    if sorted(names) == sorted("CZYX") and isinstance(source.get("channel"), int):
        stored, names = stored.take(source["channel"] - 1, names.index("C")), names.replace("C", "")
    if names != "ZYX" or header is None:
        raise CannotWitnessError(f"the file has the axes {axes}")
    pixels = next(each for each in ElementTree.fromstring(header).iter() if each.tag.endswith("Pixels"))  # noqa: S314
    spacing = [
        float(pixels.get(f"PhysicalSize{axis}", "1")) * _MM.get(pixels.get(f"PhysicalSize{axis}Unit", "µm"), 1.0)
        for axis in "XYZ"
    ]
    return WitnessedScan(stored, 1.0, 0.0, affine(np.diag(spacing), np.zeros(3)), "")
