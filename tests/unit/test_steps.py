"""Steps of rays that are measured: as long as their error is a quarter of the tolerance, for each level its own."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from closed_forms import marschner_lobb
from plans import PlanOfOne, plan_of_one
from scene_builds import view_of
from tiny_packages import ES3, function, tiny_package

from volprep.parts.programs.patch_rays import FINE, PatchRays, patch_rays
from volprep.parts.programs.step import choose_steps, common_steps
from volprep.parts.programs.step_bench import STEP_SHARE
from volprep.plan.decisions import StepChoice
from volprep.plan.item_kinds import BEYOND
from volprep.plan.records import LevelPlan
from volprep.render.renderer import Renderer
from volprep.scan.statistics import SlabMeasurer
from volprep.scene.profiles import load_profile
from volprep.scene.scene import Scene
from volprep.truth.oracle import oracle_picture
from volprep.truth.phantoms import distance, sampled
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid
from volprep_formats.package.program import LevelStep, RaySampling
from volprep_formats.source import SourceInfo

GLES3 = load_profile("gles3", Path())
GRID = Grid.of((40, 48, 48), (1.2, 1.0, 1.0))
POINTS = ((0.0, 0.0), (100.0, 0.0), (140.0, 1.5), (255.0, 3.0))


def scene_of(points=POINTS, **tables) -> Scene:
    listed = [{"value": v, "colour": "#ff8040", "extinction_per_mm": e} for v, e in points]
    transfer = [{"name": "a", "points": listed}]
    pyramid = {"pyramid": {"coarsest_longest_axis": 12}, "crop": "none"}
    return Scene.model_validate({"name": "s", "source": {"path": "x"}, "transfer": transfer, **pyramid, **tables})


def planned(codes: np.ndarray, scene: Scene, grid: Grid = GRID) -> PlanOfOne:
    info = SourceInfo(format="raw", grid=grid, stored_type=codes.dtype.name)
    gauge = SlabMeasurer(info)
    gauge.add(codes)
    return plan_of_one(scene, GLES3, info, gauge.result("0" * 64))


def waves(frequency: float) -> np.ndarray:
    field = sampled(marschner_lobb(GRID.extent_mm_zyx[::-1], frequency=frequency), GRID)
    return np.rint(field * 255).astype(np.uint8)


def ball() -> np.ndarray:
    centre = tuple(extent / 2 for extent in GRID.extent_mm_zyx[::-1])
    return np.rint(np.clip(255 - 9 * sampled(distance(centre), GRID), 0, 255)).astype(np.uint8)


def steps_of(plan) -> list[float]:
    return [plan.rays.step_of(level.index) for level in plan.levels]


@pytest.mark.parametrize("codes", [ball(), waves(3.0)], ids=["ball", "waves"])
def test_the_step_that_is_chosen_is_as_exact_as_the_plan_says_in_a_picture_of_another_program(tmp_path, codes):
    """The plan's rays see patches; the picture is the shader's, against the oracle."""
    step_mm = planned(codes, scene_of()).rays.step_mm
    transfer = function(*((v, (1.0, 0.216, 0.051), e) for v, e in POINTS))
    package = tiny_package(tmp_path / "p", codes, transfer, ES3, grid=GRID, step_mm=step_mm)
    errors = {1: [], 4: []}
    for view in ("anterior-left", "left"):
        box_from_clip = view_of(GRID, view)
        truth = oracle_picture(Volume(codes, GRID), transfer, box_from_clip, (64, 64), tolerance=1e-7).rgba
        seen = truth[..., 3] > 1 / 510
        with Renderer(package, target="rgba32f") as renderer:
            for times, found in errors.items():
                drawn = renderer.render(box_from_clip, (64, 64), times * step_mm)
                found.append(np.sqrt(np.mean((drawn - truth)[seen] ** 2)))
    limit = STEP_SHARE * 0.02
    assert max(errors[1]) <= limit
    assert max(errors[4]) > limit, "four times the step would do"


def test_what_changes_faster_gets_a_shorter_step() -> None:
    smooth, rough = steps_of(planned(ball(), scene_of())), steps_of(planned(waves(5.0), scene_of()))
    assert smooth[0] > rough[0]


def test_a_smaller_tolerance_gets_a_shorter_step() -> None:
    tolerances = [{"rmse": rmse, "maximum": 1.0} for rmse in (0.05, 0.02, 0.005, 1e-4)]
    steps = [planned(waves(1.5), scene_of(tolerance=each)).rays.step_mm for each in tolerances]
    assert steps == sorted(steps, reverse=True)
    assert len(set(steps)) > 2
    assert steps[-1] == 0.125


def test_a_plan_says_that_the_shortest_step_is_beyond_the_tolerance() -> None:
    def told(rmse: float) -> list[str]:
        plan = planned(waves(5.0), scene_of(tolerance={"rmse": rmse, "maximum": 1.0}))
        return [item.reason for item in plan.items if item.kind == BEYOND]

    assert told(0.05) == []
    (reason,) = told(1e-5)
    assert reason.startswith("steps of level 0 are beyond the tolerance: 0.125 voxels: a sample of rays is off by RMSE")
    assert "[tolerance]" in reason


def test_coarser_levels_have_longer_steps_and_the_plan_says_why() -> None:
    plan = planned(waves(1.5), scene_of(tolerance={"rmse": 0.02, "maximum": 0.5}))
    steps = steps_of(plan)
    assert steps[-1] > steps[0]
    for level, step_mm in zip(plan.levels, steps, strict=True):
        item = next(each for each in plan.items if each.name == f"step of level {level.index}")
        assert item.kept
        assert item.reason.startswith(f"{step_mm:.3g} mm")
        assert "within a quarter of the tolerance (RMSE 0.005, 0.12 at most)" in item.reason


def test_steps_of_levels_whose_cells_are_wider_than_a_patch_take_no_more_memory() -> None:
    grid = Grid.of((1200, 96, 96), (1.0, 1.0, 1.0))
    info = SourceInfo(format="raw", grid=grid, stored_type="uint8")
    gauge = SlabMeasurer(info)
    gauge.add(np.random.default_rng(1).integers(0, 256, grid.shape_zyx).astype(np.uint8))
    measured = gauge.result("0" * 64)
    level = LevelPlan(channel="a", index=7, factors_zyx=(128, 128, 128), shape_zyx=(10, 1, 1), filter="auto")
    transfer = function((0.0, (1, 1, 1), 0.0), (255.0, (1, 1, 1), 0.3))
    tracemalloc.start()
    try:
        choose_steps(scene_of(), [transfer], info, measured, grid=grid, levels=[level])
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # Patches that were padded to whole cells would take 1510 MB.
    assert peak < 500e6


def lit_rays(per_voxel: int, often: int) -> PatchRays:
    """Rays whose shade repeats so often in a voxel."""
    at = (np.arange(12 * per_voxel)[:, None] + 0.5) / per_voxel
    shade = 0.5 + 0.3 * np.cos(2 * np.pi * often * at + np.linspace(0, 2 * np.pi, 40))
    return PatchRays(np.full(shape=shade.shape, fill_value=128.0), 1 / per_voxel, (slice(0, 40),), shade)


def test_a_lit_step_of_two_fine_samples_is_measured_along_finer_ones() -> None:
    grid = Grid.of((12, 12, 12), (1.0, 1.0, 1.0))
    info = SourceInfo(format="raw", grid=grid, stored_type="uint8")
    gauge = SlabMeasurer(info)
    gauge.add(np.full(grid.shape_zyx, 128, np.uint8))
    measured = gauge.result("0" * 64)
    level = LevelPlan(channel="a", index=0, factors_zyx=(1, 1, 1), shape_zyx=grid.shape_zyx, filter="none")
    transfer = function((0.0, (1, 1, 1), 0.0), (255.0, (1, 1, 1), 0.3))

    def step_mm(rmse: float, finer) -> float:
        scene = scene_of(render={"lighting": "headlight"}, tolerance={"rmse": rmse})
        coarse = {"grid": grid, "levels": [level], "finest": [lit_rays(16, 12)]}
        return choose_steps(scene, [transfer], info, measured, **coarse, finer=finer)[0].step_mm

    assert step_mm(0.01, lambda: [lit_rays(64, 12)]) == 0.125
    assert step_mm(0.01, lambda: [lit_rays(64, 16)]) == 0.09
    assert step_mm(0.03, lambda: pytest.fail("the step is not as short")) > 0.15


def test_pre_integrated_tables_take_longer_steps_than_single_samples() -> None:
    shells = ((99, 0), (100, 1), (103, 1), (104, 0))
    found = [
        planned(ball(), scene_of(shells, render={"classification": name})).rays.step_mm
        for name in ("preintegrated", "lookup")
    ]
    assert found[0] > 2 * found[1]


def test_lit_segments_take_shorter_steps_that_keep_the_promise_with_light() -> None:
    unlit, lit = (
        planned(ball(), scene_of(render={"classification": "preintegrated", "lighting": name}))
        for name in ("none", "headlight")
    )
    assert lit.rays.step_mm < unlit.rays.step_mm
    reason = next(each.reason for each in lit.items if each.name == "step of level 0")
    assert "within a quarter of the tolerance" in reason


def test_layers_are_measured_as_rays_are_where_the_picture_keeps_half_floats() -> None:
    cast, blended = (planned(ball(), scene_of(render={"technique": t})) for t in ("ray-casting", "view-slices"))
    assert blended.rays.step_mm == cast.rays.step_mm
    assert "a sample of rays is off by" in next(each.reason for each in blended.items if each.kind == "step")


def test_of_layers_that_are_rounded_to_8_bits_the_step_with_the_least_error_is_taken_not_the_finest() -> None:
    tolerance = {"rmse": 4e-3, "maximum": 0.1}
    render = {"technique": "axis-slices"}
    info = SourceInfo(format="raw", grid=GRID, stored_type="uint8")
    gauge = SlabMeasurer(info)
    gauge.add(ball())
    measured = gauge.result("0" * 64)
    bytes_, floats = (
        plan_of_one(scene_of(render=render, tolerance=tolerance), load_profile(name, Path()), info, measured)
        for name in ("gles2-2048", "gles3")
    )
    assert bytes_.rays.step_mm > floats.rays.step_mm
    reason = next(each.reason for each in bytes_.items if each.kind == "step")
    assert "no step that was tried keeps it" in reason


def test_a_step_that_the_scene_states_counts_in_voxels_of_each_level() -> None:
    plan = planned(waves(3.0), scene_of(render={"step_voxels": 0.8}))
    assert steps_of(plan) == pytest.approx([0.8, 1.6, 3.2])


def test_where_users_edit_functions_nothing_is_measured() -> None:
    plan = planned(ball(), scene_of(editable=True))
    assert steps_of(plan) == pytest.approx([0.5, 1.0, 2.0])


def test_a_level_is_drawn_with_its_own_step(tmp_path) -> None:
    codes = waves(3.0)
    package = tiny_package(
        tmp_path / "p",
        [codes, codes[::2, ::2, ::2]],
        function((0.0, (1, 1, 1), 0.0), (255.0, (1, 1, 1), 0.3)),
        grid=GRID,
    )
    (picture,) = package.manifest.pictures
    first, second = picture.drawings
    own = (picture.model_copy(update={"drawings": (first, second.model_copy(update={"step_mm": 1.7}))}),)
    package = type(package)(package.path, package.manifest.model_copy(update={"pictures": own}))
    box_from_clip = view_of(GRID, "left")
    for level, step_mm in ((0, 0.5), (1, 1.7)):
        with Renderer(package, level=level, target="rgba32f") as renderer:
            own, same, other = (renderer.render(box_from_clip, (16, 16), each) for each in (None, step_mm, 1.1))
        np.testing.assert_array_equal(own, same)
        assert np.abs(own - other).max() > 1e-5


def test_of_several_channels_the_finest_step_counts_and_only_others_than_that_of_the_finest_level_are_named() -> None:
    one = [StepChoice(0, 1.0, ""), StepChoice(1, 2.0, ""), StepChoice(2, 0.7, "")]
    other = [StepChoice(0, 0.7, ""), StepChoice(2, 9.0, "")]
    assert common_steps([one, other]) == RaySampling(step_mm=0.7, level_steps=(LevelStep(level=1, step_mm=2.0),))
    assert common_steps([one[:1]]) == RaySampling(step_mm=1.0)


def test_rays_through_patches_see_the_field_of_the_volume_and_are_the_same_each_time() -> None:
    """A ramp along each axis, thrown back: along a ray it rises and falls by the ray's slope."""
    z, y, x = np.indices((9, 6, 7)).astype(np.float64)
    spacing = (2.0, 1.0, 1.5)
    for ramp, h, last in ((z, 2.0, 8), (y, 1.0, 5), (x, 1.5, 6)):
        found, again = (patch_rays(ramp[None], spacing, 30.0, soft_per_mm=1e-9) for _ in range(2))
        rays, step_mm = found.values[:, found.views[0]], found.step_mm
        np.testing.assert_array_equal(found.values, again.values)
        assert len(rays) == 30 * FINE
        assert step_mm == pytest.approx(1 / FINE)
        assert rays.min() >= 0
        assert rays.max() <= last
        assert np.abs(np.diff(rays, axis=0)).max() <= step_mm / h + 1e-9
        assert np.abs(np.diff(rays, axis=0)).mean() > 0.1 * step_mm / h
        # The gradient is the same everywhere, thrown back or not.
        assert found.headlight is not None
        inner = found.headlight[1:-1, found.views[0]]
        assert inner.max() <= 1.0
        assert np.median(np.abs(np.diff(inner, axis=0))) < 1e-9


