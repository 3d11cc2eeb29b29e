"""Techniques as they were published, in double precision: slow twins of what their programs should draw."""

import math

import numpy as np
from numpy.typing import NDArray

from volprep.truth.stacks import pixel_rays
from volprep.truth.volume import Medium
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table


def published_steps(
    medium: Medium, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float
) -> Float64Array:
    """Draw a volume as [H, W, 4] with an opacity for each step; samples are `step_mm` apart on the longest ray.

    The mobile volume rendering thesis (appendix) divides each ray into the same number of steps, however long it is;
    there and in Schultz and Bailey (appendix B) a sample has an opacity of its own, whatever its distance from the next
    one. Here it is the opacity of the transfer function's `reference_mm`. Short rays are too opaque, and finer steps
    make all of them more so: the picture goes to that of the first visible sample, at full opacity. Against the oracle
    the order is 0.
    """
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


def published_positions(
    medium: Medium, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float
) -> Float64Array:
    """Draw a volume as [H, W, 4] between positions of 8 bits (Congote et al. 2011), for an eye outside of its box.

    A ray runs from its entry at a front face of the box to a colour that encodes its exit at a back face: each
    coordinate is rounded to 1/255 of the box. The samples are placed as on any other ray: the middles of equal
    segments.
    """
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


def published_slices(
    medium: Medium, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float
) -> Float64Array:
    """Draw a volume as [H, W, 4] with slices at most `step_mm` apart; opacities end at 1, as in a target of 8 bits.

    The slices fill a cube whose edge is the diagonal of the volume (Noguera and Jiménez 2012).

    As published, the opacity of a slice is that of the transfer function divided by the number of slices, and opacities
    are added: light is weighted by 1 - the sum of the opacities in front, not by the product of the slices'
    transparencies. Finer slices converge with order 1 to the integral of c τ (1 - ∫τ), which is not that of emission
    and absorption: a box of optical depth 1 gets opacity 1 and half of its colour, where the truth is 0.632 of both.
    Against the oracle the order is 0.
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


def ways_in_box(near: Float64Array, along: Float64Array, extent: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return where rays enter the box [0, extent] and leave it, in parts of `along`; a ray that misses leaves first."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([-near / along, (extent - near) / along])
    return np.nanmax(ends.min(axis=0), axis=1), np.nanmin(ends.max(axis=0), axis=1)


def medium_at(medium: Medium, at_mm: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return colour [n, 3] and extinction per millimetre [n] of the trilinear field at box positions [n, 3]."""
    volume = medium.volume
    at = at_mm / volume.grid.spacing_mm_zyx[::-1]
    values = volume.slope * _trilinear(volume.stored, at) + volume.intercept
    return Table.exact(medium.transfer_function).at(values)


def _trilinear(volume: NDArray[np.generic], at_xyz: Float64Array) -> Float64Array:
    """Return stored values at positions in voxels, whose centres are at halves."""
    last = np.array(volume.shape) - 1
    at = np.clip(at_xyz[:, ::-1] - 0.5, 0.0, last)
    lower = np.minimum(at.astype(np.intp), np.maximum(last - 1, 0))
    upper, share = np.minimum(lower + 1, last), at - lower
    values = np.zeros(len(at))
    for corner in range(8):
        chosen = np.array([corner >> 2 & 1, corner >> 1 & 1, corner & 1], bool)
        z, y, x = np.where(chosen, upper, lower).T
        values += np.prod(np.where(chosen, share, 1.0 - share), axis=1) * volume[z, y, x]
    return values


TWINS = {
    "ray-casting-as-published": published_steps,
    "two-pass-as-published": published_positions,
    "view-slices-as-published": published_slices,
}
"""The picture that a technique draws with a step, where it does not converge to the oracle of its compositing."""
