"""Ray casting between positions of 8 bits, as Congote et al. (2011) published it, in double precision.

A ray runs from its entry at a front face of the box to a colour that encodes its exit at a back face: each coordinate
is rounded to 1/255 of the box. The samples are placed as on any other ray: the middles of equal segments.
"""

import numpy as np

from volprep.truth.field import medium_at
from volprep.truth.stacks import pixel_rays, ways_in_box
from volprep.truth.volume import Medium
from volprep_formats.arrays import Float64Array


def published_positions(
    medium: Medium, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float
) -> Float64Array:
    """Draw a volume as [H, W, 4], for an eye outside of its box."""
    near, along = pixel_rays(box_from_clip, shape_hw)
    extent = np.array(medium.volume.grid.extent_mm_zyx[::-1])
    enter, leave = ways_in_box(near, along, extent)
    met = np.flatnonzero((enter >= 0.0) & (leave > enter))
    entry, exit_ = (near[met] + along[met] * way[met, None] for way in (enter, leave))
    ray = np.rint(np.clip(exit_ / extent, 0.0, 1.0) * 255) / 255 * extent - entry
    length_mm = np.linalg.norm(ray, axis=1)
    count = np.maximum(np.ceil(length_mm / step_mm - 0.001), 1.0)
    light, depth = np.zeros((len(met), 3)), np.zeros(len(met))
    for number in range(int(count.max(initial=0.0))):
        taken = np.flatnonzero(number < count)
        at = entry[taken] + ray[taken] * ((number + 0.5) / count[taken])[:, None]
        colour, extinction_per_mm = medium_at(medium, at)
        deeper = depth[taken] + extinction_per_mm * length_mm[taken] / count[taken]
        light[taken] += colour * (np.exp(-depth[taken]) - np.exp(-deeper))[:, None]
        depth[taken] = deeper
    picture = np.zeros((len(near), 4))
    picture[met] = np.column_stack([light, -np.expm1(-depth)])
    return picture.reshape(*shape_hw, 4)
