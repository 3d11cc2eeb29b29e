"""Pictures by refinement: against the oracle with a bound where both can, and against many samples with a light."""

import numpy as np
import pytest
from tiny_packages import function

from volprep.kernels import _native
from volprep.truth.camera import standard_views
from volprep.truth.lit import Lit, ShaderSlopes
from volprep.truth.oracle import oracle_picture
from volprep.truth.refined import refined_picture
from volprep.truth.surface import surface_picture
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid
from volprep_formats.package.program import Light

SPACING = (1.25, 1.0, 0.8)
GLASS = function((0.0, (0.1, 0.2, 0.4), 0.0), (90.0, (1.0, 0.5, 0.0), 0.3), (255.0, (1.0, 0.9, 0.8), 1.5))


@pytest.fixture
def scan():
    return np.random.default_rng(2).integers(0, 256, (6, 8, 7)).astype(np.uint8)


def view_of(volume, name="anterior-left"):
    grid = Grid.of(volume.shape, SPACING)
    return grid, standard_views(grid)[name].box_from_clip(grid, 1.0)


@pytest.mark.parametrize(
    "normals",
    [
        None,
        "central",
        "sobel",
        Lit(ShaderSlopes("central", 3.0)),
        Lit(ShaderSlopes("central", 3.0, halved_zyx=(True, False, True))),
        Lit(ShaderSlopes("forward", 3.0)),
    ],
)
def test_without_a_place_of_the_light_it_is_the_picture_of_the_oracle_with_a_bound(scan, normals) -> None:
    grid, matrix = view_of(scan)
    one = refined_picture(Volume(scan, grid, 2.0, -30.0, normals=normals), GLASS, matrix, (9, 9))
    other = oracle_picture(Volume(scan, grid, 2.0, -30.0, normals=normals), GLASS, matrix, (9, 9))
    assert other.rgba[..., 3].max() > 0.6
    assert np.abs(one.rgba - other.rgba).max() < 4e-6
    assert one.bound.max() <= 1e-6


def phong(colour, normal, at, towards_viewer, lit):
    """Phong 1975, or Blinn 1977, written down for one point; `lit` has the place in box space."""
    light = lit.light
    normal = normal / np.linalg.norm(normal)
    normal = normal if normal @ towards_viewer >= 0 else -normal
    to_light = np.array(light.place_mm_xyz) - at
    to_light /= np.linalg.norm(to_light)
    facing = normal @ to_light
    shine = 0.0
    if facing > 0:
        halfway = to_light + towards_viewer
        mirrored = 2 * facing * normal - to_light
        cosine = normal @ halfway / np.linalg.norm(halfway) if lit.halfway else mirrored @ towards_viewer
        shine = light.specular * max(cosine, 0.0) ** light.shininess
    return np.minimum(colour * (light.ambient + light.diffuse * max(facing, 0.0)) + shine, 1.0)


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("halfway", [False, True])
@pytest.mark.parametrize("place", [(-20.0, 5.0, 9.0), (3.0, 4.0, 3.5)], ids=["outside", "inside"])
def test_a_light_with_a_place_is_what_many_samples_give(oracle, scan, place, halfway) -> None:
    grid = Grid.of(scan.shape, (1.0, 1.0, 1.0))
    corner = np.array(grid.corner_mm_xyz)
    light = Light(place_mm_xyz=tuple((np.array(place) + corner).tolist()), specular=0.5, shininess=8.0)
    lit = Lit(np.ascontiguousarray(np.random.default_rng(5).normal(size=(*scan.shape, 3)), np.float32), light, halfway)
    origin, direction = np.array([3.3, -5.0, 2.9]), np.array([0.1, 1.0, 0.05])
    direction /= np.linalg.norm(direction)
    camera = oracle.ray(origin, direction, 20.0)
    picture = refined_picture(Volume(scan, grid, normals=lit), GLASS, camera, (1, 1))
    start, end = oracle.inside_box(origin, direction, 20.0, np.array([7.0, 8.0, 6.0]))
    count = 20_000
    at = origin + np.multiply.outer(start + (np.arange(count) + 0.5) / count * (end - start), direction)
    values = oracle.trilinear(scan.astype(float), at, (1.0, 1.0, 1.0))
    vectors = np.stack([oracle.trilinear(lit.normals[..., k].astype(float), at, (1, 1, 1)) for k in range(3)], axis=-1)
    points = GLASS.points
    known = [p.value for p in points]
    depth = np.interp(values, known, [p.extinction_per_mm for p in points]) * (end - start) / count
    colours = np.stack([np.interp(values, known, [p.colour[k] for p in points]) for k in range(3)], axis=-1)
    boxed = Lit(lit.normals, light.model_copy(update={"place_mm_xyz": place}), halfway)
    shaded = np.array([phong(c, n, p, -direction, boxed) for c, n, p in zip(colours, vectors, at, strict=True)])
    before = np.exp(-np.concatenate([[0.0], np.cumsum(depth)[:-1]]))
    truth = ((before * -np.expm1(-depth))[:, None] * shaded).sum(axis=0)
    assert np.abs(picture.rgba[0, 0, :3] - truth).max() < 2e-4


