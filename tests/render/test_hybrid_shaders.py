"""The volume in a small picture, lines with all pixels, with shaders: opacity comes from alpha (OpenGL ES 2.0, 3.0)."""

import numpy as np
import pytest
from blobs import SHELLS, blobs
from tiny_packages import ES2, ES3, tiny_package

from volprep.parts.mosaic.packing import Packing
from volprep.render.box_lines import box_lines, mark_lines
from volprep.render.hybrid import HybridWish, hybrid_picture
from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.diagnostics import VolprepError

CODES = blobs(5, (30, 34, 28))
EXTENT = np.array(CODES.shape[::-1], np.float64)
HW = (96, 128)
WISHES = {"es3": (ES3, {}), "es2": (ES2, {"packing": Packing(4)}), "slabs": (ES3, {"technique": "slabs"})}


@pytest.fixture(scope="module", params=WISHES.values(), ids=WISHES.keys())
def package(request, tmp_path_factory):
    profile, wishes = request.param
    return tiny_package(tmp_path_factory.mktemp("hybrid") / "p", CODES, SHELLS, profile, **wishes)


def camera(package, view="anterior-left"):
    grid = package.manifest.grid
    return standard_views(grid)[view].box_from_clip(grid, HW[1] / HW[0])


def test_lines_keep_all_pixels_and_the_volume_covers_those_behind_it_by_its_alpha(package):
    with Renderer(package) as renderer:
        whole = renderer.render(camera(package), HW)
        lines = [box_lines(camera(package), EXTENT)]
        alone = hybrid_picture(renderer, HybridWish((24, 32), lines=False), camera(package), HW)
        plain = renderer.render_with_lines(camera(package), HW, HW, lines)
        both = hybrid_picture(renderer, HybridWish((24, 32)), camera(package), HW)
    line = (np.abs(plain - whole) > 1.5 / 255).any(axis=-1)
    # One pixel wide: in the small picture they would cover four times as much.
    assert 200 < line.sum() < 1000
    np.testing.assert_allclose(both[~line], alone[~line], atol=1.01 / 255)
    behind = line & (whole[..., 3] > 0.3) & (plain[..., :3].min(axis=-1) < 0.99)
    assert behind.sum() > 10
    np.testing.assert_allclose(plain[behind][:, :3], whole[behind][:, :3] + (1 - whole[behind][:, 3:]), atol=1.01 / 255)
    before = line & (plain[..., :3].min(axis=-1) > 0.99) & (whole[..., 3] > 0.3)
    assert before.sum() > 10


def test_what_is_drawn_small_is_off_by_more_the_smaller_it_is_and_as_large_as_the_picture_by_nothing(package):
    grid = package.manifest.grid
    function = package.manifest.transfer_functions[0]
    truth = oracle_picture(Volume(CODES, grid), function, camera(package), HW).rgba
    with Renderer(package) as renderer:
        whole = renderer.render(camera(package), HW, 0.125)
        pictures = [
            hybrid_picture(
                renderer, HybridWish((HW[0] // part, HW[1] // part), lines=False), camera(package), HW, 0.125
            )
            for part in (1, 2, 4, 8)
        ]
    np.testing.assert_allclose(pictures[0], whole, atol=0.51 / 255)
    errors = [float(np.sqrt(np.mean((picture - truth) ** 2))) for picture in pictures]
    assert errors == sorted(errors)
    assert errors[0] < 0.004
    assert 2 * errors[0] < errors[2] < 0.08


def test_a_part_of_the_volume_is_marked_where_it_lies(package):
    low, high = np.array([4.0, 5.0, 6.0]), np.array([20.0, 21.0, 25.0])
    mark = mark_lines(camera(package), low, high, (1.0, 0.25, 0.0))
    ends = np.concatenate([mark.behind, mark.before])
    assert len(ends) == 24
    np.testing.assert_array_equal(ends.min(axis=0), low)
    np.testing.assert_array_equal(ends.max(axis=0), high)
    with Renderer(package) as renderer:
        picture = renderer.render_with_lines(camera(package), HW, HW, [mark])
        plain = renderer.render(camera(package), HW)
    clip = np.concatenate([mark.before, np.ones((len(mark.before), 1))], axis=1) @ np.linalg.inv(camera(package)).T
    x, y = ((clip[:, 0] + 1) / 2 * HW[1]), ((1 - clip[:, 1]) / 2 * HW[0])
    marked = np.argwhere((np.abs(picture - plain) > 2 / 255).any(axis=-1))
    np.testing.assert_allclose(
        [marked.min(axis=0), marked.max(axis=0)], [[y.min(), x.min()], [y.max(), x.max()]], atol=1.5
    )


def test_an_estimate_of_opacity_is_refused_where_the_picture_has_alpha(package):
    with Renderer(package) as renderer, pytest.raises(VolprepError, match="VP5050"):
        hybrid_picture(renderer, HybridWish(opacity="luminance-average"), camera(package), HW)


def test_a_small_picture_of_no_pixel_is_refused(package):
    with Renderer(package) as renderer, pytest.raises(VolprepError, match="VP5009"):
        hybrid_picture(renderer, HybridWish((0, 4)), camera(package), HW)


def test_many_hybrid_pictures_leave_nothing_behind(package):
    with Renderer(package) as renderer:
        hybrid_picture(renderer, HybridWish((4, 4)), camera(package), (8, 8))
        first = +renderer._gl.live
        for _ in range(200):
            hybrid_picture(renderer, HybridWish((4, 4)), camera(package), (8, 8))
        assert +renderer._gl.live == first
