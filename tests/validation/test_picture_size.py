"""The size of the pictures that validation compares."""

from types import SimpleNamespace
from typing import Any

from volprep.validation.subjects.scan import Judge
from volprep_formats.grid import Grid


def size(set_in_scene: int, *shapes_zyx: tuple[int, int, int]) -> int:
    """Size for scans of these shapes, with voxels of 2 x 1 x 1 mm."""
    judge: Any = SimpleNamespace(picture_size=set_in_scene)
    return Judge.picture_size_of(judge, [Grid.of(shape, (2.0, 1.0, 1.0)) for shape in shapes_zyx])


def test_pictures_of_tiny_volumes_have_eight_pixels_for_each_voxel_of_the_diagonal() -> None:
    assert size(256, (4, 8, 8)) == 111
    assert size(256, (1, 2, 2)) == 64
    assert size(256, (9, 18, 18)) == 250
    assert size(256, (10, 20, 20)) == 256


def test_the_largest_scan_decides() -> None:
    assert size(256, (1, 2, 2), (4, 8, 8)) == 111


def test_a_size_that_the_scene_sets_stays() -> None:
    assert size(300, (1, 2, 2)) == 300
    assert size(48, (4, 8, 8)) == 48
