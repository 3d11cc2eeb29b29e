"""The program of sub-volumes draws what the whole level holds there: no seam, no gap, no voxel twice."""

from itertools import product

import numpy as np
import pytest
import scene_builds
from phantom_scene import write_phantom_scene

from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package

SHAPE_HW = (48, 56)
ASPECT = 56 / 48


def built(folder, size: int, bits: int = 8, profile: str = "gles3", order: str = "auto") -> Package:
    scene = write_phantom_scene(folder, profile, "box")
    text = scene.read_text(encoding="utf-8").replace('name = "phantom"', 'name = "phantom"\ncrop = "none"')
    # Rays run to their end: one that a block ends early would go on in the picture of the whole.
    tables = f"\n[render]\nopacity_cutoff = 1.0\n\n[quantize]\nbits = {bits}\n\n[grid]\nsize = {size}\n"
    scene.write_text(text + tables + f'\n[lab.mosaic]\norder = "{order}"\n', encoding="utf-8")
    return scene_builds.built(scene, folder / "phantom.volpkg")


def point_of(package: Package, i: int, j: int, k: int, counts_zyx: tuple[int, int, int]) -> int:
    _, ny, nx = (count + 1 for count in counts_zyx)
    return i + nx * (j + ny * k)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("bits", "profile", "order"),
    [
        (8, "gles2-4096", "auto"),
        (8, "gles3", "auto"),
        (8, "gles2-4096", "interleaved"),
        (8, "gles2-4096", "planar"),
        (16, "gles3", "auto"),
        (16, "gles3-norm16", "auto"),
    ],
)
def test_eight_pieces_around_the_middle_are_the_whole_volume(tmp_path, bits, profile, order) -> None:
    # 21×34×45 voxels in pieces of 24: one along z, two along y and x.
    package = built(tmp_path, 24, bits, profile, order)
    grid = package.manifest.grid
    for transfer in ("shell", "core"):
        whole = Renderer(package, level=0, transfer=transfer)
        pieces = Renderer(package, point=point_of(package, 1, 1, 0, (1, 2, 2)), transfer=transfer)
        with whole, pieces:
            for camera in standard_views(grid, "perspective").values():
                box_from_clip = camera.box_from_clip(grid, ASPECT)
                expected = whole.render(box_from_clip, SHAPE_HW)
                assert expected[..., 3].max() > 0.5
                np.testing.assert_allclose(pieces.render(box_from_clip, SHAPE_HW), expected, rtol=0, atol=1.01 / 255)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(("view", "axis"), [("left", "x"), ("right", "x"), ("anterior", "y"), ("superior", "z")])
def test_blocks_side_by_side_make_the_picture_of_the_whole(tmp_path, view, axis) -> None:
    # Pieces of 12: 2×3×4 along z, y, x. Blocks around these points share no cell, and together are all of them.
    package = built(tmp_path, 12)
    grid = package.manifest.grid
    box_from_clip = standard_views(grid)[view].box_from_clip(grid, ASPECT)
    step_mm = 0.02
    with Renderer(package, level=0, target="rgba32f") as renderer:
        expected = renderer.render(box_from_clip, SHAPE_HW, step_mm)
    columns: dict[tuple[int, ...], list[np.ndarray]] = {}
    for i, j in product((1, 3), (1, 3)):
        with Renderer(package, point=point_of(package, i, j, 1, (2, 3, 4)), target="rgba32f") as renderer:
            picture = renderer.render(box_from_clip, SHAPE_HW, step_mm).astype(np.float64)
        columns.setdefault({"x": (j,), "y": (i,), "z": (i, j)}[axis], []).append(picture)
    # A ray of these views runs through one column of blocks; which of them it meets first, the box tells.
    into_box = box_from_clip[:3, 2] @ np.eye(3)["xyz".index(axis)] > 0
    total = np.zeros_like(expected, dtype=np.float64)
    for blocks in columns.values():
        column = np.zeros_like(total)
        for picture in blocks if into_box else blocks[::-1]:
            column += (1 - column[..., 3:]) * picture
        total += column
    assert expected[..., 3].max() > 0.5
    # Both are midpoint sums of the same integral: what is left of each is of the order of the step squared.
    np.testing.assert_allclose(total, expected, rtol=0, atol=2e-4)


def test_a_point_that_is_not_there_is_refused_with_those_that_are(tmp_path) -> None:
    package = built(tmp_path, 24)
    with pytest.raises(VolprepError, match=r"VP5018.*points 0 to 17"):
        Renderer(package, point=18)


def test_a_package_without_pieces_has_no_point(built_package) -> None:
    with pytest.raises(VolprepError, match=r"VP5018.*no sub-volumes"):
        Renderer(Package.open(built_package), point=0)
