"""Pictures that get finished part by part: the samples are those of one draw, in whatever order pixels come."""

from itertools import count, pairwise

import numpy as np
import pytest
from blobs import SHELLS, blobs
from scene_builds import view_of
from tiny_packages import ES2, ES3, tiny_package

from volprep.render.progressive import REFINEMENTS, frames, low_resolution, pixel_order, tile_order
from volprep.render.proxy_renderer import ProxyRenderer
from volprep.render.renderer import Renderer
from volprep.render.renderers import ray_caster_of
from volprep.scene.scene import ProxySettings
from volprep_formats.diagnostics import VolprepError

HW = (45, 61)
STEP_MM = 0.19
CODES = blobs(5, (30, 34, 28))
WISHES = {
    "plain": {},
    "skipping": {"skip": ("distance", 4), "cutoff": 0.99},
    "at a mesh": {"proxy": ProxySettings(block=4)},
}


def package_of(folder, technique="tiles", profile=ES3, **wishes):
    return tiny_package(folder, CODES, SHELLS, profile, technique=technique, **wishes)


def camera(package, view="anterior-left"):
    grid = package.manifest.grid
    return view_of(grid, view)


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("wishes", WISHES.values(), ids=WISHES.keys())
@pytest.mark.parametrize("order", ["classic", "tiles", "random", "structured"])
def test_all_parts_together_are_the_picture_bit_by_bit(tmp_path, order, wishes):
    package = package_of(tmp_path / "p", **wishes)
    matrix = camera(package)
    with ray_caster_of(package, 0, None)(package, target="rgba32f") as renderer:
        whole = renderer.render(matrix, HW, STEP_MM)
        assert whole[..., 3].max() > 0.9
        low = low_resolution(renderer, matrix, HW, STEP_MM)
        shown = [*frames(renderer, order, matrix, HW, STEP_MM, budget_s=0.0)]
    assert np.array_equal(shown[-1].picture, whole)
    assert shown[-1].finished == 1.0
    assert all(one.finished < next_.finished for one, next_ in pairwise(shown))
    for frame in shown:
        finished = (frame.picture == whole).all(axis=-1)
        assert np.array_equal(frame.picture[~finished], low[~finished])


def test_slabs_together_are_the_picture_too(tmp_path):
    with Renderer(package_of(tmp_path / "p", "ray-casting"), target="rgba32f") as renderer:
        whole = renderer.render(camera(renderer._package), HW, STEP_MM)
    with Renderer(package_of(tmp_path / "s", "slabs"), target="rgba32f") as renderer:
        *_, last = frames(renderer, "slabs", camera(renderer._package), HW, STEP_MM)
    assert np.abs(last.picture - whole).max() < 1e-5


