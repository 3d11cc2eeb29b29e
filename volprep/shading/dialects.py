"""Which language the shaders of a program are in: it follows from what they sample."""

from volprep.shading.compose import Dialect
from volprep_formats.package.program import Sampling

DIALECTS: dict[Sampling, Dialect] = {
    "texture3d": "es300",
    "mosaic": "es100",
    "subvolumes": "es300",
    "bricks": "es300",
}
"""The oldest language that can read each."""
