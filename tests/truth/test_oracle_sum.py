"""The oracle of several media in one picture: against its slow twin, closed forms, and the oracle of one medium."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from volprep.kernels import _native

TWIN_ROUNDING = 4e-14
NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)


class Placed(NamedTuple):
    """Where a medium lies: distance of its voxels, and the matrix [3, 4] from the camera's box to its own."""

    spacing: tuple[float, float, float]
    own_from_box: np.ndarray


def at_once(media, spacing):
    return [Placed(tuple(spacing), np.eye(3, 4))] * len(media)


def draw(media, camera, spacing=(1.0, 1.0, 1.0), tolerance=1e-6, *, shape_hw=(1, 1), threads=1, places=None, lit=()):
    """Picture and bound of volumes of one type, each with control points."""
    volumes = [volume for volume, _ in media]
    rows = [np.array([[p.value, *p.colour, p.extinction_per_mm] for p in points], dtype=float) for _, points in media]
    rgba, bound = np.full((*shape_hw, 4), np.nan), np.full(shape_hw, np.nan)
    ones, zeros = [1.0] * len(media), [0.0] * len(media)
    places = places or at_once(media, spacing)
    extents = [tuple(np.array(volume.shape[::-1]) * at.spacing) for volume, at in zip(volumes, places, strict=True)]
    matrices = np.stack([at.own_from_box for at in places])
    _native.render_oracle_sum(
        volumes,
        ones,
        zeros,
        rows,
        [at.spacing for at in places],
        extents,
        matrices,
        camera,
        tolerance,
        rgba,
        bound,
        lit,
        threads=threads,
    )
    return rgba, bound


class OwnRay:
    """A ray in the box of one medium, along which t remains what it is in the box of the camera."""

    def __init__(self, oracle, volume, at, ray_mm, normals=None):
        direction = np.array(ray_mm[1], dtype=float) / np.linalg.norm(ray_mm[1])
        self.oracle, self.volume, self.spacing = oracle, volume.astype(float), at.spacing
        self.origin = at.own_from_box[:, :3] @ np.array(ray_mm[0], dtype=float) + at.own_from_box[:, 3]
        self.direction = at.own_from_box[:, :3] @ direction
        extent = np.array(volume.shape[::-1]) * at.spacing
        self.light = (
            None
            if normals is None
            else oracle.light(normals @ at.own_from_box[:, :3], self.origin, self.direction, self.spacing, direction)
        )
        self.start, self.end = oracle.inside_box(self.origin, self.direction, ray_mm[2], extent)

    def planes(self):
        if self.start >= self.end:
            return set()
        found = {self.start, self.end}
        for axis in np.flatnonzero(self.direction):
            centres = (np.arange(self.volume.shape[2 - axis]) + 0.5) * self.spacing[axis]
            places = (centres - self.origin[axis]) / self.direction[axis]
            found |= {t for t in places if self.start < t < self.end}
        return found

    def meets(self, t):
        return self.start < t < self.end

    def shade(self, t):
        return 1.0 if self.light is None else self.light.shade(t)

    def ends_of_panels(self, low, high):
        return () if self.light is None else self.light.ends(low, high)

    def field(self, t):
        places = self.origin + np.multiply.outer(t, self.direction)
        return self.oracle.trilinear(self.volume, places, self.spacing)


