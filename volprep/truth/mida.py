"""The picture that maximum intensity difference accumulation should give, by refinement in float64.

Bruckner and Groeller (Instant Volume Visualization using Maximum Intensity Difference Accumulation, 2009): where a
sample's intensity exceeds the greatest one so far by d, the colour accumulated in front of it is multiplied by
1 - d. With fine steps that tends to an integral, which has no closed form where the transfer function is not constant:
each ray is refined until two halvings of its steps in a row change no channel by more than the tolerance
(native/src/oracle_refined.cpp). So the bound of a pixel is an estimate, the larger of these two changes.
"""

from volprep.truth.oracle import DEFAULT_TOLERANCE, OraclePicture
from volprep.truth.refined import refined_picture
from volprep_formats.arrays import Float64Array, Texels
from volprep_formats.grid import Grid
from volprep_formats.package.transfer_function import TransferFunction


def mida_picture(  # noqa: PLR0917 - as oracle_picture
    volume: Texels,
    grid: Grid,
    slope: float,
    intercept: float,
    transfer_function: TransferFunction,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    tolerance: float = DEFAULT_TOLERANCE,
) -> OraclePicture:
    """Draw a volume; parameters and errors as in `oracle_picture`."""
    return refined_picture(
        volume,
        grid,
        slope,
        intercept,
        transfer_function,
        box_from_clip,
        shape_hw,
        tolerance,
        intensities=transfer_function.intensity_range,
    )
