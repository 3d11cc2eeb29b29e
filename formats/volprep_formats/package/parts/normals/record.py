"""Normals textures: how gradients were measured, and how the bytes encode them."""

from typing import Annotated, Literal, get_args

from volprep_formats.package.values import open_word
from volprep_formats.record import Record

GradientKernel = Literal["forward", "central", "thesis", "sobel", "isotropic"]
"""Differences of neighbours: forward; central; central and smoothed across by 1 3 1 / 3 6 3 / 1 3 1, by (1 2 1) twice,
or by (1 4 1) twice."""
NormalCode = Literal["biased8", "snorm8", "oct8", "oct12"]
"""Three bytes or three signed bytes, one a component; or the octahedron unfolded into a square of two times 8 or 12
bits."""
DIRECTION_BYTES: dict[NormalCode, int] = {"biased8": 3, "snorm8": 3, "oct8": 2, "oct12": 3}
"""Bytes of a direction."""
FILTERED_CODES: frozenset[NormalCode] = frozenset(("biased8", "snorm8"))
"""Codes that may be filtered: a mixture of two directions is one between them."""


class Normals(Record):
    """Unit vectors in box space along the gradient, towards larger values. Their negatives leave a bright body."""

    code: NormalCode
    """Encoding of the bytes. Two-number codes must not be filtered: sample their texture with NEAREST."""
    kernel: Annotated[str, open_word(*get_args(GradientKernel))]
    """Method of measuring the gradient at level 0. A voxel of a coarser level has the mean over its voxels of
    level 0. A reader accepts any other word."""


HalvedAxes = tuple[bool, bool, bool]
"""Whether shaders take central differences of a level half a voxel to each side, along z, y and x."""


def halved_axes(factors_zyx: tuple[int, int, int]) -> HalvedAxes:
    """Return the axes along which voxels of a level are larger than voxels of level 0.

    The mean gradient over a voxel is the difference of the values at its two faces. With differences of a whole voxel
    to each side, default levels 2 of five scans had 1.2 to 1.6 times the FLIP.
    """
    z, y, x = (factor > 1 for factor in factors_zyx)
    return z, y, x


SOFT_SLOPE = 4e-3
"""Slope at which a sample counts half as a surface, where shaders compute gradients: steeper ones are lit, flatter ones
keep their colours. In parts of the range of codes over the smallest spacing of level 0: one code of 8 bits for each
voxel; rounding decides the direction of smaller slopes. A gradient turns fast where it is small: with a threshold of
0.0005 three of four scans took 1.4 to 2.8 times the samples, and with one of 0.001 rounding to half floats moved single
pixels of a small MR by 0.5."""
SOFT_LENGTH = 0.01
"""Length at which a normal that a package holds counts half; most are about 1 long."""
