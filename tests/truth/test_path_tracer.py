"""Path tracing against closed forms, quadrature, laws of light, and a slow twin with the same random numbers."""

import math

import numpy as np
import pytest
from scene_builds import view_of
from scipy.integrate import quad
from scipy.special import expn
from tiny_packages import function
from traced_places import traced_places

from volprep.kernels import _native
from volprep.truth.path_traced import LitVolume, traced_picture
from volprep.truth.phantoms import distance, sampled
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel, Sun

WHITE = (1.0, 1.0, 1.0)
CHANCE = 1e-6
"""Chance of each interval to fail."""
WIDE = 1e6
"""Spacing in millimetres that makes a slab of a box: light leaves it through two faces only."""


def bernstein_interval(variance: np.ndarray, samples: int, largest: float, chance: float) -> np.ndarray:
    """Return half the width of an interval around means of `samples` independent samples in 0 to `largest`.

    `variance` is that of the means. The expected value lies outside with at most `chance` (empirical Bernstein bound,
    Maurer and Pontil 2009, Theorem 4, for both sides).
    """
    depth = math.log(4.0 / chance)
    return np.sqrt(2.0 * variance * depth) + 7.0 * largest * depth / (3.0 * (samples - 1))


def slab(extinction_per_mm, model, depth=4, colour=WHITE):
    """A homogeneous slab of `depth` mm along z."""
    volume = np.ones((depth, 2, 2), np.uint8)
    grid = Grid.of(volume.shape, (1.0, WIDE, WIDE))
    return LitVolume(volume, grid, 1.0, 0.0, function((0.0, colour, extinction_per_mm)), model)


def in_slab(*depths_mm):
    return np.array([[WIDE, WIDE, depth] for depth in depths_mm])


def ray_into(lit, direction, point_mm):
    """Matrix of a picture of one pixel: the ray through a point of the box, along a unit vector."""
    matrix = np.eye(4)
    matrix[:3, 2] = np.array(direction) * 100.0
    matrix[:3, 3] = point_mm
    return matrix


def assert_holds(mean, variance, paths, expected, largest=1.0):
    assert np.all(np.abs(mean - expected) <= bernstein_interval(variance, paths, largest, CHANCE))


@pytest.fixture
def scan():
    return np.random.default_rng(5).integers(0, 256, (6, 9, 7)).astype(np.uint8)


def scan_in(volume, model, top=0.9, colour=WHITE):
    grid = Grid.of(volume.shape, (1.25, 1.0, 0.8))
    return LitVolume(volume, grid, 2.0, -30.0, function((40.0, colour, 0.0), (300.0, colour, top)), model)


@pytest.mark.parametrize("top", [0.3, 30.0, 1e6], ids=["thin", "dense", "opaque"])
def test_in_a_white_furnace_every_pixel_has_the_brightness_of_its_opacity(scan, top) -> None:
    lit = scan_in(scan, LightModel(kind="scattering"), top)
    matrix = view_of(lit.grid, "anterior-left")
    picture = traced_picture(lit, matrix, (6, 5), 8 if top > 100 else 64)
    assert picture.rgba[..., 3].max() > 0.4
    assert np.abs(picture.rgba[..., :3] - picture.rgba[..., 3:]).max() <= picture.missed + 1e-12
    # Without any loss, a path in an opaque medium may take more steps than are followed; it is counted then.
    assert picture.missed <= (0.25 if top > 100 else 0.0)


def test_occlusion_in_a_slab_is_the_mean_of_exponential_integrals() -> None:
    paths, depths = 20000, np.array([0.3, 1.0, 2.0, 3.7])
    light, variance = traced_places(slab(0.5, LightModel(kind="occlusion")), in_slab(*depths), paths)
    expected = 0.5 * (expn(2, 0.5 * depths) + expn(2, 0.5 * (4.0 - depths)))
    assert_holds(light, variance, paths, expected[:, None])
    assert np.abs(light[:, 0] - expected).max() < 0.015


