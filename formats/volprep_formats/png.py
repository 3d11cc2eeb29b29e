"""8-bit sRGB pictures as PNG files. Only for people: data never travel in a PNG."""

from pathlib import Path

import numpy as np
import OpenImageIO
from numpy.typing import NDArray


def write_png(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture, row 0 on top: [H, W, 1], [H, W, 3], or [H, W, 4] with colours not multiplied by alpha.

    Raises OSError.
    """
    height, width, channels = picture.shape
    output = OpenImageIO.ImageOutput.create(str(path))
    if output is None:
        raise OSError(OpenImageIO.geterror())
    spec = OpenImageIO.ImageSpec(width, height, channels, "uint8")
    if channels == 4:
        # Else OpenImageIO would take the colours for premultiplied, and divide them by alpha in 8 bits.
        spec.attribute("oiio:UnassociatedAlpha", 1)
    if not (output.open(str(path), spec) and output.write_image(np.ascontiguousarray(picture)) and output.close()):
        raise OSError(output.geterror())