def slow_sum(oracle, media, ray_mm, spacing, places=None, *, normals=None):
    """The light of one ray by brute force, as the twin of one medium finds it: pieces between all cuts of all media."""
    places = places or at_once(media, spacing)
    normals = normals or [None] * len(media)
    rays = [
        OwnRay(oracle, volume, at, ray_mm, held) for (volume, _), at, held in zip(media, places, normals, strict=True)
    ]
    planes = sorted(set().union(*(ray.planes() for ray in rays)))
    if not planes:
        return np.zeros(4)
    # A field says nothing outside of its box, and its cuts there do no harm.
    cuts = sorted(
        {
            cut
            for (_, points), ray in zip(media, rays, strict=True)
            for cut in oracle.cuts_along(ray.field, points, planes)
        }
    )
    depth, colour = 0.0, np.zeros(3)
    for low, high in pairwise(cuts):
        middle = (low + high) / 2
        met = [(ray, points) for (_, points), ray in zip(media, rays, strict=True) if ray.meets(middle)]
        if not met:
            continue
        segments = [
            int(np.searchsorted([p.value for p in points], ray.field(middle), side="right")) for ray, points in met
        ]

        def each(t, met=met, segments=segments):
            for (ray, points), segment in zip(met, segments, strict=True):
                values = ray.field(t)
                extinction = oracle.classify(points, segment, values, [p.extinction_per_mm for p in points])
                colours = oracle.classify(points, segment, values, np.array([p.colour for p in points]))
                yield extinction, colours * np.expand_dims(ray.shade(t), -1)

        def extinction(t, each=each):
            return sum(one for one, _ in each(t))

        piece = (high - low) / 2 * WEIGHTS @ extinction((low + high) / 2 + (high - low) / 2 * NODES)
        panels = np.linspace(low, high, 1 + max(1, int(np.ceil(2 * piece))))
        close = [ray.ends_of_panels(low, high) for ray, _ in met]
        for first, last in pairwise(np.unique(np.concatenate([panels, *close]))):
            half = (last - first) / 2
            t = first + half * (1 + NODES)
            inner = first + np.multiply.outer((t - first) / 2, 1 + NODES)
            through = np.exp(-depth - (t - first) / 2 * (extinction(inner) @ WEIGHTS)) * half * WEIGHTS
            colour = colour + sum((through * one) @ shade for one, shade in each(t))
            depth += half * WEIGHTS @ extinction(t)
    return np.append(colour, -np.expm1(-depth))


def random_media(oracle, rng, scale):
    shape, kind = tuple(rng.integers(1, 5, 3)), rng.choice([np.uint8, np.float32])
    media = []
    for _ in range(rng.integers(2, 5)):
        count = rng.integers(1, 5)
        values = np.sort(rng.uniform(0, 255, count))
        if count > 2 and rng.random() < 0.4:
            values[1] = values[2]  # a jump
        extinctions = np.where(rng.random(count) < 0.3, 0.0, rng.uniform(0, scale, count))
        points = [oracle.point(v, e, tuple(rng.uniform(0, 1, 3))) for v, e in zip(values, extinctions, strict=True)]
        media.append((rng.integers(0, 256, shape).astype(kind), points))
    return media, rng.choice([0.01, 0.3, 1.0, 1.7], 3)


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    depth=st.floats(-3, 2).map(lambda power: 10.0**power),
    tolerance=st.floats(-9, -2).map(lambda power: 10.0**power),
    axis=st.sampled_from([None, None, 0, 1, 2]),
)
@example(seed=1, depth=30.0, tolerance=1e-4, axis=None)
def test_random_rays_agree_within_the_bound(oracle, seed, depth, tolerance, axis):
    rng = np.random.default_rng(seed)
    media, spacing = random_media(oracle, rng, depth)
    extent = np.array(media[0][0].shape[::-1]) * spacing
    origin, target = rng.uniform(-0.3, 1.3, 3) * extent, rng.uniform(0, 1, 3) * extent
    if axis is not None:
        target[axis] = origin[axis]
    length = np.linalg.norm(target - origin) * rng.uniform(0.5, 3)
    rgba, bound = draw(media, oracle.ray(origin, target - origin, length), spacing, tolerance)
    truth = slow_sum(oracle, media, (origin, target - origin, length), spacing)
    assert bound[0, 0] <= tolerance
    assert np.abs(rgba[0, 0] - truth).max() <= bound[0, 0] + TWIN_ROUNDING