def test_in_the_middle_of_a_sphere_transmittance_is_exponential() -> None:
    grid = Grid.of((25, 25, 25), (1.0, 1.0, 1.0))
    volume = sampled(distance((12.5, 12.5, 12.5)), grid)
    ball = function((9.5, WHITE, 0.15), (9.5, WHITE, 0.0))
    lit = LitVolume(volume, grid, 1.0, 0.0, ball, LightModel(kind="occlusion"))
    light, variance = traced_places(lit, np.array([[12.5, 12.5, 12.5]]), 20000)
    # Trilinear interpolation moves the sphere by at most 1 / (8 · 9.5) mm.
    assert abs(light[0, 0] - math.exp(-0.15 * 9.5)) < 4 * math.sqrt(variance[0, 0]) + 0.15 / 76


def test_what_is_farther_than_the_radius_takes_no_light_away() -> None:
    lit = slab(0.5, LightModel(kind="occlusion", radius_mm=1.0))
    light, variance = traced_places(lit, in_slab(2.0), 20000)
    assert_holds(light, variance, 20000, math.exp(-0.5))


def test_half_of_the_sky_reaches_an_opaque_half_space() -> None:
    light, variance = traced_places(slab(1e9, LightModel(kind="occlusion")), in_slab(0.0), 20000)
    assert_holds(light, variance, 20000, 0.5)


@pytest.mark.parametrize("albedo", [0.5, 0.9, 0.999])
def test_an_opaque_half_space_that_scatters_has_the_light_of_the_closed_form(albedo) -> None:
    # An isothermal half space with sqrt(1 - albedo) as its source at the surface (Chandrasekhar, "Radiative transfer",
    # 1950) and this one add up to the furnace.
    paths = 500 if albedo > 0.99 else 10000
    lit = slab(1e6, LightModel(kind="scattering"), colour=(albedo,) * 3)
    light, variance = traced_places(lit, in_slab(0.0), paths)
    assert_holds(light, variance, paths, 1.0 / (1.0 + math.sqrt(1.0 - albedo)))


@pytest.mark.parametrize("kind", ["occlusion", "scattering"])
def test_single_scattering_is_that_of_quadrature(kind) -> None:
    # Scattering with an albedo of 0 after the first collision is single scattering.
    black_inside = LightModel(kind=kind)
    lit = slab(0.6, black_inside, colour=(0.8, 0.8, 0.8) if kind == "occlusion" else (0.0, 0.0, 0.0))
    picture = traced_picture(lit, ray_into(lit, (0.0, 0.0, 1.0), (WIDE, WIDE, 2.0)), (1, 1), 20000)
    light, _ = quad(lambda t: 0.6 * math.exp(-0.6 * t) * 0.5 * (expn(2, 0.6 * t) + expn(2, 0.6 * (4 - t))), 0, 4)
    expected = 0.8 * light if kind == "occlusion" else 0.0
    assert_holds(picture.rgba[..., 0], picture.variance[..., 0], 20000, expected)
    assert_holds(picture.rgba[..., 3], picture.variance[..., 3], 20000, 1 - math.exp(-0.6 * 4))


def test_exchanging_light_and_viewer_changes_nothing() -> None:
    ways = [np.array([0.0, 0.6, 0.8]), np.array([0.0, -0.9, math.sqrt(1 - 0.81)])]
    found = []
    for sun, viewer in (ways, ways[::-1]):
        model = LightModel(
            kind="scattering", sky=(0.0,) * 3, ground=(0.0,) * 3, suns=(Sun(direction=tuple(sun), size_degrees=0.0),)
        )
        lit = slab(0.5, model, depth=3, colour=(0.8, 0.8, 0.8))
        picture = traced_picture(lit, ray_into(lit, -viewer, (WIDE, WIDE, 3.0)), (1, 1), 30000)
        found.append((picture.rgba[0, 0, 0] / sun[2], picture.variance[0, 0, 0] / sun[2] ** 2))
    (one, noise), (other, other_noise) = found
    assert abs(one - other) < 4 * math.sqrt(noise + other_noise)
    assert math.sqrt(noise + other_noise) < 0.02 * one


