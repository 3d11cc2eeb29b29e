"""Steps of coarser levels keep their promise on the level as it is, and rays that see nothing are no evidence."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tiny_packages import ES3, function, tiny_package

from tests.levels_study.phantoms import vessel_tree
from volprep.compositing import COMPOSITINGS
from volprep.parts.levels import level_steps
from volprep.parts.levels.level_input import LevelInput, level_slices
from volprep.parts.levels.level_steps import LevelSteps
from volprep.parts.programs.patch_rays import PatchRays
from volprep.parts.programs.step_bench import STEP_SHARE, StepBench, longest_step
from volprep.plan.level_choice import AdaptedTable
from volprep.render.renderer import Renderer
from volprep.scan.in_memory import InMemory
from volprep.transfer.lookup import lookup_table
from volprep.truth.camera import standard_views
from volprep.truth.oracle import oracle_picture
from volprep.truth.seen import seen_pixels
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Tolerance

FACTORS = (2, 2, 2)
TOLERANCE = Tolerance(rmse=0.02, maximum=0.5)
VESSELS = function((110.0, (0.7, 0.1, 0.1), 0.0), (170.0, (0.9, 0.3, 0.2), 1.5), (255.0, (1.0, 0.9, 0.8), 2.0))
WINDOW = (0.0, 255.0)


@pytest.fixture(scope="module")
def scan() -> LevelInput:
    voxels = vessel_tree(40, 5)
    grid = Grid.of(voxels.shape, (1.0, 1.0, 1.0))
    return LevelInput(InMemory.of(voxels), grid, {VESSELS.name: lookup_table(VESSELS, WINDOW, 256)})


@pytest.fixture(scope="module")
def level(scan) -> np.ndarray:
    return np.concatenate([slices for slices, _ in level_slices(scan, "raised", FACTORS)])


def steps_of(scan) -> LevelSteps:
    compositing = COMPOSITINGS["emission-absorption"]
    return LevelSteps(scan, WINDOW, (VESSELS,), compositing, is_segments=False, tolerance=TOLERANCE)


def test_the_step_of_a_level_of_thin_vessels_is_as_exact_as_it_says(scan, level, tmp_path) -> None:
    step = steps_of(scan).measured(InMemory.of(level), FACTORS, ())
    assert step is not None
    grid = scan.grid.coarser(FACTORS)
    package = tiny_package(tmp_path / "p", level, VESSELS, ES3, grid=grid, step_mm=step.step_mm)
    errors = []
    for view in ("anterior-left", "left", "superior"):
        box_from_clip = standard_views(grid)[view].box_from_clip(grid, 1.0)
        truth = oracle_picture(Volume(level, grid), VESSELS, box_from_clip, (80, 80), tolerance=1e-6).rgba
        with Renderer(package, target="rgba32f") as renderer:
            drawn, longer = (renderer.render(box_from_clip, (80, 80), times * step.step_mm) for times in (1, 3))
        seen = seen_pixels(drawn, truth)
        errors.append([np.sqrt(np.mean((each - truth)[seen] ** 2)) for each in (drawn, longer)])
    worst, of_longer = np.max(errors, axis=0)
    assert worst <= STEP_SHARE * TOLERANCE.rmse
    assert of_longer > STEP_SHARE * TOLERANCE.rmse, "three times the step would do"


SOFT = function((60.0, (0.7, 0.1, 0.1), 0.0), (200.0, (0.9, 0.3, 0.2), 1.5), (255.0, (1.0, 0.9, 0.8), 2.0))


def flat_face(height: float, tolerance: Tolerance) -> tuple[LevelSteps, np.ndarray]:
    below = np.rint(np.clip((height - np.arange(20.0)) / 2.0, 0.0, 1.0) * 255.0).astype(np.uint8)
    level = np.ascontiguousarray(np.broadcast_to(below[:, None, None], (20, 20, 20)))
    fine = level.repeat(2, 0).repeat(2, 1).repeat(2, 2)
    grid = Grid.of(fine.shape, (1.0, 1.0, 1.0))
    scan = LevelInput(InMemory.of(fine), grid, {SOFT.name: lookup_table(SOFT, WINDOW, 256)})
    return replace(steps_of(scan), functions=(SOFT,), tolerance=tolerance), level


def from_above(steps: LevelSteps, level: np.ndarray, step_mm: float, folder: Path) -> float:
    """Return the error of a step in the view on a face."""
    grid = steps.scan.grid.coarser(FACTORS)
    box_from_clip = standard_views(grid)["superior"].box_from_clip(grid, 1.0)
    truth = oracle_picture(Volume(level, grid), SOFT, box_from_clip, (16, 16), tolerance=1e-6).rgba
    package = tiny_package(folder / "p", level, SOFT, ES3, grid=grid, step_mm=step_mm)
    with Renderer(package, target="rgba32f") as renderer:
        drawn = renderer.render(box_from_clip, (16, 16))
    seen = seen_pixels(drawn, truth)
    assert seen.any()
    return float(np.sqrt(np.mean((drawn - truth)[seen] ** 2)))


def test_a_flat_face_keeps_its_promise_in_the_view_that_meets_it_in_step(tmp_path) -> None:
    steps, level = flat_face(13.2, TOLERANCE)
    step = steps.measured(InMemory.of(level), FACTORS, ())
    assert step is not None
    assert from_above(steps, level, step.step_mm, tmp_path) <= STEP_SHARE * TOLERANCE.rmse


def test_an_error_close_to_the_promise_is_measured_along_finer_samples(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(level_steps, "_MARGIN", 10.0)  # leaves the choice to the rays of the sides
    allowed = 0.0185
    steps, level = flat_face(13.6, Tolerance(rmse=allowed / STEP_SHARE, maximum=1.0))
    step = steps.measured(InMemory.of(level), FACTORS, ())
    assert step is not None
    assert from_above(steps, level, step.step_mm, tmp_path) <= allowed


def test_the_table_of_the_level_counts(scan, level) -> None:
    own = scan.tables[VESSELS.name].copy()
    own[:, 3] *= 0.05
    rows = tuple((r, g, b, extinction) for r, g, b, extinction in own.tolist())
    steps, codes = steps_of(scan), InMemory.of(level)
    faint = steps.measured(codes, FACTORS, [AdaptedTable(transfer=VESSELS.name, entries=rows)])
    usual = steps.measured(codes, FACTORS, ())
    assert faint is not None
    assert usual is not None
    assert faint.step_mm > usual.step_mm


def test_a_level_that_shows_nothing_measures_nothing(scan, level) -> None:
    assert steps_of(scan).measured(InMemory.of(np.zeros_like(level)), FACTORS, ()) is None


def test_rays_that_see_nothing_are_no_evidence() -> None:
    rays = PatchRays(np.zeros((64, 10)), 0.125, (slice(0, 10),))
    bench = StepBench(COMPOSITINGS["emission-absorption"], [Table.exact(VESSELS)], [rays], is_segments=False)
    found = longest_step(bench, 1.0, TOLERANCE, 0.5)
    assert found.voxels == 0.5
    assert "no ray of a sample sees anything" in found.reason
    assert not found.is_beyond


def test_a_step_that_no_length_keeps_is_the_finest_and_says_so() -> None:
    values = np.where(np.random.default_rng(2).random((512, 40)) < 0.05, 200.0, 0.0)
    rays = PatchRays(values, 0.125, (slice(0, 40),))
    bench = StepBench(COMPOSITINGS["emission-absorption"], [Table.exact(VESSELS)], [rays], is_segments=False)
    found = longest_step(bench, 1.0, Tolerance(rmse=1e-6, maximum=1e-5), 0.5)
    assert found.voxels == 0.125
    assert found.reason.endswith("no step that was tried keeps it")
    assert found.is_beyond


def test_a_level_that_is_off_itself_takes_longer_steps(scan, level) -> None:
    steps, codes = steps_of(scan), InMemory.of(level)
    exact, rough = (steps.measured(codes, FACTORS, (), off) for off in (0.0, 0.3))
    assert rough.step_mm > exact.step_mm
    assert "a quarter of the tolerance" in exact.reason
    assert "far off" in rough.reason


def test_no_level_is_drawn_beyond_the_tolerance_however_far_it_is_from_level_0(scan, level) -> None:
    steps, codes = steps_of(scan), InMemory.of(level)
    wrong, useless = (steps.measured(codes, FACTORS, (), off) for off in (TOLERANCE.rmse / STEP_SHARE, 0.9))
    assert useless.step_mm == wrong.step_mm
    assert f"the tolerance, for the level itself is far off (RMSE {TOLERANCE.rmse:.2g}" in useless.reason


def disc() -> LevelInput:
    _, y, x = np.indices((1, 24, 24)) + 0.5
    values = np.rint(np.clip(250.0 - 20.0 * np.hypot(y - 12.0, x - 12.0), 0.0, 255.0)).astype(np.uint8)
    return LevelInput(InMemory.of(values), Grid.of(values.shape, (1.0, 1.0, 1.0)), {DISC.name: TABLE})


DISC = function((0.0, (0.2, 0.5, 0.9), 0.0), (250.0, (1.0, 0.8, 0.5), 1.0))
TABLE = lookup_table(DISC, WINDOW, 256)


def test_the_step_of_a_single_slice_holds_for_rays_that_run_along_it() -> None:
    scan, factors = disc(), (1, 4, 4)
    compositing = COMPOSITINGS["emission-absorption"]
    steps = LevelSteps(scan, WINDOW, (DISC,), compositing, is_segments=False, tolerance=Tolerance(rmse=0.01))
    lengths_mm = [float(group.lines.lengths_mm[0]) for group in steps._groups(factors, 96.0)]
    assert min(lengths_mm) < 1.2
    assert max(lengths_mm) > 20.0
    assert len({round(each, 3) for each in lengths_mm}) >= 5


def test_where_samples_are_lit_the_step_of_a_level_is_measured_with_light(scan, level) -> None:
    allowed = replace(steps_of(scan), tolerance=Tolerance(rmse=0.04, maximum=0.5))
    unlit, lit = (replace(allowed, lit=each).measured(InMemory.of(level), FACTORS, ()) for each in (False, True))
    assert lit.step_mm < unlit.step_mm
