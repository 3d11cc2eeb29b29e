"""The field of light: sums and solution against slow twins, and what a field must hold whatever the volume is."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from tiny_packages import function
from traced_places import traced_places

from volprep.kernels import _native
from volprep.parts.light import solve
from volprep.parts.light.solve import LightField, solve_field
from volprep.truth.path_traced import LitVolume
from volprep_formats.grid import Grid
from volprep_formats.package.parts.light.model import LightModel
from volprep_formats.progress import Silent

WHITE = (1.0, 1.0, 1.0)
SHAPE = (3, 4, 5)
PER_MM = (0.5, 0.25, 0.4)
CURVE = np.array([[10.0, 30.0], [0.0, 1.0]])


@pytest.fixture(scope="module")
def samples():
    rng = np.random.default_rng(8)
    box_mm = np.array(SHAPE[::-1]) / PER_MM
    places = np.column_stack([rng.uniform(0, 1, (400, 3)) * box_mm, rng.uniform(0, 40, 400)]).astype(np.float32)
    light = rng.uniform(0, 1, (400, 3)).astype(np.float32)
    weights = rng.choice([0.0, 0.05, 1.0], 400).astype(np.float32)
    return places, light, weights


def design(places, weights):
    """Rows of the least-squares problem, [sample, node, (first, second)], with weights as square roots."""
    rows = np.zeros((len(places), np.prod(SHAPE), 2))
    for row, (*place, value) in zip(rows, places.astype(float), strict=True):
        share = np.interp(value, *CURVE)
        at = np.clip(np.array(place) * PER_MM, 0, np.array(SHAPE[::-1]) - 1)
        for z, y, x in np.ndindex(SHAPE):
            near = np.prod(np.maximum(1 - np.abs(at - [x, y, z]), 0))
            row[(z * SHAPE[1] + y) * SHAPE[2] + x] = near, near * share
    return rows * np.sqrt(weights)[:, None, None]


def summed(samples, threads=1):
    rows = np.arange(np.prod(SHAPE), dtype=np.int32).reshape(SHAPE)
    pairs, sums = np.zeros((rows.size, 14, 3), np.float32), np.zeros((rows.size, 2, 3), np.float32)
    _native.add_light_samples(rows, PER_MM, *samples, CURVE, pairs, sums, threads)
    return rows, pairs, sums


def test_sums_are_those_of_the_products_of_weights(samples) -> None:
    rows, pairs, sums = summed(samples)
    table = design(samples[0], samples[2])
    assert sums[..., 1] == pytest.approx(
        np.einsum("snk,s->nk", table, samples[1][:, 1] * np.sqrt(samples[2])), abs=1e-4
    )
    for node in (0, 17, 33):
        z, y, x = np.argwhere(rows == node)[0]
        for pair in range(14):
            dz, dy, dx = np.array([(pair + 13) // 9, (pair + 13) // 3 % 3, (pair + 13) % 3]) - 1
            other = (z + dz, y + dy, x + dx)
            inside = all(0 <= at < n for at, n in zip(other, SHAPE, strict=True))
            products = table[:, node] * 0 if not inside else np.zeros(0)
            expected = (0.0, 0.0, 0.0)
            if inside:
                products = np.einsum("sk,sl->kl", table[:, node], table[:, rows[other]])
                expected = products[0, 0], products[0, 1], products[1, 1]
            assert pairs[node, pair] == pytest.approx(expected, abs=1e-4)


def test_the_solution_is_that_of_a_dense_solver(samples) -> None:
    rows, pairs, sums = summed(samples)
    table = design(samples[0], samples[2]).reshape(len(samples[0]), -1)
    matrix = table.T @ table + 1e-6 * np.eye(table.shape[1])
    for node in range(rows.size):
        z, y, x = np.argwhere(rows == node)[0]
        matrix[2 * node + 1, 2 * node + 1] += 0.3
        for other in ((z + 1, y, x), (z, y + 1, x), (z, y, x + 1)):
            if all(at < n for at, n in zip(other, SHAPE, strict=True)):
                for part, weight in enumerate((2.0, 0.7)):
                    i, j = 2 * node + part, 2 * rows[other] + part
                    matrix[[i, j, i, j], [i, j, j, i]] += weight * np.array([1, 1, -1, -1])
    expected = np.linalg.solve(matrix, table.T @ (samples[1][:, 2] * np.sqrt(samples[2])))
    field = np.zeros((rows.size, 2))
    left = _native.solve_light(rows, pairs, sums, 2, 2.0, 0.7, 0.3, 1e-9, 500, field, 2)
    assert left <= 1e-9
    assert field.ravel() == pytest.approx(expected, abs=1e-4)


def test_a_second_round_takes_back_what_smoothing_has_changed(samples) -> None:
    rows, pairs, sums = summed((samples[0], np.repeat(samples[0][:, :1] / 10, 3, axis=1), samples[2]))
    table = design(samples[0], samples[2]).reshape(len(samples[0]), -1)
    wanted = samples[0][:, 0] / 10 * np.sqrt(samples[2])
    field, off = np.zeros((rows.size, 2)), []
    for _ in range(2):
        _native.solve_light(rows, pairs, sums, 0, 20.0, 20.0, 2.0, 1e-8, 500, field)
        off.append(np.linalg.norm(table @ field.ravel() - wanted))
    assert off[1] < 0.8 * off[0]


def test_threads_do_not_show_in_sums_and_solution(samples) -> None:
    found = []
    for threads in (1, 3):
        rows, pairs, sums = summed(samples, threads)
        field = np.zeros((rows.size, 2))
        _native.solve_light(rows, pairs, sums, 0, 1.0, 1.0, 0.1, 1e-5, 100, field, threads)
        found.append((pairs.tobytes(), sums.tobytes(), field.tobytes()))
    assert found[0] == found[1]


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(solve, "BATCH", 1 << 14)
    monkeypatch.setattr(solve, "_SMOOTH", (1.0, 8.0))


def ball(kind, top=0.4, colour=WHITE, **model):
    """A bright ball with a soft border, 13 × 11 × 12 voxels of 1.25 × 1 × 0.8 mm."""
    z, y, x = np.mgrid[:13, :11, :12]
    radius = np.sqrt(((z - 6) * 1.25) ** 2 + (y - 5.0) ** 2 + ((x - 5.5) * 0.8) ** 2)
    volume = np.clip(255 - 40 * radius, 0, 255).astype(np.uint8)
    grid = Grid.of(volume.shape, (1.25, 1.0, 0.8))
    look = function((60.0, colour, 0.0), (120.0, colour, top))
    return LitVolume(volume, grid, 1.0, 0.0, look, LightModel(kind=kind, **model))


def test_in_a_white_furnace_the_field_is_the_sky(few) -> None:
    lit = ball("scattering")
    field = solve_field(lit, 2, 1, Silent())
    # Where the ball is seen; what lies around it is not fitted to anything.
    places, values = np.array([[4.4, 5.5, 4.0], [4.8, 5.0, 8.0], [2.5, 5.0, 8.0]]), np.array([100.0, 250.0, 150.0])
    assert field.at(places, values) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("kind", ["occlusion", "scattering"])
def test_the_field_comes_near_to_what_paths_bring(few, kind) -> None:
    lit = ball(kind, top=0.8, colour=(0.8, 0.8, 0.8))
    field = solve_field(lit, 2, 1 << 16, Silent())
    rng = np.random.default_rng(1)
    places = np.array([4.8, 5.5, 8.1]) + rng.uniform(-4.0, 4.0, (60, 3))
    index = places[:, ::-1] / lit.grid.spacing_mm_zyx - 0.5
    values = map_coordinates(lit.volume.astype(float), index.T, order=1, mode="nearest")
    places, values = places[values > 70], values[values > 70]
    light, _ = traced_places(lit, places, 1000)
    off = field.at(places, values)[:, 0] - light[:, 0]
    assert np.sqrt(np.mean(off**2)) < 0.06
    assert light[:, 0].std() > 0.06


@pytest.mark.parametrize("shape", [(1, 1, 2), (2, 1, 1), (1, 1, 1)])
def test_volumes_of_two_voxels_have_the_light_of_the_furnace(few, shape) -> None:
    look = function((0.0, WHITE, 3.0))
    grid = Grid.of(shape, (1.0, 1.0, 1.0))
    lit = LitVolume(np.ones(shape, np.uint8), grid, 1.0, 0.0, look, LightModel(kind="scattering"))
    field = solve_field(lit, 2, 1, Silent())
    assert field.texels.shape == (1, 1, 1, 2, 1)
    assert field.at(np.array([[0.5, 0.5, 0.5]]), np.array([1.0])) == pytest.approx(1.0, abs=0.02)


def slit():
    """A block of one density with a slit through it along x, one voxel wide."""
    volume = np.full((8, 9, 8), 200, np.uint8)
    volume[:6, 4, :] = 0
    look = function((90.0, (0.5, 0.5, 0.5), 0.0), (110.0, (0.5, 0.5, 0.5), 8.0))
    return LitVolume(volume, Grid.of(volume.shape, (1.0, 1.0, 1.0)), 1.0, 0.0, look, LightModel(kind="scattering"))


def test_a_slit_is_as_dark_at_each_depth_as_paths_find_it(few) -> None:
    lit = slit()
    field = solve_field(lit, 1, 1 << 16, Silent())
    count = 8000
    places, light, kinds = np.empty((count, 4), np.float32), np.empty((count, 3), np.float32), np.empty(count, np.uint8)
    buffers = {"places": places, "light": light, "kinds": kinds}
    _native.light_samples(**lit.native(), seed=5, first=0, paths=8, inner_each=0, **buffers)
    found = field.at(places[:, :3].astype(float), places[:, 3].astype(float))[:, 0]
    walls = (kinds == 1) & (np.abs(places[:, 1] - 4.5) < 1.0)
    means = []
    for top_mm, bottom_mm in ((0.3, 2.0), (2.0, 6.0)):
        here = walls & (places[:, 2] > top_mm) & (places[:, 2] < bottom_mm)
        assert here.sum() > 100
        means.append(light[here, 0].mean())
        assert found[here].mean() == pytest.approx(means[-1], abs=0.05)
    assert max(means) < 0.8 * light[(kinds == 1) & (np.abs(places[:, 1] - 4.5) > 2.0), 0].mean()


def test_a_finer_grid_begins_with_the_field_of_the_coarser_one() -> None:
    coarse = solve._NodeGrid((3, 2, 1), (2.0, 1.0, 0.0))
    z, y, _ = np.meshgrid(*(np.linspace(0.0, 4.0, n) for n in coarse.shape_zyx), indexing="ij")
    texels = np.repeat((3.0 * z - y).astype(np.float32)[..., None, None], 2, axis=3)
    finer = solve._NodeGrid((5, 4, 1), (0.0, 0.75, 1.0)).finer(texels)
    z, y, _ = np.meshgrid(*(np.linspace(0.0, 4.0, n) for n in (5, 4, 1)), indexing="ij")
    assert finer.shape == (5, 4, 1, 2, 1)
    assert finer[..., 0, 0] == pytest.approx(3.0 * z - y)
    assert finer[..., 1, :].tobytes() == finer[..., 0, :].tobytes()


def cut_block():
    """A block of one density that fills its box: the value says nothing of the depth below a face."""
    volume = np.full((12, 12, 12), 200, np.uint8)
    look = function((90.0, (0.5, 0.5, 0.5), 4.0))
    return LitVolume(volume, Grid.of(volume.shape, (1.0, 1.0, 1.0)), 1.0, 0.0, look, LightModel(kind="scattering"))


def test_light_falls_below_a_face_that_cuts_a_body(few) -> None:
    lit = cut_block()
    field = solve_field(lit, 2, 1 << 14, Silent())
    depths = np.array([0.02, 0.4])
    places = np.column_stack([np.full(2, 6.0), np.full(2, 6.0), depths])
    light = field.at(places, np.full(2, 200.0))[:, 0]
    true = traced_places(lit, places, 4000)[0][:, 0]
    assert light[0] > light[1] + 0.1
    assert light.mean() == pytest.approx(true.mean(), abs=0.05)


def test_smoothing_changes_only_what_differs_from_the_start(samples) -> None:
    grid = solve._NodeGrid(SHAPE, PER_MM)
    rows, pairs, sums = summed(samples)
    equations = solve._Sums(grid, CURVE, solve._Samples(*samples, samples[2]))
    equations._rows, equations._pairs, equations._light = rows, pairs, sums
    start = np.random.default_rng(3).uniform(0, 1, (*SHAPE, 2, 1)).astype(np.float32)
    change = equations.solved(1e7, start, 1e-4)[0] - start
    assert np.ptp(change, axis=(0, 1, 2)).max() < 1e-3
    assert np.ptp(equations.solved(1e7, grid.dark(1), 1e-4)[0], axis=(0, 1, 2)).max() < 1e-3
    assert np.abs(change).max() > 0.01


def test_the_field_does_not_depend_on_what_was_computed_before(few) -> None:
    one, other = (solve_field(ball("occlusion"), 3, 1, Silent()) for _ in range(2))
    assert one.texels.tobytes() == other.texels.tobytes()
    assert one.texels.shape == (5, 4, 4, 2, 1)


def test_a_volume_that_shows_nothing_has_a_dark_field(few) -> None:
    field = solve_field(ball("occlusion", top=0.0), 2, 1, Silent())
    assert field.samples == 0
    assert not field.texels.any()


def test_values_between_nodes_are_mixed_and_not_negative() -> None:
    texels = np.zeros((1, 1, 2, 2, 1), np.float32)
    texels[0, 0, :, 0, 0] = 0.2, 0.6
    texels[0, 0, :, 1, 0] = 0.4, -2.0
    field = LightField(texels, CURVE, (1.0, 1.0, 1.0), 0, 0.0, 0.0)
    places = np.array([[0.0, 0.5, 0.5], [0.5, 0.5, 0.5], [1.0, 0.5, 0.5]])
    assert field.at(places, np.array([0.0, 10.0, 20.0]))[:, 0] == pytest.approx([0.2, 0.4, 0.0], abs=1e-6)
