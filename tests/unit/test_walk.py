"""A walk over sub-volumes: coordinates, levels by zoom, moves along the view, and what a step may say."""

import numpy as np
import pytest
import tiny_packages

from volprep.lab.walk.walker import Ground, Walker, drawn_level
from volprep.parts.subvolumes.cuts import cuts_along, grid_points
from volprep.scene.walk import ShownValues, WalkStep, load_walk
from volprep.truth.camera import standard_views
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.parts.subvolumes.places import (
    inner_point,
    local_of,
    overall_of,
    place_of,
    sides_of,
    voxel_of,
)
from volprep_formats.package.parts.subvolumes.record import Subvolume, SubvolumeGrid, ViewThresholds
from volprep_formats.package.transfer_function import TransferFunction

SHAPE_ZYX = (21, 34, 45)


def grid_of(size: int = 12, shape_zyx: tuple[int, int, int] = SHAPE_ZYX) -> SubvolumeGrid:
    z, y, x = (cuts_along(n, size) for n in shape_zyx)
    count = (len(z) - 1) * (len(y) - 1) * (len(x) - 1)
    return SubvolumeGrid(
        shape_zyx=shape_zyx,
        size=size,
        cuts_zyx=(z, y, x),
        texture_format="r8unorm",
        dimension="3d",
        subvolumes=(Subvolume(minimum=0, maximum=255, file="a.ktx2"),) * count,
        points=grid_points((z, y, x)),
        view=ViewThresholds(),
    )


GRID = grid_of()
LEVELS = {0: 0.75, 1: 1.5, 2: 3.0, 3: 6.0}


def walker(pixels: int = 100, levels=LEVELS) -> Walker:
    level_grid = Grid.of(SHAPE_ZYX, (2.5, 0.75, 1.0))
    return Walker.at_the_front(Ground(GRID, level_grid, levels, "orthographic", pixels))


def voxel_of_local(grid: SubvolumeGrid, piece: int, local_xyz: tuple[float, ...]) -> list[float]:
    """The voxel of level 0 at coordinates in the texture of a piece."""
    place_zyx = np.unravel_index(piece, grid.counts_zyx)
    spans = [spans[number] for number, spans in zip(place_zyx, grid.spans_zyx, strict=True)][::-1]
    return [first + at * (last - first + 1) - 0.5 for at, (first, last) in zip(local_xyz, spans, strict=True)]


@pytest.mark.parametrize("shape_zyx", [SHAPE_ZYX, (1, 12, 13), (23, 1, 40)], ids=str)
def test_local_coordinates_lead_back_to_the_voxel_and_lie_in_its_piece(shape_zyx) -> None:
    grid = grid_of(12, shape_zyx)
    rng = np.random.default_rng(1)
    for _ in range(200):
        voxel = tuple(float(rng.uniform(-0.5, n - 0.5)) for n in shape_zyx[::-1])
        piece, local = local_of(grid, voxel)
        assert all(0.0 <= at <= 1.0 for at in local)
        np.testing.assert_allclose(voxel_of_local(grid, piece, local), voxel, atol=1e-9)


def test_overall_coordinates_lead_back_to_the_voxel_and_span_the_block() -> None:
    rng = np.random.default_rng(2)
    for point in range(len(GRID.points)):
        overall = tuple(rng.uniform(0.0, 1.0, 3).tolist())
        voxel = voxel_of(GRID, point, overall)
        np.testing.assert_allclose(overall_of(GRID, point, voxel), overall, atol=1e-12)
        # What a block shows are the pieces that touch its point.
        assert local_of(GRID, voxel)[0] in GRID.points[point].subvolumes


def test_overall_coordinates_in_the_middle_of_the_voxels_of_a_piece_are_local_ones() -> None:
    # The first piece of a corner block has voxels 0 to 11, and the block ends in the layer that it shares.
    assert GRID.points[0].subvolumes == (0,)
    x, _, _ = sides_of(GRID, 0)
    assert (x.begins, x.ends) == (0.0, 11.5)
    voxel = voxel_of(GRID, 0, (0.5, 0.5, 0.5))
    assert voxel[0] == 11.5 / 2 - 0.5
    assert local_of(GRID, voxel)[1][0] == pytest.approx(11.5 / 2 / 12)


