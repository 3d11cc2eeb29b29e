"""The oracle where arithmetic is hard: opaque walls, infinite extinction, values on a jump, extreme numbers."""

import closed_forms
import numpy as np
import pytest

ALONG_X = ((-1.0, 0.5, 0.5), (1, 0, 0), 40.0)


def noise(shape=(6, 6, 6), seed=11):
    return np.random.default_rng(seed).uniform(0, 100, shape).astype(np.float32)


def fan(count=24):
    """A perspective camera a little outside the noise, so that no ray is like another."""
    near, far, width = 2.0, 30.0, 0.5
    clip_from_eye = np.array(
        [
            [1 / width, 0, 0, 0],
            [0, 1 / width, 0, 0],
            [0, 0, (near + far) / (near - far), 2 * near * far / (near - far)],
            [0, 0, -1.0, 0],
        ]
    )
    box_from_eye = np.eye(4)
    box_from_eye[:3, 3] = (3.1, 2.9, 12.0)
    return box_from_eye @ np.linalg.inv(clip_from_eye), (count, count)


def ramp_points(oracle, scale):
    return [
        oracle.point(30, 0.0, (1, 0, 0)),
        oracle.point(60, scale, (0, 1, 0)),
        oracle.point(60, 0.0),
        oracle.point(80, 0.5 * scale, (0, 0, 1)),
    ]


@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1.0, 1e3, 1e6, 1e9, np.inf])
def test_pictures_stay_within_their_limits_at_any_extinction(oracle, scale):
    camera, shape_hw = fan()
    rgba, bound = oracle.draw(noise(), ramp_points(oracle, scale), camera, shape_hw=shape_hw)
    assert np.isfinite(rgba).all()
    assert (rgba >= 0).all()
    assert (rgba <= 1).all()
    assert (rgba[..., :3] <= rgba[..., 3:] + 2 * bound[..., None]).all()
    if scale <= 1e6:
        assert bound.max() <= 1e-6


def test_opacity_grows_with_extinction(oracle):
    camera, shape_hw = fan()
    last = np.zeros(shape_hw)
    for scale in 10.0 ** np.arange(-6, 8):
        rgba, bound = oracle.draw(noise(), ramp_points(oracle, scale), camera, shape_hw=shape_hw)
        assert (rgba[..., 3] >= last - 2 * bound).all()
        last = rgba[..., 3]


@pytest.mark.parametrize("scale", [1.0, 1e3, 1e6])
def test_a_smaller_tolerance_stays_inside_the_bound_of_a_larger_one(oracle, scale):
    camera, shape_hw = fan(40)
    fine = oracle.draw(noise(), ramp_points(oracle, scale), camera, shape_hw=shape_hw, tolerance=1e-10)
    for tolerance in (1e-2, 1e-4, 1e-6, 1e-8):
        coarse = oracle.draw(noise(), ramp_points(oracle, scale), camera, shape_hw=shape_hw, tolerance=tolerance)
        error = np.abs(coarse.rgba - fine.rgba).max(axis=-1)
        assert (error <= coarse.bound + fine.bound).all()
        assert coarse.bound.max() <= tolerance
        # A bound that is always a million times too large would prove nothing.
        assert error.max() >= 1e-3 * tolerance


def test_a_field_without_wall_in_front_shows_the_colour_of_the_wall(oracle):
    volume = (np.arange(8, dtype=np.float32) + 0.5)[None, None, :].copy()
    for wall in (1e6, 1e9, 1e300, np.inf):
        points = [
            oracle.point(3, 0.0, (1, 1, 0)),
            oracle.point(3, wall, (0.2, 0.4, 0.8)),
            oracle.point(8, wall, (1, 1, 1)),
        ]
        rgba, bound = oracle.draw(volume, points, oracle.ray(*ALONG_X))
        assert bound[0, 0] <= 2e-6
        # The colour changes by 0.16 per mm behind the wall's face, and the light comes from its first 1e-6 mm.
        np.testing.assert_allclose(rgba[0, 0], [0.2, 0.4, 0.8, 1.0], atol=2e-6)


def test_extinction_that_rises_to_infinity_hides_what_is_behind(oracle):
    volume = np.linspace(0, 10, 8, dtype=np.float32)[None, None, :].copy()
    points = [
        oracle.point(2, 0.0, (0.5, 0.5, 0.5)),
        oracle.point(4, np.inf, (0.5, 0.5, 0.5)),
        oracle.point(9, 0.0, (1, 0, 0)),
    ]
    rgba, bound = oracle.draw(volume, points, oracle.ray(*ALONG_X))
    np.testing.assert_allclose(rgba[0, 0], [0.5, 0.5, 0.5, 1.0], atol=1e-6)
    assert bound[0, 0] <= 1e-6


def test_many_faint_layers_add_up(oracle):
    volume = np.tile(np.array([0, 100], np.uint8), 500)[None, None, :].copy()
    points = [oracle.point(0, 1e-6, (1, 0.5, 0)), oracle.point(100, 1e-6, (1, 0.5, 0))]
    rgba, bound = oracle.draw(volume, points, oracle.ray((-1, 0.5, 0.5), (1, 0, 0), 2000))
    truth = closed_forms.layers_light([(1, 0.5, 0)], [1e-6], [1000.0])
    assert np.abs(rgba[0, 0] - truth).max() <= bound[0, 0] <= 1e-11