def test_slopes_of_a_shader_are_differences_of_samples_one_voxel_apart_and_half_a_voxel_on_levels(oracle) -> None:
    """A surface, so that the light of one place can be told."""
    scan = np.random.default_rng(7).uniform(0, 255, (7, 9, 8)).astype(np.float32)
    grid, matrix = view_of(scan, "anterior")
    white = function((0.0, (1.0, 1.0, 1.0), 30.0)).model_copy(update={"isovalue": 128.0})
    none = (False, False, False)
    for kernel, halved_zyx in (("central", none), ("central", (True, False, True)), ("forward", none)):
        normals = Lit(ShaderSlopes(kernel, 1e-6, halved_zyx=halved_zyx))
        picture = surface_picture(Volume(scan, grid, normals=normals), white, matrix, (8, 8), solid=False)
        t, error, value, change = (np.empty((8, 8)) for _ in range(4))
        normal = np.empty((8, 8, 3))
        sizes = (grid.spacing_mm_zyx[::-1], grid.extent_mm_zyx[::-1])
        _native.render_surface(scan, 1.0, 0.0, *sizes, matrix, 128.0, False, t, error, value, normal, change)
        seen = 0
        for row, column in np.argwhere(np.isfinite(t)):
            clip = np.array([(2 * column + 1) / 8 - 1, 1 - (2 * row + 1) / 8, -1.0, 1.0])
            near, far = matrix @ clip, matrix @ (clip * [1, 1, -1, 1])
            direction = (far - near)[:3] / np.linalg.norm((far - near)[:3])
            spacing = np.array(SPACING[::-1])
            at = near[:3] + t[row, column] * direction
            at = np.clip(at, spacing / 2, np.array(grid.extent_mm_zyx[::-1]) - spacing / 2)
            apart = spacing * np.where(halved_zyx[::-1], 0.5, 1.0)
            behind, before = (
                np.array([oracle.trilinear(scan.astype(float), at + side * step, spacing) for step in np.diag(apart)])
                for side in (1, -1 if kernel == "central" else 0)
            )
            gradient = (behind - before) / apart
            cosine = abs(gradient @ direction) / np.linalg.norm(gradient)
            assert abs(picture.rgba[row, column, 0] - cosine) < 1e-5
            seen += 1
        assert seen > 5


def test_sizes_and_lights_that_do_not_fit_are_refused() -> None:
    arguments = (
        np.zeros((2, 2, 2), np.uint8), 1.0, 0.0, (1.0,) * 3, (2.0,) * 3, np.zeros(1), np.zeros((1, 3)), np.zeros(1),
        np.eye(4), 1e-6, np.empty((1, 1, 4)), np.empty((1, 1)),
    )  # fmt: skip
    with pytest.raises(ValueError, match="a light needs normals"):
        _native.render_refined(*arguments, light=np.zeros(7))
    with pytest.raises(ValueError, match="intensities must ascend"):
        _native.render_refined(*arguments, intensities=(1.0, 1.0))
    with pytest.raises(ValueError, match="forward and central"):
        _native.render_refined(*arguments, kernel="sobel", slope_scale=1.0)
    with pytest.raises(ValueError, match="halved goes with"):
        _native.render_refined(*arguments, kernel="forward", slope_scale=1.0, halved=(True, False, False))
