"""Whether the preview picture of a package shows the package."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO
from numpy.typing import NDArray

from volprep.pipeline.preview import preview_png
from volprep.validation.records import Deviation
from volprep_formats.package.reader import Package

_LARGEST_RMSE = 0.02
"""Two drivers differ by one of 255 steps in some pixels, 0.004; another package differs by more than this."""


def preview_findings(package: Package) -> Iterator[Deviation]:
    """Draw the preview of `package` again, and return a finding if the one that it ships shows something else."""
    name = package.manifest.preview
    if name is None:
        yield Deviation(code="VP6034", item="the preview", problem="is not there")
        return
    held, drawn = package.read_bytes(name), preview_png(package)
    if held == drawn:
        return
    pictures = [_pixels(held), _pixels(drawn)]
    if pictures[0] is None or pictures[1] is None or pictures[0].shape != pictures[1].shape:
        yield Deviation(code="VP6034", item=name, problem="is no picture of the size of previews")
        return
    rmse = float(np.sqrt(np.mean((pictures[0] - pictures[1]) ** 2))) / 255
    if rmse > _LARGEST_RMSE:
        yield Deviation(code="VP6034", item=name, problem=f"shows something else than the package: RMSE {rmse:.2g}")


def _pixels(data: bytes) -> NDArray[np.float64] | None:
    """Return the pixels of a PNG file, None if it is not one."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "preview.png"
        path.write_bytes(data)
        picture = OpenImageIO.ImageBuf(str(path))
        if picture.has_error or not picture.initialized:
            return None
        return np.asarray(picture.get_pixels("uint8"), np.float64)