def test_a_constant_volume_on_a_jump_has_the_side_above(oracle):
    volume = np.full((4, 4, 4), 100, np.uint8)
    above = [oracle.point(100, 0.0), oracle.point(100, 0.5, (0, 1, 0))]
    below = [oracle.point(100, 0.5), oracle.point(100, 0.0)]
    camera = oracle.ray((-1, 1.3, 2.2), (1, 0, 0), 10)
    rgba, bound = oracle.draw(volume, above, camera)
    np.testing.assert_allclose(rgba[0, 0], closed_forms.layers_light([(0, 1, 0)], [0.5], [4.0]), atol=1e-14)
    assert bound[0, 0] <= 1e-12
    assert oracle.draw(volume, below, camera).rgba.max() == 0.0


def test_a_plateau_that_float64_cannot_place_has_a_bound_that_covers_both_sides(oracle):
    # The ray runs along an edge between cells where the field is exactly 100, and below 100 beside it.
    volume = np.full((3, 3, 3), 90, np.uint8)
    volume[1, 1, :] = 100
    points = [oracle.point(100, 0.0), oracle.point(100, 0.5)]
    rgba, bound = oracle.draw(volume, points, oracle.ray((-1, 1.5, 1.5), (1, 0, 0), 10))
    both_sides = [0.0, -np.expm1(-0.5 * 3)]
    assert max(abs(rgba[0, 0, 3] - side) for side in both_sides) <= bound[0, 0]


@pytest.mark.parametrize(
    ("dtype", "values"),
    [
        (np.uint16, (0, 65535)),
        (np.int16, (-32768, 32767)),
        (np.float32, (-3.0e38, 3.0e38)),
        (np.float32, (1e-45, 1.2e-38)),
        (np.float32, (1e6, 1e6 + 0.5)),
    ],
)
def test_values_of_any_size_work(oracle, dtype, values):
    low, high = (float(dtype(value)) for value in values)
    volume = np.array([low, high], dtype)[None, None, :].copy()
    points = [oracle.point(low, 0.2, (1, 0, 0)), oracle.point(high, 0.7, (0, 0, 1))]
    rgba, bound = oracle.draw(volume, points, oracle.ray((0.5, 0.5, 0.5), (1, 0, 0), 1.0), tolerance=1e-9)
    truth = closed_forms.linear_light(((1, 0, 0), (0, 0, 1)), (0.2, 0.7), 1.0)
    assert np.abs(rgba[0, 0] - truth).max() <= bound[0, 0] <= 1e-9


def test_control_points_closer_than_float64_can_tell_make_a_jump(oracle):
    volume = np.linspace(0, 10, 11, dtype=np.float32)[None, None, :].copy()
    close = np.nextafter(5.0, 6.0)
    near = [oracle.point(5.0, 0.0), oracle.point(close, 2.0), oracle.point(10, 2.0)]
    jump = [oracle.point(5.0, 0.0), oracle.point(5.0, 2.0), oracle.point(10, 2.0)]
    camera = oracle.ray(*ALONG_X)
    np.testing.assert_array_equal(oracle.draw(volume, near, camera).rgba, oracle.draw(volume, jump, camera).rgba)


@pytest.mark.parametrize("scale", [1.0, 1e4])
def test_rounding_of_a_camera_far_away_is_in_the_bound(oracle, scale):
    # 16 m away coordinates are rounded to 2e-12 mm, and steep walls feel it. Powers of two make both rays one ray.
    points = [
        oracle.point(45, 0.0, (1, 0, 0)),
        oracle.point(45, scale, (0, 1, 0)),
        oracle.point(55, scale, (0, 0, 1)),
        oracle.point(55, 0.0),
    ]
    rng = np.random.default_rng(4)
    differences = []
    for _ in range(200):
        inside = np.round(rng.uniform(1, 5, 3) * 2**20) / 2**20
        direction = np.array([0.0, 0.6, -0.8])
        near = oracle.draw(noise(), points, oracle.ray(inside - 10 * direction, direction, 20), tolerance=1e-13)
        far = oracle.draw(noise(), points, oracle.ray(inside - 2**14 * direction, direction, 2**15), tolerance=1e-13)
        differences.append(np.abs(near.rgba - far.rgba).max())
        assert differences[-1] <= near.bound[0, 0] + far.bound[0, 0]
    # Far more than what the rounding of colours alone could do.
    assert max(differences) > 1e-13


def test_a_grazing_change_of_colour_has_its_place_in_the_bound(oracle):
    # Red turns blue at y = 4. The ray rises by 2^-13 of its length, so 2e-12 mm across it are 2e-8 mm along it.
    volume = np.broadcast_to(np.arange(8, dtype=np.float32)[:, None] + 0.5, (4, 8, 8)).copy()
    points = [oracle.point(4, 0.5, (1, 0, 0)), oracle.point(4, 0.5, (0, 0, 1))]
    direction = np.array([1.0, 2.0**-13, 0.0])
    direction /= np.linalg.norm(direction)
    differences = []
    for middle in np.arange(2.125, 6.0, 0.125):
        inside = np.array([middle, 4.0, 2.0])
        near = oracle.draw(volume, points, oracle.ray(inside - 8 * direction, direction, 16), tolerance=1e-13)
        far = oracle.draw(volume, points, oracle.ray(inside - 2**14 * direction, direction, 2**15), tolerance=1e-13)
        differences.append(np.abs(near.rgba - far.rgba).max())
        assert differences[-1] <= near.bound[0, 0] + far.bound[0, 0] <= 1e-5
    assert max(differences) > 1e-10