def test_a_walk_begins_where_a_device_holds_two_pieces_along_each_axis() -> None:
    for voxel in ((0.0, 0.0, 0.0), (22.0, 16.0, 10.0), (44.0, 33.0, 20.0)):
        assert GRID.points[inner_point(GRID, voxel)].kind == "interior"
    # Two pieces along y, one along x.
    flat = grid_of(12, (1, 20, 9))
    assert place_of(flat, inner_point(flat, (4.0, 18.0, 0.0))) == (0, 1, 0)


def test_the_level_follows_the_zoom_and_does_not_flicker() -> None:
    view = ViewThresholds()
    assert drawn_level(LEVELS, view, 3.1, None) == 3
    assert drawn_level(LEVELS, view, 2.9, None) == 2
    # Of a level whose voxel is 1.9 pixels a little more zoom makes the next finer one, and as little less keeps it.
    assert drawn_level(LEVELS, view, 3.0 / 1.9, 2) == 2
    assert drawn_level(LEVELS, view, 3.0 / 2.1, 2) == 1
    assert drawn_level(LEVELS, view, 3.0 / 1.9, 1) == 1
    assert drawn_level(LEVELS, view, 3.0, 1) == 2
    # From far away to the voxels at once, and back.
    assert drawn_level(LEVELS, view, 0.01, 3) == 0
    assert drawn_level(LEVELS, view, 100.0, 0) == 3


def test_forward_leads_along_the_view_as_far_as_it_is_legal() -> None:
    near = walker().after(WalkStep(zoom=8.0, view="anterior"), 1)
    assert (near.level, place_of(GRID, near.point)) == (0, (1, 1, 2))
    deeper = near.after(WalkStep(move="forward"), 2)
    assert deeper.made == deeper.asked == ("+y",)
    assert place_of(GRID, deeper.point) == (1, 2, 2)
    places = []
    for number in range(4):
        deeper = deeper.after(WalkStep(move="forward"), number)
        places.append((place_of(GRID, deeper.point)[1], deeper.made))
    # Three pieces along y: the last point is 3, and there the walk ends.
    assert places == [(3, ("+y",)), (3, ()), (3, ()), (3, ())]
    assert deeper.asked == ("+y",)
    back = deeper.after(WalkStep(move="back"), 9)
    assert (back.made, place_of(GRID, back.point)) == (("-y",), (1, 2, 2))


def test_at_an_edge_only_the_legal_part_of_a_move_along_several_axes_is_made() -> None:
    at = walker().after(WalkStep(zoom=8.0, view="anterior-right"), 1)
    seen = []
    for number in range(6):
        at = at.after(WalkStep(move="forward"), number)
        seen.append(at.made)
        assert set(at.made) <= set(at.asked)
    assert len(seen[0]) == 3
    assert [len(made) for made in seen] == sorted((len(made) for made in seen), reverse=True)
    assert 0 < len(seen[1]) < 3
    assert GRID.points[at.point].kind == "corner"


def test_zooming_out_and_in_again_comes_back_to_the_middle() -> None:
    near = walker().after(WalkStep(zoom=8.0), 1).after(WalkStep(move="forward"), 2)
    far = near.after(WalkStep(zoom=0.1), 3)
    assert (far.level, far.point) == (3, None)
    assert far.after(WalkStep(zoom=8.0), 4).point == walker().after(WalkStep(zoom=8.0), 1).point


def test_a_move_over_a_whole_level_is_refused() -> None:
    with pytest.raises(VolprepError, match=r"VP3181 step 7.*level 1 is shown whole"):
        walker(50).after(WalkStep(zoom=1.0, move="forward"), 7)