def test_light_from_above_and_light_from_below_make_the_furnace(scan) -> None:
    places = np.random.default_rng(3).uniform(0.5, 5.0, (40, 3))
    black = (0.0, 0.0, 0.0)
    parts = [
        traced_places(scan_in(scan, LightModel(kind="scattering", sky=sky, ground=ground)), places, 400)
        for sky, ground in ((WHITE, black), (black, WHITE))
    ]
    # The same paths, so that what one surrounding does not give the other does, path by path.
    assert np.allclose(parts[0][0] + parts[1][0], 1.0, rtol=0, atol=1e-12)
    assert parts[0][0].std() > 0.01


def test_a_volume_gives_no_more_light_than_it_gets(scan) -> None:
    places = np.random.default_rng(4).uniform(0.5, 5.0, (40, 3))
    grey, bright = (0.5, 0.6, 0.7), (0.9, 0.9, 0.9)
    light = [
        traced_places(scan_in(scan, LightModel(kind=kind, channels="rgb"), colour=colour), places, 400)[0]
        for kind, colour in (("occlusion", grey), ("scattering", grey), ("scattering", bright))
    ]
    assert np.all(light[0].mean(0) < light[1].mean(0))
    assert np.all(light[1].mean(0) < light[2].mean(0))
    assert light[2].max() <= 1.0


def test_a_lamp_lights_what_it_sees_and_leaves_the_rest_ambient() -> None:
    lit = slab(1e9, LightModel(kind="shadow", light_mm=(0.5 * WIDE, 0.5 * WIDE, -50.0), ambient=0.25))
    front, behind = traced_places(lit, in_slab(0.0, 4.0), 8)[0][:, 0]
    assert (front, behind) == (1.0, 0.25)


def test_a_lamp_in_a_cavity_lights_its_walls_and_nothing_outside() -> None:
    volume = np.ones((9, 9, 9), np.uint8)
    volume[3:6, 3:6, 3:6] = 0
    lamp = LightModel(kind="shadow", light_mm=(4.0, 4.0, 4.0), ambient=0.25)
    look = function((0.5, WHITE, 0.0), (0.6, WHITE, 1e6))
    lit = LitVolume(volume, Grid.of(volume.shape, (1.0, 1.0, 1.0)), 1.0, 0.0, look, lamp)
    places = np.array([[4.5, 4.5, 4.5], [5.5, 4.5, 3.5], [4.5, 4.5, 8.9], [0.1, 4.5, 4.5]])
    assert traced_places(lit, places, 8)[0][:, 0].tolist() == [1.0, 1.0, 0.25, 0.25]


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_threads_do_not_show(scan, threads) -> None:
    lit = scan_in(scan, LightModel(kind="scattering", suns=(Sun(direction=(0.0, -1.0, 1.0)),)))
    places = np.ascontiguousarray(np.random.default_rng(4).uniform(0.5, 5.0, (50, 3)))
    light, variance = np.empty_like(places), np.empty_like(places)
    _native.trace_places(
        **lit.native(), places_mm_xyz=places, paths=20, seed=3, light=light, variance=variance, threads=threads
    )
    assert np.array_equal(light, traced_places(lit, places, 20, 3)[0])


