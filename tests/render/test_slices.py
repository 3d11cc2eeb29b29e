"""Slices drawn by OpenGL ES 1.1: pictures with closed forms, a slow twin, and all directions."""

import math
from pathlib import Path

import numpy as np
import pytest
from scene_builds import view_of
from slice_packages import expected_picture, missing_es11, slice_package, stack_of

import volprep.scene.profiles
from volprep.render.renderers import renderer_of
from volprep.render.slices import SliceRenderer, _back_to_front
from volprep.truth.camera import standard_views, view_from
from volprep.truth.stacks import stack_picture
from volprep.validation.timing.rays import chords_mm
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.parts.slices.texels import slice_texels

pytestmark = pytest.mark.skipif(missing_es11() is not None, reason=f"no OpenGL ES 1.1: {missing_es11()}")

SIZE = (61, 61)
FLAT = (
    "{ value = 0.0, colour = [0.25, 0.5, 1.0], extinction_per_mm = 0.05 }, "
    "{ value = 255.0, colour = [0.25, 0.5, 1.0], extinction_per_mm = 0.05 }"
)
SIX = ("left", "right", "anterior", "posterior", "superior", "inferior")
ODD = (5, 9, 13)


@pytest.fixture(scope="module")
def noise(tmp_path_factory):
    codes = np.random.default_rng(3).integers(0, 256, ODD)
    return slice_package(tmp_path_factory.mktemp("noise"), codes, (2.5, 0.75, 1.0))


def matrix(package, view):
    grid = package.manifest.levels[0].grid
    return view_of(grid, view)


@pytest.mark.parametrize("view", SIX)
def test_a_homogeneous_slab_is_as_opaque_as_the_closed_form_says(tmp_path, view):
    package = slice_package(tmp_path, np.full((11, 7, 9), 100), (2.0, 0.5, 1.0), points=FLAT)
    box_from_clip = matrix(package, view)
    with SliceRenderer(package) as renderer:
        axis, cosine = renderer.facing(box_from_clip)
        middle = renderer.render(box_from_clip, SIZE)[30, 30]
    assert cosine == pytest.approx(1.0)
    thickness = package.manifest.levels[0].grid.extent_mm_zyx["zyx".index(axis)]
    slices = package.manifest.levels[0].grid.shape_zyx["zyx".index(axis)]
    opacity = 1 - math.exp(-0.05 * thickness)
    # Each slice is rounded when it becomes a texel and when it is blended.
    colour = package.manifest.transfer_functions[0].points[0].colour
    np.testing.assert_allclose(middle, np.array([*colour, 1.0]) * opacity, atol=1.5 * slices / 255)
    texel = stack_of(package, axis)[0, 0, 0] / 255
    exact = texel / texel[3] * (1 - (1 - texel[3]) ** slices)
    np.testing.assert_allclose(middle, exact, atol=slices / 255)


@pytest.mark.parametrize("view", [*SIX, "anterior-left", "anterior-right", "posterior-left"])
@pytest.mark.parametrize("lengthened", [True, False])
def test_a_picture_is_what_compositing_slices_in_double_precision_gives(noise, view, lengthened):
    box_from_clip = matrix(noise, view)
    with SliceRenderer(noise, lengthen=lengthened) as renderer:
        axis, _ = renderer.facing(box_from_clip)
        picture = renderer.render(box_from_clip, SIZE)
    expected, bound, clear = expected_picture(noise, axis, box_from_clip, SIZE, lengthened=lengthened)
    assert clear.mean() > 0.8
    assert (expected[..., 3] > 0.3).mean() > 0.05
    assert (np.abs(picture - expected) <= bound + 1e-6)[clear].all()


@pytest.mark.parametrize("view", [*SIX, "anterior-left", "posterior-left"])
def test_compositing_in_double_precision_is_what_its_slow_twin_gives(noise, view):
    box_from_clip = matrix(noise, view)
    with SliceRenderer(noise) as renderer:
        (axis, _), factor = renderer.facing(box_from_clip), renderer.factor(box_from_clip)
    expected, _, clear = expected_picture(noise, axis, box_from_clip, SIZE)
    grid = noise.manifest.levels[0].grid
    found = stack_picture(slice_texels(noise, "ramp", axis), axis, grid, box_from_clip, SIZE, factor)
    np.testing.assert_allclose(found[clear], expected[clear], rtol=0, atol=1e-9)


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """Slices with three polygons each; of one stack each slice is a texture of its own."""
    codes = np.random.default_rng(3).integers(0, 256, ODD)
    return slice_package(tmp_path_factory.mktemp("mixed"), codes, (2.5, 0.75, 1.0), slices="layers = 3")


