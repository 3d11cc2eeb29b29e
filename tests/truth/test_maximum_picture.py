"""Pictures of maximum intensity projection: what is shown of the greatest value, and how far it may be wrong."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiny_packages import function

from volprep.kernels import _native
from volprep.scene.points import Measure, TransferWish
from volprep.truth.camera import standard_views
from volprep.truth.projection import projected_picture
from volprep.truth.volume import Volume
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid

ROUNDING = 1e-14


def transfer(*points):
    return function(*((value, colour, extinction) for value, extinction, colour in points))


GREY = transfer((0, 9.0, (0, 0, 0)), (200, 9.0, (1, 1, 1)))


def seen(oracle, values, function=GREY, slope=1.0, intercept=0.0, **options):
    """The one pixel of a ray along x through the centres of the voxels `values`."""
    volume = np.array(values, np.float32)[None, None, :]
    camera = oracle.ray((-1, 0.5, 0.5), (1, 0, 0), volume.shape[2] + 2)
    field = Volume(volume, Grid.of(volume.shape, (1.0, 1.0, 1.0)), slope, intercept)
    picture = projected_picture("maximum", field, function, camera, (1, 1), **options)
    return picture.rgba[0, 0], picture.bound[0, 0]


@pytest.mark.parametrize(("options", "reference_mm"), [({}, 1.0), ({"reference_mm": 0.25}, 0.25)])
def test_a_pixel_has_the_colour_of_the_greatest_value_and_the_opacity_of_the_reference_length(
    oracle, options, reference_mm
):
    function = transfer((0, 0.5, (0, 0, 1)), (100, 2.5, (1, 0.5, 0)))
    rgba, bound = seen(oracle, [0, 25, 10], function, **options)
    alpha = 1 - np.exp(-1.0 * reference_mm)
    np.testing.assert_allclose(rgba, [0.25 * alpha, 0.125 * alpha, 0.75 * alpha, alpha], atol=ROUNDING)
    assert bound < 1e-13


def test_the_opacity_that_a_scene_states_for_a_length_comes_out_with_this_length(oracle):
    wish = TransferWish(
        reference_mm=0.4,
        points=({"value": 0, "colour": "#000000", "opacity": 0.1}, {"value": 80, "colour": "#ffffff", "opacity": 0.7}),
    )
    function = wish.function("test", Measure(0.0, 1.0, 1.0))
    rgba, _ = seen(oracle, [3, 80, 3], function, reference_mm=0.4)
    np.testing.assert_allclose(rgba, [0.7] * 4, atol=ROUNDING)


def test_the_picture_does_not_depend_on_the_length_of_the_ray_or_the_order_of_values(oracle):
    first, _ = seen(oracle, [0, 120, 50])
    for values in ([50, 120, 0], [120], [0, 120, 0, 120], [7] * 30 + [120] + [9] * 50):
        np.testing.assert_allclose(seen(oracle, values)[0], first, atol=1e-12)
    assert first[0] == pytest.approx(0.6, abs=1e-3)


def test_the_greatest_value_wins_even_if_the_function_hides_it(oracle):
    # As in VTK: what is projected is the value, not the opacity.
    function = transfer((50, 5.0, (1, 0, 0)), (60, 0.0, (1, 0, 0)))
    assert seen(oracle, [0, 40, 0], function)[0][3] > 0.99
    assert seen(oracle, [0, 40, 90], function)[0].tolist() == [0, 0, 0, 0]


def test_with_a_negative_slope_the_greatest_physical_value_is_shown(oracle):
    rgba, _ = seen(oracle, [10, 200, 60], slope=-1.0, intercept=160.0)
    alpha = 1 - np.exp(-9.0)
    np.testing.assert_allclose(rgba, [0.75 * alpha] * 3 + [alpha], atol=1e-13)


def test_pixels_beside_the_volume_are_transparent_and_exact():
    grid = Grid.of((5, 6, 7), (2.0, 1.5, 0.75))
    volume = np.full(grid.shape_zyx, 77, np.uint8)
    matrix = standard_views(grid, "perspective")["anterior-left"].box_from_clip(grid, 2.0)
    picture = projected_picture("maximum", Volume(volume, grid), GREY, matrix, (20, 40))
    beside = picture.rgba[..., 3] == 0
    assert 100 < beside.sum() < 700
    assert (picture.rgba[beside] == 0).all()
    assert (picture.bound[beside] == 0).all()
    assert np.ptp(picture.rgba[~beside], axis=0).max() == 0
    assert picture.bound[~beside].max() < 1e-13


@pytest.mark.parametrize("view", ["anterior", "left", "superior", "anterior-right", "posterior-left"])
def test_the_view_from_the_opposite_side_is_the_mirrored_picture(view):
    turn = ((0.0, 0.8, 0.6), (1.0, 0.0, 0.0), (0.0, 0.6, -0.8))
    grid = Grid.of((9, 21, 17), (2.0, 1.5, 0.75), (-3.0, 40.0, 7.0), turn)
    volume = np.random.default_rng(2).integers(0, 200, grid.shape_zyx).astype(np.uint8)
    front = standard_views(grid)[view]
    eye = np.array(front.eye_mm_xyz) + 2 * front.focus_mm * np.array(front.forward) / np.linalg.norm(front.forward)
    back = replace(front, eye_mm_xyz=tuple(eye), forward=tuple(-part for part in front.forward))
    one, other = (
        projected_picture("maximum", Volume(volume, grid), GREY, camera.box_from_clip(grid, 1.5), (22, 33))
        for camera in (front, back)
    )
    difference = np.abs(one.rgba - other.rgba[:, ::-1]).max(axis=-1)
    assert (difference <= one.bound + other.bound[:, ::-1]).all()
    assert one.bound.max() < 1e-10
    assert np.unique(one.rgba[..., 0]).size > 50


def test_on_a_plateau_at_a_jump_the_side_above_is_shown_and_known(oracle):
    function = transfer((0, 0, (0, 0, 0)), (80, 0, (0, 0, 0)), (80, 3.0, (1, 0, 0)), (100, 3.0, (1, 0, 0)))
    rgba, bound = seen(oracle, [80, 80, 80], function)
    alpha = 1 - np.exp(-3.0)
    np.testing.assert_allclose(rgba, [alpha, 0, 0, alpha], atol=ROUNDING)
    assert bound < 1e-13


def test_a_maximum_that_may_be_on_either_side_of_a_jump_has_the_jump_in_its_bound(oracle):
    jump = (80, 0.1, (0, 1, 0)), (80, 3.0, (1, 0, 0))
    _, bound = seen(oracle, [10, 80, 30], transfer(*jump))
    assert bound == pytest.approx(1 - np.exp(-3.0), abs=1e-12)
    _, away = seen(oracle, [10, 80.5, 30], transfer(*jump))
    assert away < 1e-12


@settings(max_examples=200)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 7), power=st.floats(-2, 11))
def test_the_bound_holds_wherever_the_maximum_may_be(oracle, seed, count, power):
    rng = np.random.default_rng(seed)
    volume = rng.uniform(0, 100, (3, 4, 5)).astype(np.float32)
    grid = Grid.of(volume.shape, (1.0, 1.0, 1.0))
    camera = oracle.ray((-1.2, 0.3, 0.4), (1, 0.3, 0.2), 20)
    value, error = np.empty((1, 1)), np.empty((1, 1))
    _native.render_projection(volume, 1.0, 0.0, (1.0, 1.0, 1.0), (5.0, 4.0, 3.0), camera, "maximum", value, error)
    # Control points as close together as the maximum is uncertain, and jumps.
    values = np.sort(value[0, 0] + error[0, 0] * rng.uniform(-2, 2, count))
    if count > 2 and rng.random() < 0.5:
        values[1] = values[2]
    points = [
        oracle.point(v, rng.uniform(0, 10.0**power) * (rng.random() < 0.7), tuple(rng.uniform(0, 1, 3))) for v in values
    ]
    picture = projected_picture(
        "maximum",
        Volume(volume, grid),
        transfer(*[(p.value, p.extinction_per_mm, p.colour) for p in points]),
        camera,
        (1, 1),
    )
    for where in np.linspace(-1, 1, 41):
        truth = np.array([value[0, 0] + where * error[0, 0]])
        segment = int(np.searchsorted(values, truth[0], side="right"))
        colour = oracle.classify(points, segment, truth, np.array([p.colour for p in points]))
        # The oracle's most: what is denser shows the same in 1 mm.
        extinction = oracle.classify(points, segment, truth, [min(p.extinction_per_mm, 1e9) for p in points])
        alpha = -np.expm1(-extinction)
        rgba = np.append(colour * alpha[:, None], alpha)
        assert np.abs(rgba - picture.rgba[0, 0]).max() <= picture.bound[0, 0] + ROUNDING


def test_a_voxel_that_is_not_finite_is_refused():
    volume = np.zeros((2, 3, 4), np.float32)
    volume[1, 2, 3] = np.inf
    with pytest.raises(VolprepError, match="VP6001"):
        projected_picture("maximum", Volume(volume, Grid.of(volume.shape, (1.0, 1.0, 1.0))), GREY, np.eye(4), (1, 1))


@pytest.mark.parametrize(
    ("shape", "options", "message"),
    [
        ((2, 3, 5), {}, r"volume has shape \(2, 3, 5\), its grid \(2, 3, 4\)"),
        ((2, 3, 4), {"reference_mm": 0.0}, "reference_mm is 0; it must be above 0"),
        ((2, 3, 4), {"reference_mm": float("nan")}, "reference_mm is nan"),
    ],
)
def test_what_does_not_fit_is_refused(shape, options, message):
    grid = Grid.of((2, 3, 4), (1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match=message):
        projected_picture("maximum", Volume(np.zeros(shape, np.uint8), grid), GREY, np.eye(4), (1, 1), **options)
