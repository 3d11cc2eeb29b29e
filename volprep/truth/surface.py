"""The picture that an isosurface should give, in float64, with a bound on its own error.

1. The surface is where the trilinear field crosses the isovalue. A ray meets it at the first crossing in the box, from
   either side; or, if values above the isovalue are solid, at its entry if the field there is the isovalue or above.
2. The pixel is the transfer function's value for the field there: the isovalue, or the value where the ray enters the
   solid. A surface has no path length, so its opacity is that of the reference length, as for a maximum.
3. Under a headlight, the colour is multiplied by sqrt(((n · d)² + e²) / (n · n + e²)), where d is the direction of the
   ray, n the trilinear interpolation of the normals of voxels, and e = 0.01: the cosine of both, unless n is short. A
   light with a place lights as it does in `volprep.truth.refined`.
4. With shadows, light reaches a place if the whole way to the light, from half of the smallest spacing off the place
   on, is on the viewer's side of the surface.

In each cell the field along a ray is a cubic: the place is its exact root (native/src/oracle_surface.cpp).
"""

from dataclasses import dataclass

import numpy as np

from volprep.kernels import _native
from volprep.truth.lit import SOFT_LENGTH, Lit, native_normals, place_in_box, shadow_light
from volprep.truth.oracle import OraclePicture, native_field
from volprep.truth.shown import shown_picture
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.package.program import Light
from volprep_formats.package.transfer_function import TransferFunction

_OFFSET_VOXELS = 0.5
_ROUNDING = 64.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class Hits:
    """First hit of each ray of a picture on a surface."""

    t_mm: Float64Array
    """[height, width], distance from the near plane; NaN where the ray meets none."""
    error_mm: Float64Array
    """[height, width], bound on the rounding error of the place; infinite if rounding may decide whether there is a
    surface."""
    value: Float64Array
    """[height, width], physical value there; NaN where the ray meets none."""
    normal: Float64Array
    """[height, width, (x, y, z)], the interpolated normal there."""
    normal_per_mm: Float64Array
    """[height, width], how much the normal changes along the ray."""
    reaching: Float64Array
    """[height, width], the part of the light that arrives: 1, or 0 in shadow."""


def surface_hits(
    volume: Volume, isovalue: float, box_from_clip: Float64Array, shape_hw: tuple[int, int], *, solid: bool
) -> Hits:
    """Return the points where rays meet the surface. Errors as in `surface_picture`."""
    grid, normals = volume.grid, volume.normals
    t_mm, error_mm, value, change = (np.empty(shape_hw) for _ in range(4))
    normal = np.empty((*shape_hw, 3))
    reaching = np.ones(shape_hw)
    light = shadow_light(normals)
    _native.render_surface(
        *native_field(volume),
        np.ascontiguousarray(box_from_clip, dtype=np.float64),
        isovalue,
        solid,
        t_mm,
        error_mm,
        value,
        normal,
        change,
        *native_normals(normals, volume.slope),
        None if light is None else place_in_box(light, grid).tolist(),
        _OFFSET_VOXELS * min(grid.spacing_mm_zyx),
        None if light is None else reaching,
    )
    return Hits(t_mm, error_mm, value, normal, change, reaching)


def surface_picture(
    volume: Volume,
    transfer_function: TransferFunction,
    box_from_clip: Float64Array,
    shape_hw: tuple[int, int],
    *,
    solid: bool,
) -> OraclePicture:
    """Draw the surface of the transfer function's isovalue, with a bound on the error of each pixel.

    Parameters as in `oracle_picture`. A ray that touches the surface within rounding has the bound 1.

    Raises
    ------
    VolprepError
        VP6001 if a voxel is not finite: the field around it is not defined.
    ValueError
        If the volume does not have the grid's shape, or the transfer function has no isovalue.
    """
    isovalue = transfer_function.isovalue
    if isovalue is None:
        msg = f"transfer function {transfer_function.name} has no isovalue"
        raise ValueError(msg)
    hits = surface_hits(volume, isovalue, box_from_clip, shape_hw, solid=solid)
    rounding = np.where(np.isnan(hits.value) | (hits.value == isovalue), 0.0, _ROUNDING * np.abs(hits.value))
    picture = shown_picture(hits.value, rounding, transfer_function, transfer_function.reference_mm)
    light_hits(picture, hits, volume, box_from_clip)
    return picture


