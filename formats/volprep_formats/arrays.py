"""Types of arrays that many modules name. What an array holds, its axes and its unit stand where it is used."""

import numpy as np
from numpy.typing import NDArray

Float64Array = NDArray[np.float64]
Float32Array = NDArray[np.float32]
FloatArray = NDArray[np.floating]
"""Of any precision."""
UInt8Array = NDArray[np.uint8]
Texels = NDArray[np.generic]
"""Of any type that a texture holds."""
