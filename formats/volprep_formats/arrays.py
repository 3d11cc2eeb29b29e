"""Types of arrays that many modules use. Each use documents the content, the axes and the unit."""

import numpy as np
from numpy.typing import NDArray

Float64Array = NDArray[np.float64]
Float32Array = NDArray[np.float32]
FloatArray = NDArray[np.floating]
"""Floats of any precision."""
UInt8Array = NDArray[np.uint8]
Texels = NDArray[np.generic]
"""Values of any texture type."""
