"""`classification = "auto"`: the kind that draws the scan's rays within the tolerance in the least counted time."""

from pathlib import Path

import numpy as np
import pytest
from plans import PlanOfOne, plan_of_one

from volprep.parts.classification.automatic import KIND
from volprep.plan.item_kinds import BEYOND
from volprep.scan.statistics import SlabMeasurer
from volprep.scene.profiles import load_profile
from volprep.scene.scene import Scene
from volprep.truth.phantoms import distance, sampled
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.source import SourceInfo

GRID = Grid.of((40, 48, 48), (1.2, 1.0, 1.0))
SMOOTH = ((0.0, 0.0), (255.0, 0.05))
SHELLS = ((99, 0), (100, 1), (103, 1), (104, 0))
ONE_LEVEL = {"coarsest_longest_axis": 48}


def scene_of(points=SMOOTH, **tables) -> Scene:
    listed = [{"value": v, "colour": "#ff8040", "extinction_per_mm": e} for v, e in points]
    render = {"classification": "auto"} | tables.pop("render", {})
    body = {"transfer": [{"name": "a", "points": listed}], "crop": "none", "render": render, "pyramid": ONE_LEVEL}
    return Scene.model_validate({"name": "s", "source": {"path": "x"}} | body | tables)


def planned(scene: Scene, profile: str = "gles3") -> PlanOfOne:
    centre = tuple(extent / 2 for extent in GRID.extent_mm_zyx[::-1])
    codes = np.rint(np.clip(255 - 9 * sampled(distance(centre), GRID), 0, 255)).astype(np.uint8)
    info = SourceInfo(format="raw", grid=GRID, stored_type="uint8")
    gauge = SlabMeasurer(info)
    gauge.add(codes)
    return plan_of_one(scene, load_profile(profile, Path()), info, gauge.result("0" * 64))


def test_a_plan_says_that_voxels_in_colour_are_beyond_the_usual_tolerance() -> None:
    def told(**tables) -> list[str]:
        plan = planned(scene_of(**tables))
        return [item.reason for item in plan.items if item.kind == BEYOND]

    coloured = {"classification": "preclassified"}
    (reason,) = told(render=coloured)
    assert "FLIP of up to 0.1 and keep 0.7" in reason
    assert told(render=coloured, tolerance={"flip": 0.1, "kept_light": 0.7}) == []
    assert told(render={"classification": "lookup"}) == []


def chosen(plan: PlanOfOne) -> tuple[str, str]:
    """The classification of the programs, and the reason that the plan gives."""
    (item,) = (each for each in plan.items if each.kind == KIND)
    (name,) = {program.classification for program in plan.programs}
    kind, _, reason = item.reason.partition(": ")
    assert kind == name
    return kind, reason


def test_thin_shells_are_drawn_by_segments_and_the_plan_says_in_one_line_what_others_would_cost() -> None:
    plan = planned(scene_of(SHELLS))
    kind, reason = chosen(plan)
    assert kind == "preintegrated"
    assert plan.preintegrated
    assert not plan.lookups
    assert "\n" not in reason
    assert "lookup" in reason
    assert "control-points" in reason
    assert "in that time a sample of rays is off by preintegrated RMSE" in reason


def test_few_control_points_take_less_time_than_a_table_where_no_level_has_one_of_its_own() -> None:
    assert chosen(planned(scene_of()))[0] == "control-points"
    assert chosen(planned(scene_of(pyramid={"coarsest_longest_axis": 12})))[0] == "lookup"


def test_coarser_levels_of_a_scan_with_segments_have_no_tables_that_control_points_would_lose() -> None:
    levels = {"coarsest_longest_axis": 12}
    assert chosen(planned(scene_of(pyramid=levels, segments={"source": "s"})))[0] == "control-points"


def test_a_function_of_many_points_is_read_from_a_table() -> None:
    values = np.linspace(0, 255, 200)
    assert chosen(planned(scene_of([(float(v), 0.05 * float(v) / 255) for v in values])))[0] == "lookup"


def test_with_a_stated_step_the_errors_in_the_same_time_decide() -> None:
    plan = planned(scene_of(SHELLS, render={"step_voxels": 1.0}))
    kind, reason = chosen(plan)
    assert kind == "preintegrated"
    assert reason.startswith("in the time of lookup tables with steps of 1 voxel a sample of rays is off by preintegr")
    assert plan.rays.step_mm == 1.0


def test_the_package_is_that_of_a_scene_that_names_the_kind() -> None:
    named = planned(scene_of(SHELLS, render={"classification": "preintegrated"}))
    plan = planned(scene_of(SHELLS))
    assert plan.channel == named.channel
    assert plan.render == named.render
    assert [each for each in plan.items if each.kind != KIND] == list(named.items)


@pytest.mark.parametrize(
    ("tables", "reason"),
    [
        ({"editable": True}, "the scene allows no other kind"),
        ({"render": {"compositing": "mida"}}, "the scene allows no other kind"),
        ({"render": {"technique": "view-slices-as-published"}}, "do not tell which error a step makes"),
        ({"source": {"path": "x", "labels": True}}, "do not tell which error a step makes"),
        ({"source": {"path": "x", "labels": True}, "render": {"step_voxels": 0.5}}, "do not tell which error"),
        ({"render": {"compositing": "maximum", "step_voxels": 0.5}}, "do not tell which error a step makes"),
    ],
)
def test_where_nothing_is_measured_it_is_lookup_tables(tables, reason) -> None:
    kind, said = chosen(planned(scene_of(**tables)))
    assert kind == "lookup"
    assert reason in said


def test_devices_without_shaders_have_no_classification_to_choose() -> None:
    plan = planned(scene_of(), "gles1")
    assert [each for each in plan.items if each.kind == KIND] == []
    assert not plan.programs


def test_settings_that_go_with_no_kind_are_refused_as_without_it() -> None:
    with pytest.raises(VolprepError, match="VP3119"):
        planned(scene_of(render={"lighting": "phong"}))