def test_a_level_0_in_pieces_has_a_step_of_its_own_beside_that_of_the_finest_level_that_is_held_whole():
    choices = [StepChoice(0, 0.5, "", in_pieces=True), StepChoice(1, 0.9, ""), StepChoice(2, 2.0, "")]
    assert common_steps([choices]) == RaySampling(
        step_mm=0.9, level_steps=(LevelStep(level=0, step_mm=0.5), LevelStep(level=2, step_mm=2.0))
    )
    same = [StepChoice(0, 0.9, "", in_pieces=True), StepChoice(1, 0.9, "")]
    assert common_steps([same]) == RaySampling(step_mm=0.9)


def test_the_step_of_pieces_is_measured_at_their_own_resolution():
    small = GLES3.model_copy(update={"max_3d_texture_size": 32})
    info = SourceInfo(format="raw", grid=GRID, stored_type="uint8")
    gauge = SlabMeasurer(info)
    gauge.add(waves(3.0))
    measured = gauge.result("0" * 64)
    pieces, whole = (plan_of_one(scene_of(grid={"size": 16}), profile, info, measured) for profile in (small, GLES3))
    assert (pieces.levels[0].index, whole.levels[0].index) == (1, 0)
    assert pieces.rays.step_of(0) == whole.rays.step_of(0) < pieces.rays.step_mm
    plain = plan_of_one(scene_of(), small, info, measured)
    assert plain.rays.step_of(0) == plain.rays.step_mm