def on_own_grids(rng, media, spacing, *, aligned):
    """The media with other volumes on grids that are turned and sheared, and where they lie."""
    extent = np.array(media[0][0].shape[::-1]) * spacing
    places, resized = at_once(media[:1], spacing), [media[0]]
    for volume, points in media[1:]:
        other = rng.integers(0, 256, tuple(rng.integers(1, 5, 3))).astype(volume.dtype)
        own = tuple(spacing * rng.uniform(0.3, 1.6, 3))
        turn = np.eye(3) if aligned else Rotation.random(random_state=rng).as_matrix()
        sheared = turn @ (np.eye(3) + np.triu(rng.uniform(-0.3, 0.3, (3, 3))))
        half = np.array(other.shape[::-1]) * own / 2
        places.append(Placed(own, np.column_stack([sheared, half - sheared @ (extent * rng.uniform(0.2, 0.8, 3))])))
        resized.append((other, points))
    return resized, places


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    depth=st.floats(-3, 2).map(lambda power: 10.0**power),
    tolerance=st.floats(-9, -2).map(lambda power: 10.0**power),
    aligned=st.booleans(),
)
@example(seed=3, depth=3.0, tolerance=1e-6, aligned=True)
def test_random_rays_through_grids_of_their_own_agree_within_the_bound(oracle, seed, depth, tolerance, aligned):
    rng = np.random.default_rng(seed)
    media, spacing = random_media(oracle, rng, depth)
    extent = np.array(media[0][0].shape[::-1]) * spacing
    resized, places = on_own_grids(rng, media, spacing, aligned=aligned)
    origin, target = rng.uniform(-0.3, 1.3, 3) * extent, rng.uniform(0, 1, 3) * extent
    length = np.linalg.norm(target - origin) * rng.uniform(0.5, 3)
    camera = oracle.ray(origin, target - origin, length)
    rgba, bound = draw(resized, camera, tolerance=tolerance, places=places)
    truth = slow_sum(oracle, resized, (origin, target - origin, length), None, places)
    assert bound[0, 0] <= tolerance
    assert np.abs(rgba[0, 0] - truth).max() <= bound[0, 0] + TWIN_ROUNDING


@settings(max_examples=15)
@given(
    seed=st.integers(0, 2**32 - 1),
    depth=st.floats(-2, 2).map(lambda power: 10.0**power),
    tolerance=st.floats(-8, -2).map(lambda power: 10.0**power),
)
@example(seed=3, depth=3.0, tolerance=1e-6)
def test_lit_media_agree_within_the_bound(oracle, seed, depth, tolerance):
    rng = np.random.default_rng(seed)
    media, spacing = random_media(oracle, rng, depth)
    media, places = on_own_grids(rng, media, spacing, aligned=rng.random() < 0.5)
    extent = np.array(media[0][0].shape[::-1]) * spacing
    # One medium is not lit, nor are some voxels of the others.
    normals = [rng.normal(0, 1, (*volume.shape, 3)).astype(np.float32) for volume, _ in media]
    for held in normals:
        held[rng.random(held.shape[:3]) < 0.4] = 0.0
    normals[-1] = None
    lit = [("", held, 0.0, (False, False, False)) for held in normals]
    origin, target = rng.uniform(-0.3, 1.3, 3) * extent, rng.uniform(0, 1, 3) * extent
    length = np.linalg.norm(target - origin) * rng.uniform(0.5, 3)
    camera = oracle.ray(origin, target - origin, length)
    rgba, bound = draw(media, camera, tolerance=tolerance, places=places, lit=lit)
    truth = slow_sum(oracle, media, (origin, target - origin, length), None, places, normals=normals)
    assert bound[0, 0] <= tolerance
    assert np.abs(rgba[0, 0] - truth).max() <= bound[0, 0] + 1e-11


