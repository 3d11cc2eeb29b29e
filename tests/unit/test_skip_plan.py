"""When empty space is skipped: where enough is empty, or where the scene insists, and where the profile has room."""

import math
from pathlib import Path

import numpy as np
import pytest
from plans import PlanOfOne, plan_of_one

from volprep.plan.products import SkipPlan
from volprep.scan.block_ranges import BlockGauge, block_ranges
from volprep.scan.statistics import MEASURED_BLOCK, SlabMeasurer
from volprep.scene.profiles import load_profile
from volprep.scene.scene import Scene, SkipSettings, changed
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.source import SourceInfo

GLES3 = load_profile("gles3", Path())
GLES2 = load_profile("gles2-2048", Path())


def scene(points=((100.0, 0.0), (200.0, 0.5)), **skip) -> Scene:
    transfer = {"name": "a", "points": [{"value": v, "colour": "#ff8040", "extinction_per_mm": e} for v, e in points]}
    return Scene.model_validate(
        {"name": "s", "source": {"path": "x"}, "transfer": [transfer], "crop": "none", "skip": skip}
    )


def plan(voxels, wanted, profile=GLES3) -> PlanOfOne:
    info = SourceInfo(format="raw", grid=Grid.of(voxels.shape, (1.0, 1.0, 1.0)), stored_type=voxels.dtype.name)
    gauge = SlabMeasurer(info)
    gauge.add(voxels)
    return plan_of_one(wanted, profile, info, gauge.result("0" * 64))


def item(decided: PlanOfOne, name: str = "skip table a"):
    return next((each for each in decided.items if each.name == name), None)


def ball(size=65, radius=14):
    z, y, x = np.ogrid[:size, :size, :size]
    inside = (z - size // 2) ** 2 + (y - size // 2) ** 2 + (x - size // 2) ** 2 < radius**2
    return np.where(inside, 220, 10).astype(np.uint8)


def test_a_scene_that_wants_none_gets_nothing():
    decided = plan(ball(), scene().model_copy(update={"skip": SkipSettings(kind="none")}))
    assert "skip" not in decided.stages
    assert not item(decided).kept
    assert item(decided).reason == "the scene does not ask for it"


@pytest.mark.parametrize("profile", [GLES3, GLES2], ids=["gles3", "gles2"])
def test_a_ball_in_a_box_is_worth_a_table_for_each_level(profile):
    decided = plan(ball(), scene(), profile)
    assert "skip" in decided.stages
    assert [table.level for table in decided.part(SkipPlan).tables] == [level.index for level in decided.levels]
    found = item(decided)
    assert found.kept
    assert (
        "of the samples of a ray lie in empty blocks of 16³ voxels; kind distance, blocks of 4³ cells" in found.reason
    )
    assert found.files == tuple(table.file for table in decided.part(SkipPlan).tables)
    if profile is GLES3:
        assert decided.part(SkipPlan).tables[0].shape_zyx == (16, 16, 16)
        assert found.size_bytes == sum(math.prod(table.shape_zyx) for table in decided.part(SkipPlan).tables)
    else:
        assert decided.part(SkipPlan).tables[0].mosaic.tile_shape_yx == (16, 16)


def test_where_nothing_is_empty_there_is_no_table_even_if_the_scene_insists():
    decided = plan(ball(), scene([(0.0, 0.1), (200.0, 0.5)], kind="distance"))
    assert decided.part(SkipPlan).tables == ()
    assert "skip" not in decided.stages
    assert not item(decided).kept
    assert item(decided).reason == "no block of 16³ voxels is empty"


def test_where_little_is_empty_a_table_costs_more_than_it_saves():
    voxels = np.full((65, 65, 65), 220, np.uint8)
    voxels[:17, :17, :33] = 10
    auto, insisting = plan(voxels, scene()), plan(voxels, scene(kind="blocks"))
    assert "below 5% a table may cost more time than it saves" in item(auto).reason
    assert not auto.part(SkipPlan).tables
    assert insisting.part(SkipPlan).tables[0].kind == "blocks"


def test_what_is_empty_behind_the_first_surface_does_not_count():
    """A closed shell in whose empty inside no ray gets before it ends."""
    voxels = np.full((97, 97, 97), 220, np.uint8)
    voxels[16:-16, 16:-16, 16:-16] = 10
    decided = plan(voxels, scene())
    assert decided.part(SkipPlan).shares == (0.0,)
    assert not decided.part(SkipPlan).tables


def test_a_transfer_function_that_shows_nothing_is_told():
    decided = plan(ball(), scene([(230.0, 0.0), (250.0, 0.0)]))
    assert item(decided).reason == "the transfer function shows nothing, so pictures are empty and rays take no samples"


def test_kind_and_block_are_the_scenes():
    tables = plan(ball(), scene(kind="distance", block=5)).part(SkipPlan).tables
    assert (tables[0].kind, tables[0].block, tables[0].shape_zyx) == ("distance", 5, (13, 13, 13))
    tables = plan(ball(), scene(kind="table16")).part(SkipPlan).tables
    assert (tables[0].block, tables[0].shape_zyx) == (4, (16, 16, 16))


def test_a_table_for_which_there_is_no_room_is_left_out():
    voxels = ball()
    tight = GLES3.model_copy(update={"max_texture_bytes": voxels.size + 4096 * 8 + 4000})
    decided = plan(voxels, scene(), tight)
    assert "there is no room for a table of 4096 bytes beside level 0" in item(decided).reason
    short = GLES2.model_copy(update={"max_texture_size": 400})
    decided = plan(voxels, scene(block=1), short)
    assert "a table of 64×64×64 entries does not fit into a texture of profile gles2-2048" in item(decided).reason


def test_ranges_of_blocks_come_on_request():
    decided = plan(ball(), scene(kind="none", ranges=True))
    assert decided.part(SkipPlan).tables == ()
    assert decided.part(SkipPlan).ranges[0].shape_zyx == (32, 16, 16)
    assert item(decided, "ranges of blocks").files == tuple(ranges.file for ranges in decided.part(SkipPlan).ranges)
    assert "skip" in decided.stages


def test_the_verb_changes_wishes_one_by_one():
    wanted = changed(scene(block=16), "skip", kind="distance", block=None).skip
    assert wanted == SkipSettings(kind="distance", block=16)
    assert changed(scene(), "skip", kind=None, block=3, ranges=True).skip == SkipSettings(block=3, ranges=True)
    with pytest.raises(VolprepError, match=r"VP3003 \[skip\]: kind"):
        changed(scene(), "skip", kind="spheres")


@pytest.mark.parametrize("cuts", [(33,), (1,) * 33, (16, 17), (17, 16), (5, 20, 8)])
@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32])
def test_blocks_are_measured_in_slabs_of_any_thickness(cuts, dtype):
    voxels = np.random.default_rng(1).integers(0, 200, (33, 40, 19)).astype(dtype)
    gauge = BlockGauge(MEASURED_BLOCK)
    for end, thickness in zip(np.cumsum(cuts), cuts, strict=True):
        gauge.add(voxels[end - thickness : end])
    found = gauge.physical(-0.5, 3.0)
    expected = block_ranges(lambda z0, z1: voxels[z0:z1], voxels.shape, MEASURED_BLOCK)
    # One float32 wider at either end, so that rounding hides nothing.
    np.testing.assert_allclose(found.low, expected.high * -0.5 + 3.0, rtol=2e-7)
    np.testing.assert_allclose(found.high, expected.low * -0.5 + 3.0, rtol=2e-7)
    assert (found.low < expected.high * -0.5 + 3.0).all()
