"""Slices across the view as Noguera and Jiménez (2012) published them, in double precision.

As published, the opacity of a slice is that of the transfer function divided by the number of slices, and opacities are
added: light is weighted by 1 - the sum of the opacities in front, not by the product of the slices' transparencies.
Finer slices converge with order 1 to the integral of c τ (1 - ∫τ), which is not that of emission and absorption: a box
of optical depth 1 gets opacity 1 and half of its colour, where the truth is 0.632 of both. Against the oracle the order
is 0.
"""

import math

import numpy as np

from volprep.truth.field import medium_at
from volprep.truth.stacks import pixel_rays
from volprep.truth.volume import Medium
from volprep_formats.arrays import Float64Array


def published_slices(
    medium: Medium, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float
) -> Float64Array:
    """Draw a volume as [H, W, 4] with slices at most `step_mm` apart; opacities end at 1, as in a target of 8 bits.

    The slices fill a cube whose edge is the diagonal of the volume.
    """
    near, along = pixel_rays(box_from_clip, shape_hw)
    extent = np.array(medium.volume.grid.extent_mm_zyx[::-1])
    depth_mm = math.hypot(*extent)
    count = math.ceil(depth_mm / step_mm)
    middle = box_from_clip @ np.array([[0.0, 0.0], [0.0, 0.0], [-1.0, 1.0], [1.0, 1.0]])
    view = np.diff(middle[:3] / middle[3], axis=1)[:, 0]
    view /= np.linalg.norm(view)
    picture = np.zeros((len(near), 4))
    for number in range(count):
        plane_mm = ((number + 0.5) / count - 0.5) * depth_mm
        way = ((extent / 2 - near) @ view + plane_mm) / (along @ view)
        at = near + along * way[:, None]
        inside = np.flatnonzero(np.all((at >= 0.0) & (at <= extent), axis=1) & (way >= 0.0))
        colour, extinction_per_mm = medium_at(medium, at[inside])
        opacity = extinction_per_mm * (depth_mm / count)
        picture[inside, :3] += (1.0 - picture[inside, 3:]) * colour * opacity[:, None]
        picture[inside, 3] = np.minimum(picture[inside, 3] + opacity, 1.0)
    return picture.reshape(*shape_hw, 4)