def test_a_turn_leads_around_the_patient() -> None:
    views = standard_views(Grid.of(SHAPE_ZYX, (1.0, 1.0, 1.0)))
    front = walker()
    # Whoever stands before a patient and goes to his own right comes to the patient's left.
    for turn, view in (((90.0, 0.0), "left"), ((-90.0, 0.0), "right"), ((0.0, 90.0), "superior")):
        turned = front.after(WalkStep(turn=turn), 1)
        np.testing.assert_allclose(turned.forward, views[view].forward, atol=1e-12)
        assert abs(np.dot(turned.forward, turned.up)) < 1e-12
    around = front
    for _ in range(4):
        around = around.after(WalkStep(turn=(90.0, 0.0)), 1)
    np.testing.assert_allclose(around.forward, front.forward, atol=1e-12)


def test_a_view_that_is_none_is_refused() -> None:
    with pytest.raises(VolprepError, match="VP5022"):
        walker().after(WalkStep(view="sideways"), 1)


FUNCTION = tiny_packages.function(
    *((10.0, (0.0, 0.0, 0.0), 0.0), (20.0, (1.0, 0.5, 0.0), 1.0)),
    *((20.0, (0.0, 0.5, 0.0), 2.0), (40.0, (0.0, 0.5, 1.0), 4.0)),
    reference_mm=2.0,
)


def extinction(function: TransferFunction, values) -> np.ndarray:
    points = function.points
    return np.interp(values, [p.value for p in points], [p.extinction_per_mm for p in points])


def test_values_beyond_minimum_and_maximum_are_not_shown_and_the_others_as_before() -> None:
    shown = ShownValues(minimum=15.0, maximum=30.0).of(FUNCTION)
    inside = [15.001, 19.9, 20.1, 25.0, 29.999]
    np.testing.assert_allclose(extinction(shown, inside), extinction(FUNCTION, inside), rtol=1e-3)
    np.testing.assert_array_equal(extinction(shown, [0.0, 14.999, 30.001, 100.0]), 0.0)
    assert shown.points[0].colour == (0.5, 0.25, 0.0)


@pytest.mark.parametrize(("wanted", "at", "colour"), [("minimum", 2.0, 0.0), ("maximum", 1.0, 1.0)])
def test_at_a_jump_the_side_within_the_range_counts(wanted, at, colour) -> None:
    shown = ShownValues.model_validate({wanted: 20.0}).of(FUNCTION)
    edge = [point for point in shown.points if point.value == 20.0]
    assert sorted(point.extinction_per_mm for point in edge) == [0.0, at]
    assert {point.colour[0] for point in edge} == {colour}


def test_alpha_is_the_opacity_of_every_value_for_the_reference_length() -> None:
    shown = ShownValues(alpha=0.3, minimum=15.0).of(FUNCTION)
    np.testing.assert_allclose(1 - np.exp(-2.0 * extinction(shown, [15.1, 20.0, 50.0])), 0.3)
    assert extinction(shown, [14.9])[0] == 0.0
    assert np.isfinite(extinction(ShownValues(alpha=1.0).of(FUNCTION), [20.0])).all()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("size = 8\n[[step]]\n", "size"),
        ("", "step"),
        ("[[step]]\nzoom = 0.0\n", "zoom"),
        ("[[step]]\ncut = [1, 2, 3]\ntap = [0.5, 0.5, 0.5]\n", "cut and tap"),
        ("[[step]]\nminimum = 4.0\nmaximum = 4.0\n", "not below"),
        ("[[step]]\nmove = 'up'\n", "move"),
        ("[[step]]\nfly = true\n", "fly"),
        ("[[step]]\nzoom = nan\n", "zoom"),
    ],
)
def test_a_walk_that_says_what_it_must_not_is_refused_by_name(tmp_path, text, problem) -> None:
    path = tmp_path / "walk.toml"
    path.write_text(text)
    with pytest.raises(VolprepError, match=rf"VP3180.*{problem}"):
        load_walk(path)


def test_a_walk_that_is_not_there_or_no_toml_is_refused(tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP3001"):
        load_walk(tmp_path / "nothing.toml")
    (tmp_path / "walk.toml").write_text("[[step")
    with pytest.raises(VolprepError, match="VP3002"):
        load_walk(tmp_path / "walk.toml")