def light_hits(picture: OraclePicture, hits: Hits, volume: Volume, box_from_clip: Float64Array) -> None:
    """Light the picture of hits, and add to its bound what their uncertainty does to it."""
    normals = volume.normals
    shape_hw = hits.value.shape
    along = directions(box_from_clip, shape_hw)
    if isinstance(normals, Lit) and normals.light is not None:
        at = near_ends(box_from_clip, shape_hw) + np.nan_to_num(hits.t_mm)[..., None] * along
        to_light = _unit(place_in_box(normals.light, volume.grid) - at)
        picture.rgba[...] = _placed(picture.rgba, hits, along, to_light, normals)
        picture.bound[...] += _ROUNDING * (1.0 + normals.light.shininess) + _moved(hits) * (1 + normals.light.shininess)
    elif normals is not None:
        light, error = headlight(hits, along)
        picture.rgba[..., :3] *= light[..., None]
        picture.bound[...] += error
    picture.bound[np.isinf(hits.error_mm)] = 1.0


def directions(box_from_clip: Float64Array, shape_hw: tuple[int, int]) -> Float64Array:
    """Return the unit vector along the ray of each pixel, [height, width, (x, y, z)] in box space."""
    return _unit(_ends(box_from_clip, shape_hw, 1.0) - near_ends(box_from_clip, shape_hw))


def near_ends(box_from_clip: Float64Array, shape_hw: tuple[int, int]) -> Float64Array:
    """Return where the ray of each pixel begins, [height, width, (x, y, z)] in box space."""
    return _ends(box_from_clip, shape_hw, -1.0)


def _ends(box_from_clip: Float64Array, shape_hw: tuple[int, int], depth: float) -> Float64Array:
    height, width = shape_hw
    x = (2 * np.arange(width) + 1) / width - 1
    y = 1 - (2 * np.arange(height) + 1) / height
    clip = np.stack([*np.meshgrid(x, y), np.full(shape_hw, depth), np.ones(shape_hw)], axis=-1)
    ends = clip @ box_from_clip.T
    points: Float64Array = ends[..., :3] / ends[..., 3:]
    return points


def _unit(vectors: Float64Array) -> Float64Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: Float64Array = vectors / np.where(length > 0.0, length, 1.0)
    return unit


def _placed(rgba: Float64Array, hits: Hits, along: Float64Array, to_light: Float64Array, lit: Lit) -> Float64Array:
    """Return the pixels as a light with a place lights them: native/include/volprep/oracle.hpp says how."""
    light = lit.light or Light(place_mm_xyz=(0.0, 0.0, 0.0))
    normal = _unit(hits.normal)
    normal *= np.where((normal * along).sum(axis=-1, keepdims=True) > 0.0, -1.0, 1.0)
    facing = (normal * to_light).sum(axis=-1, keepdims=True)
    mirrored = 2.0 * facing * normal - to_light
    cosine = (normal * _unit(to_light - along) if lit.halfway else -mirrored * along).sum(axis=-1, keepdims=True)
    shine = np.where(facing > 0.0, light.specular * np.maximum(cosine, 0.0) ** light.shininess, 0.0)
    reaching = hits.reaching[..., None]
    alpha = rgba[..., 3:]
    colour = rgba[..., :3] / np.where(alpha > 0.0, alpha, 1.0)
    diffuse = light.ambient + light.diffuse * np.maximum(facing, 0.0) * reaching
    bare = rgba[..., :3] * (light.ambient + (1.0 - light.ambient) * reaching)
    colour = np.minimum(colour * diffuse + shine * reaching, 1.0)
    squared = (hits.normal**2).sum(axis=-1, keepdims=True)
    share = squared / (squared + SOFT_LENGTH**2)
    unlit = bare if lit.throws_shadows else rgba[..., :3]
    return np.concatenate([share * colour * alpha + (1.0 - share) * unlit, alpha], axis=-1)


def _moved(hits: Hits) -> Float64Array:
    """Return bounds on how much the uncertainty of the hits may turn their normals."""
    length = np.hypot(np.linalg.norm(hits.normal, axis=-1), SOFT_LENGTH)
    moved: Float64Array = np.where(np.isfinite(hits.error_mm), hits.error_mm, 0.0) * hits.normal_per_mm / length
    return 2.0 * moved


def headlight(hits: Hits, directions: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return the light from the viewer at the hits, with a bound on its change by the uncertainty of the hits."""
    along = (hits.normal * directions).sum(axis=-1)
    light: Float64Array = np.hypot(along, SOFT_LENGTH) / np.hypot(np.linalg.norm(hits.normal, axis=-1), SOFT_LENGTH)
    return light, _moved(hits) + _ROUNDING