class Twin:
    """SplitMix64 and delta tracking through one majorant for each block of cells, written down for one path."""

    MASK = (1 << 64) - 1

    def __init__(self, lit, seed, index):
        self.lit = lit
        self.state = self.mixed(
            self.mixed(seed + 0x9E3779B97F4A7C15) ^ ((index * 0xD1B54A32D192ED03 + 0x8CB92BA72F3D8DD7) & self.MASK)
        )

    def mixed(self, state):
        state &= self.MASK
        state = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & self.MASK
        state = ((state ^ (state >> 27)) * 0x94D049BB133111EB) & self.MASK
        return state ^ (state >> 31)

    def bits(self):
        self.state = (self.state + 0x9E3779B97F4A7C15) & self.MASK
        return self.mixed(self.state) >> 11

    def uniform(self):
        return self.bits() * 2.0**-53

    def depth(self):
        return -math.log((self.bits() + 1) * 2.0**-53)

    def direction(self):
        while True:
            a, b = 2 * self.uniform() - 1, 2 * self.uniform() - 1
            if a * a + b * b < 1:
                factor = 2 * math.sqrt(1 - a * a - b * b)
                return np.array([a * factor, b * factor, 1 - 2 * (a * a + b * b)])

    def extinction(self, index_xyz):
        volume = self.lit.volume.astype(float)
        at = np.clip(index_xyz[::-1], 0, np.array(volume.shape) - 1)
        low = np.minimum(at.astype(int), np.array(volume.shape) - 2)
        share, value = at - low, 0.0
        for corner in np.ndindex(2, 2, 2):
            value += np.prod(np.where(corner, share, 1 - share)) * volume[tuple(low + corner)]
        points = self.lit.transfer_function.points
        physical = self.lit.slope * value + self.lit.intercept
        return np.interp(physical, [p.value for p in points], [p.extinction_per_mm for p in points])

    def majorant(self, block_xyz):
        x, y, z = (slice(4 * b, 4 * b + 5) for b in block_xyz)
        ends = (
            self.lit.slope * np.array([self.lit.volume[z, y, x].min(), self.lit.volume[z, y, x].max()])
            + self.lit.intercept
        )
        points = self.lit.transfer_function.points
        # Extinction rises with the value here.
        slack = 1e-9 * (ends[1] - ends[0]) + 1e-12 * abs(ends).max()
        return np.interp(ends[1] + slack, [p.value for p in points], [p.extinction_per_mm for p in points])

    def stopped(self, start, direction):
        spacing, shape = np.array(self.lit.grid.spacing_mm_zyx[::-1]), np.array(self.lit.volume.shape[::-1])
        blocks = np.maximum(1, -(-(shape - 1) // 4))
        block = np.clip(np.floor(start / 4), 0, blocks - 1).astype(int)
        rate, t, depth = direction / spacing, 0.0, self.depth()
        while True:
            plane = block + (rate > 0)
            ends = np.where(plane == 0, -0.5, np.where(plane == blocks, shape - 0.5, plane * 4.0))
            axis = int(np.argmin((ends - start) / rate))
            end, majorant = ((ends - start) / rate)[axis], self.majorant(block)
            while majorant > 0:
                if t + depth / majorant >= end:
                    depth -= (end - t) * majorant
                    break
                t += depth / majorant
                depth = self.depth()
                if self.uniform() * majorant < self.extinction(start + t * rate):
                    return True
            t = end
            block[axis] += 1 if rate[axis] > 0 else -1
            if not 0 <= block[axis] < blocks[axis]:
                return False


def test_a_slow_twin_with_the_same_random_numbers_gets_the_same_light(scan) -> None:
    lit = scan_in(scan, LightModel(kind="occlusion"))
    places = np.array([[2.0, 3.0, 4.0], [0.3, 8.7, 7.2], [5.1, 0.2, 3.3]])
    light, _ = traced_places(lit, places, 30, seed=11)
    spacing = np.array(lit.grid.spacing_mm_zyx[::-1])
    for index, place in enumerate(places):
        twin, seen = Twin(lit, 11, index), 0
        for _ in range(30):
            seen += not twin.stopped(place / spacing - 0.5, twin.direction())
        assert light[index, 0] == pytest.approx(seen / 30, abs=1e-12)
