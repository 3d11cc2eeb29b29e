"""Ray casting with an opacity for each step, as published, in double precision.

The mobile volume rendering thesis (appendix) divides each ray into the same number of steps, however long it is; there
and in Schultz and Bailey (appendix B) a sample has an opacity of its own, whatever its distance from the next one. Here
it is the opacity of the transfer function's `reference_mm`. Short rays are too opaque, and finer steps make all of them
more so: the picture goes to that of the first visible sample, at full opacity. Against the oracle the order is 0.
"""

import math

import numpy as np

from volprep.truth.field import medium_at
from volprep.truth.stacks import pixel_rays, ways_in_box
from volprep.truth.volume import Medium
from volprep_formats.arrays import Float64Array


def published_steps(
    medium: Medium, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float
) -> Float64Array:
    """Draw a volume as [H, W, 4]; all rays have the same number of samples, `step_mm` apart on the longest ray."""
    near, along = pixel_rays(box_from_clip, shape_hw)
    extent = np.array(medium.volume.grid.extent_mm_zyx[::-1])
    enter, leave = ways_in_box(near, along, extent)
    enter = np.maximum(enter, 0.0)
    met = np.flatnonzero(leave > enter)
    count = math.ceil(math.hypot(*extent) / step_mm - 0.001)
    light, transmittance = np.zeros((len(met), 3)), np.ones(len(met))
    for number in range(count):
        way = enter[met] + (leave - enter)[met] * (number + 0.5) / count
        colour, extinction_per_mm = medium_at(medium, near[met] + along[met] * way[:, None])
        opacity = -np.expm1(-extinction_per_mm * medium.transfer_function.reference_mm)
        light += colour * (transmittance * opacity)[:, None]
        transmittance *= 1.0 - opacity
    picture = np.zeros((len(near), 4))
    picture[met] = np.column_stack([light, 1.0 - transmittance])
    return picture.reshape(*shape_hw, 4)
