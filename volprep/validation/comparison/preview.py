"""Whether the preview picture of a package shows the package."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.pipeline.preview import preview_png
from volprep.validation.results.measurements import Deviation
from volprep_formats.package.reader import Package
from volprep_formats.png import png_problem

_LARGEST_RMSE = 0.02
"""Two drivers differ by one of 255 steps in some pixels, 0.004; another package differs by more than this."""
_BLOCK = 8
_LARGEST_BLOCK_DIFFERENCE = 0.05
"""Largest difference of the means of 8×8 pixels. Differences between two drivers average out; a patch does not."""


def preview_findings(package: Package) -> Iterator[Deviation]:
    """Draw the preview of `package` again, and return a finding if the shipped one differs."""
    name = package.manifest.preview
    if name is None:
        yield Deviation(code="VP6034", item="the preview", problem="is not there")
        return
    held, drawn = package.read_bytes(name), preview_png(package)
    if held == drawn:
        return
    expected = _pixels(drawn)
    problem = png_problem(held, expected.shape[1], expected.shape[0], expected.shape[2])
    if problem is not None:
        yield Deviation(code="VP6034", item=name, problem=problem)
        return
    # It must have the size of the drawn picture, so that decoding it takes no more memory.
    difference = (_pixels(held) - expected) / 255
    rmse = float(np.sqrt(np.mean(difference**2)))
    block = _largest_block(difference)
    if rmse > _LARGEST_RMSE or block > _LARGEST_BLOCK_DIFFERENCE:
        problem = f"shows something else than the package: RMSE {rmse:.2g}, {block:.2g} in one place"
        yield Deviation(code="VP6034", item=name, problem=problem)


def _largest_block(difference: NDArray[np.float64]) -> float:
    """Return the largest mean difference of a block of pixels; every block counts."""
    height, width, _ = difference.shape
    size = min(_BLOCK, height, width)
    summed = np.zeros((height + 1, width + 1, difference.shape[2]))
    summed[1:, 1:] = difference.cumsum(axis=0).cumsum(axis=1)
    sums: NDArray[np.float64] = summed[size:, size:] - summed[:-size, size:]
    sums = sums - summed[size:, :-size] + summed[:-size, :-size]
    largest = float(np.abs(sums).max().item())
    return largest / float(size**2)


def _pixels(data: bytes) -> NDArray[np.float64]:
    """Return the pixels of a PNG file that has been checked, [row, column, channel]."""
    import OpenImageIO  # noqa: PLC0415 - heavy, and a preview is mostly the same to the byte

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "preview.png"
        path.write_bytes(data)
        pixels: NDArray[np.float64] = np.asarray(OpenImageIO.ImageBuf(str(path)).get_pixels("uint8"), np.float64)
        return pixels