def test_a_medium_ends_where_its_box_does(oracle):
    volume = np.full((2, 2, 2), 7, np.uint8)
    points = [oracle.point(7, 0.25)]
    apart = np.array([[1.0, 0, 0, -3.0], [0, 1.0, 0, 0], [0, 0, 1.0, 0]])
    places = [Placed((1.0, 1.0, 1.0), np.eye(3, 4)), Placed((1.0, 1.0, 0.5), apart)]
    rgba, _ = draw([(volume, points)] * 2, oracle.ray((-1, 0.7, 0.6), (1, 0, 0), 20), places=places)
    assert rgba[0, 0, 3] == pytest.approx(-np.expm1(-0.25 * 4), abs=1e-9)
    rgba, _ = draw([(volume, points)] * 2, oracle.ray((-1, 0.7, 1.3), (1, 0, 0), 20), places=places)
    assert rgba[0, 0, 3] == pytest.approx(-np.expm1(-0.25 * 2), abs=1e-9)


@pytest.mark.parametrize("depths", [(1e-6, 2e-6), (0.1, 0.4), (3.0, 20.0), (0.2, 1e5), (1e9, 1e9)])
def test_homogeneous_media_mix_as_their_extinctions(oracle, depths):
    volume = np.full((3, 4, 5), 7, np.uint8)
    colours = np.array([(1.0, 0.2, 0.0), (0.1, 0.5, 0.9)])
    media = [(volume, [oracle.point(7, tau / 5, tuple(c))]) for tau, c in zip(depths, colours, strict=True)]
    rgba, bound = draw(media, oracle.ray((-1, 1.7, 1.2), (1, 0, 0), 20))
    alpha = -np.expm1(-sum(depths))
    truth = np.append(np.array(depths) @ colours / sum(depths) * alpha, alpha)
    assert bound[0, 0] <= 1e-6
    assert np.abs(rgba[0, 0] - truth).max() <= bound[0, 0] + 4 * np.finfo(float).eps


def picture_scene(oracle, media_count=2):
    rng = np.random.default_rng(5)
    media = []
    for colours in (((1, 0, 0), (0, 1, 0)), ((0, 0, 1), (1, 1, 1)), ((1, 1, 0), (0, 1, 1)))[:media_count]:
        points = [oracle.point(40, 0.0, colours[0]), oracle.point(150, 1.5, colours[1])]
        points += [oracle.point(150, 0.2, colours[0]), oracle.point(240, 3.0, colours[1])]
        media.append((rng.integers(0, 256, (6, 5, 7)).astype(np.uint8), points))
    camera = oracle.ray((3.5, 2.5, -4.0), (0.1, 0.2, 1.0), 14.0)
    camera[:3, 0], camera[:3, 1] = (3.0, 0.1, 0.0), (0.0, 2.5, 0.2)
    return media, camera


def halved(media):
    volume, points = media
    return volume, [point._replace(extinction_per_mm=point.extinction_per_mm / 2) for point in points]


def test_a_medium_twice_at_half_extinction_is_the_medium_itself(oracle):
    media, camera = picture_scene(oracle)
    single = oracle.draw(*media[0], camera, shape_hw=(9, 9), tolerance=1e-8)
    rgba, bound = draw([halved(media[0])] * 2, camera, tolerance=1e-8, shape_hw=(9, 9))
    assert bound.max() <= 1e-8
    assert single.rgba[..., 3].max() > 0.9
    assert np.all(np.abs(rgba - single.rgba).max(axis=-1) <= bound + single.bound)


def test_a_medium_alone_has_the_picture_of_the_other_oracle_bit_for_bit(oracle):
    media, camera = picture_scene(oracle)
    single = oracle.draw(*media[0], camera, shape_hw=(9, 9))
    dark = (media[1][0], [point._replace(extinction_per_mm=0.0) for point in media[1][1]])
    for shown in ([media[0]], [media[0], dark], [dark, media[0]]):
        rgba, bound = draw(shown, camera, shape_hw=(9, 9))
        np.testing.assert_array_equal(rgba, single.rgba)
        np.testing.assert_array_equal(bound, single.bound)


