"""Colours of DICOM pictures: components as stored become red, green and blue, and those grey or a channel of a volume.

Source: DICOM PS3.3, C.7.6.3.1.2 (photometric interpretation) and C.7.6.3.1.3 (planar configuration).
"""

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.readers.colour import channel_of_colours
from volprep_formats.readers.dicom.header import EncodedPixels
from volprep_formats.readers.grey import grey_of
from volprep_formats.source import ColourChannel

_HALF = 128.0
_RGB_FROM_YBR = np.array([[1.0, 0.0, 1.402], [1.0, -0.114 * 1.772 / 0.587, -0.299 * 1.402 / 0.587], [1.0, 1.772, 0.0]])
"""Red, green and blue of luminance and differences, by ITU-R BT.601."""


def components_of(pixels: EncodedPixels, data: bytes | bytearray) -> NDArray[np.generic]:
    """Return the components [y, x, 3] of an uncompressed picture; header.py accepts only little-endian integers."""
    rows, columns = pixels.rows, pixels.columns
    dtype = f"<u{pixels.bits_allocated // 8}"
    if pixels.colours == "pairs":
        pairs = np.frombuffer(data, dtype, count=2 * rows * columns).reshape(rows, columns // 2, 4)
        differences = np.repeat(pairs[..., 2:], 2, axis=1)
        return np.concatenate([pairs[..., :2].reshape(rows, columns, 1), differences], axis=-1)
    values = np.frombuffer(data, dtype, count=3 * rows * columns)
    if pixels.colours == "planes":
        return np.moveaxis(values.reshape(3, rows, columns), 0, -1)
    return values.reshape(rows, columns, 3)


def picture_of(pixels: EncodedPixels, components: NDArray[np.generic], *, is_ybr: bool) -> NDArray[np.generic]:
    """Return the grey value, or the channel, [y, x] of the components [y, x, 3] of a picture.

    Raises VP1290 for an extinction from alpha, which DICOM has not.
    """
    colours = _rgb(components) if is_ybr else components
    if isinstance(pixels.grey, ColourChannel):
        return channel_of_colours(pixels.path, pixels.grey, colours, None)
    return grey_of(colours, pixels.grey)


def _rgb(components: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Return red, green and blue of bytes of luminance and two differences."""
    shifted: Float64Array = components.astype(np.float64) - (0.0, _HALF, _HALF)
    colours: NDArray[np.uint8] = np.clip(np.rint(shifted @ _RGB_FROM_YBR.T), 0.0, 255.0).astype(np.uint8)
    return colours