def test_tiles_beside_the_mesh_cost_nothing(tmp_path):
    codes = np.zeros((30, 34, 28), np.uint8)
    codes[12:16, 14:18, 10:14] = 255
    package = tiny_package(tmp_path / "p", codes, SHELLS, technique="tiles", proxy=ProxySettings(block=4))
    matrix = camera(package)
    with ProxyRenderer(package) as renderer:
        if renderer.driver.version_number < (3, 1):
            pytest.skip("no compute shaders")
        seen = renderer.render(matrix, HW, STEP_MM)[::-1, :, 3] > 0
        found, costs = renderer.sorted_tiles(matrix, HW, STEP_MM)
    columns = -(-HW[1] // 8)
    shown = {int(row) * columns + int(column) for row, column in np.argwhere(seen) // 8}
    # A tile's cost is that of its middle: a few at the rim of what is seen may cost nothing.
    dearest = set(found[-len(shown) :].tolist())
    assert costs[0] == 0
    assert len(shown & dearest) > 0.6 * len(shown)
    assert 0 < len(shown) < len(found) / 2


@pytest.mark.parametrize("view", ["anterior-left", "posterior-left"])
def test_tiles_come_in_the_order_of_what_they_cost_each_once(tmp_path, view):
    """Without a table and an early end a ray takes as many samples as the box is long along it."""
    package = package_of(tmp_path / "p")
    matrix = camera(package, view)
    with Renderer(package) as renderer:
        if renderer.driver.version_number < (3, 1):
            pytest.skip("no compute shaders")
        found, costs = renderer.sorted_tiles(matrix, HW, STEP_MM)
    columns, rows = -(-HW[1] // 8), -(-HW[0] // 8)
    assert sorted(found) == [*range(columns * rows)]
    row, column = np.divmod(found, columns)
    pixels = np.minimum(np.stack([column, row], axis=-1) * 8 + 4, [HW[1] - 1, HW[0] - 1])
    ndc = (2 * pixels + 1) / [HW[1], HW[0]] - 1
    ends = [np.column_stack([ndc, np.full((len(ndc), 2), (depth, 1.0))]) @ matrix.T for depth in (-1.0, 1.0)]
    near, far = (end[:, :3] / end[:, 3:] for end in ends)
    extent = np.array(package.manifest.grid.extent_mm_zyx[::-1])
    sides = np.stack([(0 - near) / (far - near), (extent - near) / (far - near)])
    length = np.maximum(sides.max(axis=0).min(axis=1) - sides.min(axis=0).max(axis=1), 0)
    length *= np.linalg.norm(far - near, axis=1)
    # There are 256 groups of costs.
    assert (np.diff(length) > -np.linalg.norm(extent) / 255 - STEP_MM).all()
    assert (np.diff(costs.astype(int)) >= 0).all()
    assert length[0] == 0.0
    assert length[-1] > 20.0


def test_a_frame_takes_no_longer_than_its_time_but_one_part(tmp_path):
    package = package_of(tmp_path / "p")
    with Renderer(package) as renderer:
        tiles = tile_order(renderer, camera(package), HW, STEP_MM).until
        assert len([*frames(renderer, "tiles", camera(package), HW, STEP_MM, budget_s=0.0)]) == 1 + len(tiles)
        assert len([*frames(renderer, "tiles", camera(package), HW, STEP_MM, budget_s=60.0)]) == 2
        assert len([*frames(renderer, "random", camera(package), HW, STEP_MM, budget_s=0.0)]) == 1 + REFINEMENTS


@pytest.mark.parametrize("order", ["random", "structured"])
def test_each_refinement_is_spread_over_the_picture(order):
    share = pixel_order(order, (64, 64))
    for number in range(REFINEMENTS):
        of_part = share == number / REFINEMENTS
        assert 150 < of_part.sum() < 370
        quarters = of_part.reshape(2, 32, 2, 32).sum(axis=(1, 3))
        assert quarters.min() > 30


@pytest.mark.parametrize(
    ("technique", "profile", "order"),
    [
        ("view-slices", ES3, "random"),
        ("two-pass", ES3, "structured"),
        ("ray-casting", ES3, "tiles"),
        ("ray-casting", ES3, "slabs"),
        ("slabs", ES2, "tiles"),
    ],
)
def test_an_order_that_a_program_does_not_have_is_refused(tmp_path, technique, profile, order):
    package = package_of(tmp_path / "p", technique, profile)
    with Renderer(package) as renderer, pytest.raises(VolprepError, match="VP5041"):
        list(frames(renderer, order, camera(package), HW, STEP_MM))


@pytest.mark.parametrize("shape_hw", [(1, 1), (1, 8192), (3, 17)])
def test_pictures_of_any_size_are_finished(tmp_path, shape_hw):
    package = package_of(tmp_path / "p")
    with Renderer(package) as renderer:
        whole = renderer.render(camera(package), shape_hw, 2.0)
        *_, last = frames(renderer, "tiles", camera(package), shape_hw, 2.0, budget_s=60.0)
        assert np.array_equal(last.picture, whole)
        with pytest.raises(VolprepError, match="VP5009"):
            list(frames(renderer, "tiles", camera(package), (0, 4), 2.0))


def test_the_time_of_a_frame_is_that_of_the_clock_that_was_given(tmp_path):
    package = package_of(tmp_path / "p")
    looks = count()
    with Renderer(package) as renderer:
        shown = [
            *frames(renderer, "random", camera(package), HW, STEP_MM, budget_s=2.5, clock=lambda: float(next(looks)))
        ]
    # The clock moves on by a second whenever it is looked at: after each of 16 parts.
    assert [frame.ms for frame in shown] == [1000.0, *[3000.0] * 5, 1000.0]