def test_the_order_of_the_media_changes_nothing(oracle):
    media, camera = picture_scene(oracle, 3)
    rgba, bound = draw(media, camera, tolerance=1e-9, shape_hw=(9, 9))
    other, other_bound = draw(media[::-1], camera, tolerance=1e-9, shape_hw=(9, 9))
    assert np.abs(rgba - other).max() <= bound.max() + other_bound.max() <= 2e-9


def test_the_number_of_threads_changes_nothing(oracle):
    media, camera = picture_scene(oracle, 3)
    for first, second in zip(
        draw(media, camera, shape_hw=(9, 9)), draw(media, camera, shape_hw=(9, 9), threads=2), strict=True
    ):
        np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("extinction", [1e3, 1e6, 1e9])
def test_walls_in_a_haze_keep_their_bound(oracle, extinction):
    # A wall at a jump of one field, in a haze of another one: stiff, and the place of the wall is uncertain.
    ramp = np.broadcast_to(np.arange(9, dtype=np.float32), (3, 4, 9)).copy()
    wall = [oracle.point(4.3, 0.0, (1, 0, 0)), oracle.point(4.3, extinction, (1, 0, 0))]
    haze = [oracle.point(0, 0.1, (0, 0, 1)), oracle.point(8, 0.3, (0, 1, 1))]
    rgba, bound = draw([(ramp, wall), (ramp, haze)], oracle.ray((-1, 1.9, 1.3), (1, 0.05, 0.02), 14))
    haze_before, _ = draw([(ramp[..., :5].copy(), haze)], oracle.ray((-1, 1.9, 1.3), (1, 0.05, 0.02), 14))
    assert bound[0, 0] <= 1e-6
    assert 1 - rgba[0, 0, 3] <= bound[0, 0]
    # Behind the haze nothing but red.
    assert 0.0 < rgba[0, 0, 2] < haze_before[0, 0, 2] + 0.1
    assert abs(rgba[0, 0, 0] + rgba[0, 0, 2] - 1.0) <= 2 * bound[0, 0] + 3e-1 / extinction


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"volumes": []}, "expected 1 to 16"),
        ({"slopes": [1.0]}, "an entry for each volume"),
        ({"own_from_box": np.zeros((1, 3, 4))}, "an entry for each volume"),
        ({"spacings_mm_xyz": [(1.0, 1.0, 1.0), (1.0, 0.0, 1.0)]}, "must be above 0"),
        ({"points": [np.zeros((0, 5)), np.zeros((1, 5))]}, "at least one row"),
        ({"tolerance": 0.0}, "at least 1e-13"),
    ],
)
def test_what_does_not_fit_is_refused(change, says):
    given_ = {
        "volumes": [np.zeros((2, 3, 4), np.uint8)] * 2,
        "slopes": [1.0, 1.0],
        "intercepts": [0.0, 0.0],
        "points": [np.zeros((1, 5))] * 2,
        "spacings_mm_xyz": [(1.0, 1.0, 1.0)] * 2,
        "extents_mm_xyz": [(4.0, 3.0, 2.0)] * 2,
        "own_from_box": np.stack([np.eye(3, 4)] * 2),
        "box_from_clip": np.eye(4),
        "tolerance": 1e-6,
        "rgba": np.zeros((1, 1, 4)),
        "bound": np.zeros((1, 1)),
    }
    with pytest.raises(ValueError, match=says):
        _native.render_oracle_sum(**(given_ | change))


def test_volumes_of_two_types_are_refused():
    volumes = [np.zeros((2, 3, 4), np.uint8), np.zeros((2, 3, 4), np.int16)]
    with pytest.raises(TypeError, match="int16, expected uint8"):
        _native.render_oracle_sum(
            volumes,
            [1.0] * 2,
            [0.0] * 2,
            [np.zeros((1, 5))] * 2,
            [(1.0,) * 3] * 2,
            [(4.0, 3.0, 2.0)] * 2,
            np.stack([np.eye(3, 4)] * 2),
            np.eye(4),
            1e-6,
            np.zeros((1, 1, 4)),
            np.zeros((1, 1)),
        )
