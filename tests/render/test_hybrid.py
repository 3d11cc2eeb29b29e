"""The volume in a small picture, lines with all pixels, and where the opacity comes from (OpenGL ES 1.1)."""

import numpy as np
import pytest
from scene_builds import view_of
from slice_packages import missing_es11, slice_package

from volprep.render.box_lines import box_lines
from volprep.render.hybrid import small_picture
from volprep.render.slices import SliceRenderer

pytestmark = pytest.mark.skipif(missing_es11() is not None, reason=f"no OpenGL ES 1.1: {missing_es11()}")

SIZE = (64, 64)
WHITE = (
    "{ value = 0.0, colour = [1.0, 1.0, 1.0], extinction_per_mm = 0.0 }, "
    "{ value = 255.0, colour = [1.0, 1.0, 1.0], extinction_per_mm = 0.3 }"
)
DARK = WHITE.replace("[1.0, 1.0, 1.0]", "[0.1, 0.02, 0.4]")


def package_of(folder, **wishes):
    z, y, x = np.meshgrid(*(np.linspace(-1.5, 1.5, n) for n in (12, 14, 16)), indexing="ij")
    return slice_package(folder, 230 * np.exp(-(x**2) - y**2 - z**2), **wishes)


def camera(package, view="anterior-left"):
    grid = package.manifest.levels[0].grid
    return view_of(grid, view)


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return package_of(tmp_path_factory.mktemp("ball"))


def opacities(package, *sources):
    with SliceRenderer(package) as renderer:
        return [small_picture(renderer, camera(package), SIZE, source)[..., 3] for source in sources]


@pytest.mark.parametrize("source", ["black-and-white", "white-volume"])
def test_opacity_without_alpha_is_that_of_the_alpha_channel(package, source):
    alpha, found = opacities(package, "alpha", source)
    assert alpha.max() > 0.5
    # Each of the slices that are blended rounds both.
    assert np.abs(found - alpha).max() <= 16 / 255
    assert np.sqrt(np.mean((found - alpha) ** 2)) < 2 / 255


@pytest.mark.parametrize("source", ["luminance-average", "luminance-perceived"])
def test_luminance_is_the_opacity_of_what_is_white_and_less_for_what_is_dark(tmp_path, source):
    alpha, found = opacities(package_of(tmp_path, points=WHITE), "alpha", source)
    assert np.abs(found - alpha).max() <= 16 / 255
    dark = package_of(tmp_path, points=DARK)
    alpha, found = opacities(dark, "alpha", source)
    colour = dark.manifest.transfer_functions[0].points[0].colour
    weights = {"luminance-average": (1 / 3,) * 3, "luminance-perceived": (0.3, 0.59, 0.11)}[source]
    seen = alpha > 0.3
    np.testing.assert_allclose(found[seen] / alpha[seen], np.dot(colour, weights), atol=0.02)


def test_edges_that_no_front_face_has_are_behind_the_volume(package):
    extent = np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1])
    lines = box_lines(camera(package), extent)
    # A corner is hidden, with three edges; three axes go through the volume.
    assert (len(lines.behind) // 2, len(lines.before) // 2) == (3 + 3, 9)
    lines = box_lines(camera(package, "superior"), extent)
    assert (len(lines.behind) // 2, len(lines.before) // 2) == (8 + 3, 4)


def test_lines_keep_all_pixels_and_are_attenuated_behind_the_volume(package):
    box_from_clip = camera(package)
    extent = np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1])
    lines = box_lines(box_from_clip, extent)
    with SliceRenderer(package) as renderer:
        small = small_picture(renderer, box_from_clip, (32, 32), "white-volume")
        plain = renderer.render_with_lines(box_from_clip, (128, 128), np.zeros((32, 32, 4), np.float32), [lines])
        both = renderer.render_with_lines(box_from_clip, (128, 128), small, [lines])
        large = renderer.render(box_from_clip, (128, 128))
    on_line = plain[..., :3].min(axis=-1) > 0.9
    # Lines are one pixel wide: with a quarter of the pixels they would cover four times as much.
    assert 200 < on_line.sum() < 1500
    between = ~on_line
    assert np.sqrt(np.mean((both - large)[between][:, :3] ** 2)) < 0.02
    attenuated = on_line & (both[..., :3].min(axis=-1) < 0.8) & (large[..., 3] > 0.3)
    assert attenuated.any()
    expected = large[..., :3] + (1 - large[..., 3:])
    assert np.abs(both[..., :3] - expected)[attenuated].max() < 0.1


def test_a_small_picture_of_any_size_fills_the_large_one(package):
    with SliceRenderer(package) as renderer:
        for shape in ((1, 1), (3, 7), (33, 64)):
            small = np.full((*shape, 4), 0.5, np.float32)
            lines = box_lines(camera(package), np.zeros(3))
            picture = renderer.render_with_lines(camera(package), (20, 30), small, [lines])
            assert np.abs(picture[..., :3][:5] - 0.5).max() < 0.01


def test_200_hybrid_pictures_leave_nothing_behind(package):
    lines = box_lines(camera(package), np.array(package.manifest.levels[0].grid.extent_mm_zyx[::-1]))
    with SliceRenderer(package) as renderer:
        small = small_picture(renderer, camera(package), (4, 4), "black-and-white")
        renderer.render_with_lines(camera(package), (8, 8), small, [lines])
        first = +renderer._gl.live
        for _ in range(200):
            renderer.render_with_lines(camera(package), (8, 8), small, [lines])
        assert +renderer._gl.live == first