@pytest.mark.parametrize("view", [*SIX, "anterior-left", "posterior-left"])
def test_polygons_between_slices_mix_both(mixed, noise, view):
    box_from_clip = matrix(mixed, view)
    with SliceRenderer(mixed) as renderer:
        (axis, _), factor = renderer.facing(box_from_clip), renderer.factor(box_from_clip)
        assert renderer.layers(axis) == 3
        picture = renderer.render(box_from_clip, SIZE)
        white = renderer.render_on(box_from_clip, SIZE, 0.0, white=True)
        again = renderer.render(box_from_clip, SIZE)
    grid = mixed.manifest.levels[0].grid
    texels = slice_texels(mixed, "ramp", axis)
    expected = stack_picture(texels, axis, grid, box_from_clip, SIZE, factor, 3)
    # What one polygon may be off, and how many there are; edges of the volume are elsewhere by rounding.
    off = np.abs(picture - expected).max(axis=-1)
    polygons = 3 * ODD["zyx".index(axis)]
    assert np.quantile(off, 0.9) < 0.6 * factor * polygons / 255
    assert off.mean() < 3 / 255
    if factor > 1.0:
        # Along their axis layers between slices add up to the slices; at an angle it is another picture.
        with SliceRenderer(noise) as renderer:
            assert np.abs(picture - renderer.render(box_from_clip, SIZE)).mean() > 2 * off.mean()
    np.testing.assert_array_equal(picture, again)
    np.testing.assert_allclose(white[..., 0], picture[..., 3], atol=polygons / 255)


def test_polygons_between_slices_in_double_precision_are_those_of_finer_slices():
    """A ramp of slices, sampled at its layers, is the stack of these layers."""
    slices, layers = 6, 4
    at = np.clip((np.arange(slices * layers) + 0.5) / layers - 0.5, 0, slices - 1)
    coarse = np.broadcast_to(8 * np.arange(slices)[:, None, None, None], (slices, 9, 9, 4)).astype(np.float64)
    fine = np.broadcast_to(8 * at[:, None, None, None], (slices * layers, 9, 9, 4))
    one, other = Grid.of((slices, 9, 9), (2.0, 1.0, 1.0)), Grid.of((slices * layers, 9, 9), (0.5, 1.0, 1.0))
    camera = view_from(one, (30.0, 10.0, 25.0), "orthographic").box_from_clip(one, 1.0)
    mixed = stack_picture(coarse, "z", one, camera, (31, 31), "exact", layers)
    np.testing.assert_allclose(mixed, stack_picture(fine, "z", other, camera, (31, 31), "exact"), atol=1e-9)
    assert mixed.max() > 0.1


def test_layers_of_labels_are_refused(tmp_path):
    with pytest.raises(VolprepError, match=r"VP3060 .*labels have nothing between"):
        slice_package(tmp_path, np.full((4, 5, 6), 9), slices="layers = 2", labels=True)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_the_opacity_of_paths_at_an_angle_is_that_of_the_closed_form(projection):
    texels = np.full((20, 9, 9, 4), 51, np.uint8)
    grid = Grid.of((20, 9, 9), (0.5, 40.0, 40.0))
    camera = view_from(grid, (300.0, 100.0, 250.0), projection).box_from_clip(grid, 1.0)
    picture = stack_picture(texels, "z", grid, camera, (31, 31), "exact")
    near, far = (camera @ [0.0, 0.0, depth, 1.0] for depth in (-1.0, 1.0))
    along = far[:3] / far[3] - near[:3] / near[3]
    slices = 20 * np.linalg.norm(along) / abs(along[2])
    assert picture[15, 15] == pytest.approx([1 - 0.8**slices] * 4, abs=1e-9)


@pytest.mark.parametrize("view", ["anterior-left", "posterior-left"])
def test_dense_slices_seen_at_an_angle_are_not_brighter_than_their_colour(tmp_path, view):
    points = (
        "{ value = 0.0, colour = [0.5, 0.5, 0.5], extinction_per_mm = 1.5 }, "
        "{ value = 255.0, colour = [0.5, 0.5, 0.5], extinction_per_mm = 1.5 }"
    )
    package = slice_package(tmp_path, np.full((9, 9, 9), 200), points=points)
    colour = package.manifest.transfer_functions[0].points[0].colour[0]
    with SliceRenderer(package) as renderer:
        picture = renderer.render(matrix(package, view), SIZE)
    np.testing.assert_allclose(picture[30, 30], (colour, colour, colour, 1.0), atol=3 / 255)


