"""What a texture of normals holds: how gradients were measured, and what its bytes mean."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.record import Record

GradientKernel = Literal["forward", "central", "thesis", "sobel", "isotropic"]
"""Differences of neighbours: forward; central; central and smoothed across by 1 3 1 / 3 6 3 / 1 3 1, by (1 2 1) twice,
or by (1 4 1) twice."""
NormalCode = Literal["biased8", "snorm8", "oct8", "oct12"]
"""Three bytes or three signed bytes, one a component; or the octahedron unfolded into a square of two times 8 or 12
bits."""
DIRECTION_BYTES: dict[NormalCode, int] = {"biased8": 3, "snorm8": 3, "oct8": 2, "oct12": 3}
"""Bytes of a direction; one more holds the length, where it is wanted."""
FILTERED_CODES: frozenset[NormalCode] = frozenset(("biased8", "snorm8"))
"""Codes that may be filtered: a mixture of two directions is one between them."""
NormalSpace = Literal["box", "patient"]
"""Axes of the vectors: those of the volume, as box space has them, or those of the patient (LPS)."""


class NormalMeaning(Record):
    """What the texels of normals mean."""

    kernel: GradientKernel
    """How the gradient was measured at level 0. A voxel of a coarser level has the mean over its voxels of level 0."""
    code: NormalCode
    """What the bytes mean. Codes of two numbers must not be filtered: their texture is sampled with NEAREST."""
    space: NormalSpace
    """Axes of the vectors."""


class Normals(NormalMeaning):
    """Unit vectors along the gradient, towards larger values. Their negatives point out of a bright body."""

    largest_gradient: Annotated[float, Field(ge=0.0)] | None = None
    """Length of the gradient for which the texel's last channel is 1, in units of the physical value per millimetre;
    absent if the texels hold no length."""


LEAST_SLOPE = 1e-3
"""Where shaders take gradients, slopes below this are no surface: parts of the range of codes over the smallest spacing
of level 0."""
