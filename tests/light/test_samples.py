"""Estimates of light at seen places: rays that end in a known field, and places that light others."""

import numpy as np
import pytest
from tiny_packages import function

from volprep.kernels import _native
from volprep.truth.path_traced import LitVolume
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel

GREY = (0.6, 0.6, 0.6)
CURVE = np.array([[0.0, 255.0], [0.0, 1.0]])
COUNT = 4000


@pytest.fixture(scope="module")
def cube():
    """A cube of one density, 8 × 8 × 8 mm, under a white sky."""
    volume = np.full((8, 8, 8), 200, np.uint8)
    look = function((100.0, GREY, 0.3))
    return LitVolume(volume, Grid.of(volume.shape, (1.0, 1.0, 1.0)), 1.0, 0.0, look, LightModel(kind="scattering"))


def sampled(lit, known=None, paths=8, **wishes):
    places, light = np.empty((COUNT, 4), np.float32), np.empty((COUNT, 3), np.float32)
    kinds = np.empty(COUNT, np.uint8)
    if known is not None:
        texels = np.zeros((1, 1, 1, 2, 1), np.float32)
        texels[..., 0, :] = known
        wishes |= {"known": texels, "known_curve": CURVE, "known_per_mm_xyz": (1.0, 1.0, 1.0)}
    buffers = {"places": places, "light": light, "kinds": kinds}
    _native.light_samples(**lit.native(), seed=3, first=0, paths=paths, inner_each=0, **buffers, **wishes)
    found = kinds == 1
    assert found.mean() > 0.8
    return places[found], light[found, 0].astype(float)


def test_a_ray_that_is_stopped_brings_the_known_light_times_the_albedo(cube) -> None:
    _, open_sky = sampled(cube, known=0.0)
    _, lit = sampled(cube, known=0.5)
    assert lit == pytest.approx(open_sky + 0.6 * 0.5 * (1.0 - open_sky), abs=1e-6)
    assert 0.1 < open_sky.mean() < 0.9


def test_rays_into_all_octants_have_the_mean_of_paths_and_less_noise(cube) -> None:
    occluded = LitVolume(
        cube.volume, cube.grid, 1.0, 0.0, cube.transfer_function, cube.model.model_copy(update={"kind": "occlusion"})
    )
    _, rays = sampled(occluded, known=0.0)
    _, paths = sampled(occluded, paths=8)
    error = np.hypot(rays.std(), paths.std()) / np.sqrt(COUNT)
    assert abs(rays.mean() - paths.mean()) < 4.5 * error
    assert rays.std() < 0.95 * paths.std()


@pytest.mark.parametrize("bounces", [1, 2, 3])
def test_paths_end_at_the_known_light_after_so_many_bounces(cube, bounces) -> None:
    _, dark = sampled(cube, known=0.0, bounces=bounces)
    _, lit = sampled(cube, known=1.0, bounces=bounces)
    ends = (lit - dark) / 0.6**bounces * 8
    assert ends == pytest.approx(np.rint(ends), abs=1e-4)
    # Each bounce lets some of the paths out.
    assert 0.1 < ends.mean() / 8 < 0.75**bounces


def test_more_bounces_leave_less_of_an_error_of_the_known_light(cube) -> None:
    bright = LitVolume(cube.volume, cube.grid, 1.0, 0.0, function((100.0, (1.0, 1.0, 1.0), 0.3)), cube.model)
    # Without any loss there is as much light as the sky has, everywhere.
    off = [abs(sampled(bright, known=0.5, bounces=bounces)[1].mean() - 1.0) for bounces in (1, 4, 16)]
    assert off[1] < 0.6 * off[0]
    assert off[2] < 0.3 * off[1]
    assert sampled(bright, known=1.0, bounces=16)[1] == pytest.approx(1.0, abs=1e-6)


def test_threads_do_not_show_in_samples(cube) -> None:
    one, other = (sampled(cube, known=0.5, bounces=3, threads=threads) for threads in (1, 3))
    assert [part.tobytes() for part in one] == [part.tobytes() for part in other]


def depths_mm(places):
    return np.minimum(places[:, :3], 8.0 - places[:, :3]).min(axis=1)


def test_places_that_light_others_lie_deeper_than_those(cube) -> None:
    seen, _ = sampled(cube, paths=1)
    lighting, _ = sampled(cube, paths=1, lighting=True)
    assert depths_mm(lighting).mean() > 1.1 * depths_mm(seen).mean()


@pytest.mark.parametrize("most", [1e3, 1e6, 1e9])
def test_light_stops_behind_air_where_a_steep_wall_stops_it(most) -> None:
    # Extinction rises from 0 over one voxel. A wide slab: light comes through two faces only.
    volume = np.full((8, 2, 2), 200, np.uint8)
    volume[:2] = 0
    grid = Grid.of(volume.shape, (1.0, 1e6, 1e6))
    look = function((0.0, GREY, 0.0), (200.0, GREY, most))
    lit = LitVolume(volume, grid, 1.0, 0.0, look, LightModel(kind="scattering"))
    places, _ = sampled(lit, known=0.0)
    depths = places[places[:, 2] < 4.0, 3] / 200.0
    # A ray with the cosine m is stopped at sqrt(pi m / 2 most), and rays have the density 2 m.
    error = depths.std() / np.sqrt(len(depths))
    assert len(depths) > 1000
    assert abs(depths.mean() - 0.8 * np.sqrt(np.pi / (2.0 * most))) < 4.5 * error