def test_the_bound_of_a_picture_is_a_few_codes(noise):
    _, bound, _ = expected_picture(noise, "z", matrix(noise, "superior"), SIZE)
    assert bound.max() < 1.6 * ODD[0] / 255


@pytest.mark.parametrize("view", SIX)
def test_a_picture_is_upright_and_not_mirrored(tmp_path, view):
    """One opaque voxel in a corner, and a faint one beside another: where they are is where the camera puts them."""
    codes = np.zeros((4, 6, 8))
    bright, dim = (0, 1, 2), (3, 4, 1)
    codes[bright], codes[dim] = 255, 90
    points = (
        "{ value = 0.0, colour = [1.0, 1.0, 1.0], extinction_per_mm = 0.0 }, "
        "{ value = 255.0, colour = [1.0, 1.0, 1.0], extinction_per_mm = 3.0 }"
    )
    package = slice_package(tmp_path, codes, (3.0, 2.0, 1.5), points=points)
    box_from_clip = matrix(package, view)
    with SliceRenderer(package) as renderer:
        picture = renderer.render(box_from_clip, (96, 96))[..., 3]
    clip_from_box = np.linalg.inv(box_from_clip)
    for voxel in (bright, dim):
        centre = (np.array(voxel[::-1]) + 0.5) * (1.5, 2.0, 3.0)
        x, y, _, w = clip_from_box @ [*centre, 1.0]
        i, j = round((1 - y / w) * 48 - 0.5), round((x / w + 1) * 48 - 0.5)
        assert picture[i - 1 : i + 2, j - 1 : j + 2].min() > 0.5
        # No other place is as bright as the first of them.
        picture[max(0, i - 17) : i + 18, max(0, j - 17) : j + 18] = 0
    assert picture.max() == 0


def test_a_paletted_picture_is_the_picture_of_its_colours(tmp_path, noise):
    codes = np.random.default_rng(3).integers(0, 256, ODD)
    spacing = (2.5, 0.75, 1.0)
    plain = slice_package(tmp_path / "rgba", codes, spacing, slices='form = "rgba"')
    for axis in "xyz":
        np.testing.assert_array_equal(stack_of(plain, axis), stack_of(noise, axis))
    with SliceRenderer(plain) as one, SliceRenderer(noise) as other:
        for view in (*SIX, "anterior-right"):
            box_from_clip = matrix(noise, view)
            np.testing.assert_array_equal(one.render(box_from_clip, SIZE), other.render(box_from_clip, SIZE))


def test_a_short_palette_is_drawn_with_its_own_colours(tmp_path):
    codes = np.random.default_rng(3).integers(0, 256, ODD)
    package = slice_package(tmp_path, codes, (2.5, 0.75, 1.0), slices="palette_entries = 5")
    assert len(np.unique(stack_of(package, "y").reshape(-1, 4), axis=0)) == 5
    box_from_clip = matrix(package, "anterior")
    with SliceRenderer(package) as renderer:
        picture = renderer.render(box_from_clip, SIZE)
    expected, bound, clear = expected_picture(package, "y", box_from_clip, SIZE)
    assert (np.abs(picture - expected) <= bound + 1e-6)[clear].all()


def test_slices_do_not_see_their_neighbours_in_the_texture(tmp_path):
    """Every other slice is empty: at the edge of a full one nothing of an empty one may show, and the reverse."""
    codes = np.zeros((6, 7, 8))
    codes[::2] = 255
    package = slice_package(tmp_path, codes, (1.0, 1.0, 1.0))
    box_from_clip = matrix(package, "superior")
    with SliceRenderer(package) as renderer:
        picture = renderer.render(box_from_clip, (200, 200))
    seen = picture[..., 3][picture[..., 3] > 0]
    assert np.ptp(seen) == 0
    assert (picture[..., 3] > 0).sum() > 2000


def test_one_voxel_is_a_square(tmp_path):
    package = slice_package(tmp_path, np.full((1, 1, 1), 255), (1.0, 1.0, 1.0))
    with SliceRenderer(package) as renderer:
        picture = renderer.render(matrix(package, "left"), SIZE)
    assert len(np.unique(picture[picture[..., 3] > 0][:, 3])) == 1


