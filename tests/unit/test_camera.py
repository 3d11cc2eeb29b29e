import numpy as np
import pytest

from volprep.truth.camera import standard_views
from volprep_formats.grid import Grid

GRID = Grid.of((30, 20, 10), (1.0, 2.0, 3.0), (5.0, -6.0, 7.0), ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
CENTRE = (GRID.world_from_box @ [15.0, 20.0, 15.0, 1.0])[:3]
PROJECTIONS = ("orthographic", "perspective")


def pixel_of(view: str, world_mm_xyz: np.ndarray, projection: str = "orthographic") -> tuple[float, float]:
    """Normalised device coordinates (x to the right, y up) at which a view shows a point."""
    clip = np.linalg.inv(standard_views(GRID, projection)[view].world_from_clip(1.0)) @ [*world_mm_xyz, 1.0]
    return clip[0] / clip[3], clip[1] / clip[3]


# As a radiologist expects it: left hand of the patient (+x), back (+y), head (+z).
@pytest.mark.parametrize(
    ("view", "to_the_right", "up"),
    [
        ("anterior", (1, 0, 0), (0, 0, 1)),
        ("posterior", (-1, 0, 0), (0, 0, 1)),
        ("left", (0, 1, 0), (0, 0, 1)),
        ("right", (0, -1, 0), (0, 0, 1)),
        ("superior", (-1, 0, 0), (0, -1, 0)),
        ("inferior", (1, 0, 0), (0, -1, 0)),
    ],
)
@pytest.mark.parametrize("projection", PROJECTIONS)
def test_a_view_shows_the_patient_the_right_way_round(view, to_the_right, up, projection) -> None:
    x, y = pixel_of(view, CENTRE + np.array(to_the_right), projection)
    assert x > 0.01
    assert abs(y) < 1e-12
    x, y = pixel_of(view, CENTRE + np.array(up), projection)
    assert y > 0.01
    assert abs(x) < 1e-12


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_every_view_holds_the_whole_volume(projection) -> None:
    corners = np.array(np.meshgrid([0.0, 30.0], [0.0, 40.0], [0.0, 30.0])).reshape(3, 8).T
    for view in standard_views(GRID):
        for corner in corners:
            world = (GRID.world_from_box @ [*corner, 1.0])[:3]
            assert np.abs(pixel_of(view, world, projection)).max() <= 1.0


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_rays_begin_before_the_volume_and_end_behind_it(projection) -> None:
    for camera in standard_views(GRID, projection).values():
        matrix = camera.world_from_clip(1.0)
        near, far = matrix @ [0, 0, -1, 1], matrix @ [0, 0, 1, 1]
        forward = np.array(camera.forward) / np.linalg.norm(camera.forward)
        half_diagonal = np.linalg.norm([30.0, 40.0, 30.0]) / 2
        assert (near[:3] / near[3] - CENTRE) @ forward <= -half_diagonal + 1e-9
        assert (far[:3] / far[3] - CENTRE) @ forward >= half_diagonal - 1e-9


def test_a_wide_picture_shows_more_at_the_sides_and_the_same_height() -> None:
    camera = standard_views(GRID)["anterior"]
    square, wide = camera.world_from_clip(1.0), camera.world_from_clip(2.0)
    np.testing.assert_allclose(wide[:, 0], 2 * square[:, 0])
    np.testing.assert_allclose(wide[:, 1:], square[:, 1:])


def test_rays_of_an_orthographic_view_are_parallel_and_those_of_a_perspective_one_meet_in_the_eye() -> None:
    for projection in PROJECTIONS:
        camera = standard_views(GRID, projection)["anterior-left"]
        matrix = camera.world_from_clip(1.0)
        rays = []
        for x, y in ((-1, -1), (1, 1)):
            near, far = matrix @ [x, y, -1, 1], matrix @ [x, y, 1, 1]
            rays.append((near[:3] / near[3], far[:3] / far[3]))
        (near_a, far_a), (near_b, far_b) = rays
        if projection == "orthographic":
            np.testing.assert_allclose(far_a - near_a, far_b - near_b, atol=1e-9)
        else:
            for near, far in rays:
                offset = np.cross(far - near, np.array(camera.eye_mm_xyz) - near) / np.linalg.norm(far - near)
                np.testing.assert_allclose(offset, 0.0, atol=1e-9)