def test_slices_are_sorted_by_their_distance_from_the_eye_on_both_sides_of_it(noise):
    grid = noise.manifest.levels[0].grid
    centres = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    for projection in ("orthographic", "perspective"):
        camera = view_from(grid, (1e3, 20.0, 5.0), projection)
        inward = camera.box_from_clip(grid, 1.0)
        # The source has no direction of its own: box and patient have the same axes, and the eye is at large x.
        assert list(_back_to_front(centres, inward, 0)) == [0, 1, 2, 3, 4]
        camera = view_from(grid, (-1e3, 20.0, 5.0), projection)
        assert list(_back_to_front(centres, camera.box_from_clip(grid, 1.0), 0)) == [4, 3, 2, 1, 0]
    inside = np.add(grid.corner_mm_xyz, (2.9, 3.0, 3.0))
    between = view_from(grid, tuple(inside), "perspective").box_from_clip(grid, 1.0)
    assert list(_back_to_front(centres, between, 0)) == [4, 0, 3, 1, 2]


def test_a_perspective_of_a_stack_in_front_shows_the_nearest_slice(tmp_path):
    codes = np.zeros((1, 9, 9))
    codes[:, 0], codes[:, 8] = 255, 100
    points = (
        "{ value = 0.0, colour = [0.0, 1.0, 0.0], extinction_per_mm = 0.0 }, "
        "{ value = 100.0, colour = [0.0, 1.0, 0.0], extinction_per_mm = 9.0 }, "
        "{ value = 255.0, colour = [1.0, 0.0, 0.0], extinction_per_mm = 9.0 }"
    )
    package = slice_package(tmp_path, codes, (9.0, 1.0, 1.0), points=points, projection="perspective")
    grid = package.manifest.levels[0].grid
    views = standard_views(grid, "perspective")
    with SliceRenderer(package) as renderer:
        matrices = [views[view].box_from_clip(grid, 1.0) for view in ("anterior", "posterior")]
        front, back = (renderer.render(each, SIZE)[30, 30, :3] for each in matrices)
    np.testing.assert_allclose(front, (1, 0, 0), atol=0.02)
    np.testing.assert_allclose(back, (0, 1, 0), atol=0.02)


def test_the_stack_that_faces_the_viewer_is_drawn(noise):
    with SliceRenderer(noise) as renderer:
        found = {view: renderer.facing(matrix(noise, view))[0] for view in SIX}
    assert found == dict(zip(SIX, "xxyyzz", strict=True))


def test_of_stacks_that_face_the_viewer_alike_the_first_is_drawn(noise):
    """The standard view from anterior-left is as near to x as to y; rounding of a camera must not choose."""
    box_from_clip = matrix(noise, "anterior-left")
    with SliceRenderer(noise) as renderer:
        for row in (0, 1):
            rounded = box_from_clip.copy()
            rounded[row] *= 1 + 1e-12
            assert renderer.facing(rounded)[0] == "x"


def test_a_coarse_level_ends_where_the_volume_ends(tmp_path):
    """21 voxels of level 0 are 11 of level 1, of which the last one is half outside."""
    device = Path(volprep.scene.profiles.__file__).with_name("gles1.toml").read_text(encoding="utf-8")
    (tmp_path / "small.toml").write_text(device.replace("16_777_216", "18_000"), encoding="utf-8")
    codes = np.full((21, 17, 19), 120)
    package = slice_package(tmp_path, codes, profile="small.toml", extra="[pyramid]\ncoarsest_longest_axis = 8")
    (level,) = package.manifest.levels
    beyond = np.multiply(level.grid.shape_zyx, level.grid.spacing_mm_zyx) - level.grid.extent_mm_zyx
    assert level.index > 0
    assert (beyond > 0).any()
    size = (128, 128)
    for view in SIX:
        box_from_clip = matrix(package, view)
        with SliceRenderer(package) as renderer:
            seen = renderer.render(box_from_clip, size)[..., 3] > 0
        np.testing.assert_array_equal(seen, chords_mm(box_from_clip, size, level.grid) > 0)


def test_what_slices_cannot_do_is_said(noise):
    with pytest.raises(VolprepError, match="VP5018"):
        renderer_of(noise, level=7)
    with pytest.raises(VolprepError, match="VP5018"):
        renderer_of(noise, point=0)
    with pytest.raises(VolprepError, match="VP5018"):
        renderer_of(noise, transfer="nobody")
    with renderer_of(noise) as renderer, pytest.raises(VolprepError, match="VP5019"):
        renderer.render(matrix(noise, "left"), SIZE, 0.5)


def test_nothing_is_left_in_the_context(noise):
    with SliceRenderer(noise) as renderer:
        renderer.render(matrix(noise, "left"), SIZE)
        renderer.render(matrix(noise, "left"), (20, 30))
        assert renderer._gl.live["framebuffer"] == 1
    assert not any(renderer._gl.live.values())
