"""Levels that keep thin things by default: raised, refined through the renderer, and chosen along aimed rays."""

import numpy as np
import pytest

from tests.levels_study.phantoms import vessel_tree
from volprep.parts.levels.aimed import aimed_lines
from volprep.parts.levels.appearance import SeenBlocks
from volprep.parts.levels.choose_level import Chooser
from volprep.parts.levels.level_input import LevelInput, level_slices
from volprep.parts.levels.level_results import _refused
from volprep.parts.levels.light import badness
from volprep.parts.levels.rays import ray_counts, sample_level
from volprep.parts.levels.refined import AUTO, RefineBudget, RefineRays, refine_lines
from volprep.parts.levels.refining import refinements
from volprep.parts.levels.stage import CANDIDATES
from volprep.scan.in_memory import InMemory
from volprep_formats.grid import Grid

FACTORS = (4, 4, 4)
TABLE = np.zeros((256, 4))
TABLE[120:, :3] = (0.9, 0.2, 0.1)
TABLE[120:, 3] = np.minimum(np.arange(136) * 0.03, 1.2)
FILTERS = ("maximum", "refined")


@pytest.fixture(scope="module")
def scan() -> LevelInput:
    voxels = vessel_tree(36, 4)[:33, :, :35]
    return LevelInput(
        InMemory.of(np.ascontiguousarray(voxels)), Grid.of(voxels.shape, (1.0, 1.0, 1.0)), {"vessels": TABLE}
    )


def level_of(scan: LevelInput, name) -> np.ndarray:
    return np.concatenate([slices for slices, _ in level_slices(scan, name, FACTORS)])


def test_raised_is_halfway_from_the_fit_to_the_maximum(scan) -> None:
    fitted, high = (level_of(scan, name).astype(int) for name in ("appearance", "maximum"))
    assert np.array_equal(level_of(scan, "raised"), (fitted + high + 1) // 2)


def test_by_default_vessels_keep_their_light(scan, tmp_path) -> None:
    chooser = Chooser(scan, adapt=True, levels=[FACTORS], budget=AUTO)
    choice, _ = chooser.choose(2, FACTORS, CANDIDATES, tmp_path.joinpath, lambda _: None)
    found = {(trial.filter, trial.table): trial for trial in choice.trials}
    assert choice.filter == "refined"
    best = found["refined", "adapted"]
    assert 0.8 < best.kept_light < 1.3
    assert found["box", "adapted"].kept_light < 0.3
    for name in ("box", "appearance", "maximum", "feature-preserving", "raised"):
        assert best.seen_rmse < found[name, "adapted"].seen_rmse, name


def test_a_refined_level_is_the_same_each_time_and_has_voxels_brighter_than_all_of_their_cell(scan, tmp_path) -> None:
    made = []
    for _ in range(2):
        chooser = Chooser(scan, adapt=True, levels=[FACTORS], budget=RefineBudget(fine=10**6, coarse=5 * 10**6))
        assert chooser.refines(FACTORS)
        _, codes = chooser.choose(2, FACTORS, ("refined",), tmp_path.joinpath, lambda _: None)
        made.append(codes.read_slab(0, codes.shape_zyx[0]).copy())
    assert np.array_equal(made[0], made[1])
    assert (made[0].astype(int) - level_of(scan, "maximum")).max() > 10
    assert not np.array_equal(made[0], level_of(scan, "raised"))


def test_a_refined_level_that_is_worse_in_pictures_is_not_taken(tmp_path) -> None:
    voxels, factors = vessel_tree(40, 3), (8, 8, 8)
    scan = LevelInput(InMemory.of(voxels), Grid.of(voxels.shape, (1.0, 1.0, 1.0)), {"vessels": TABLE})
    chooser = Chooser(scan, adapt=True, levels=[factors], budget=AUTO)
    choice, _ = chooser.choose(3, factors, ("box", "maximum", "refined"), tmp_path.joinpath, lambda _: None)
    along_aimed_rays = {name: min(badness(t) for t in choice.trials if t.filter == name) for name in FILTERS}
    assert along_aimed_rays["refined"] < along_aimed_rays["maximum"]
    assert choice.filter == "maximum"
    assert choice.refused.refined > choice.refused.other
    assert _refused(choice) == (
        f"; refined, it is {choice.refused.refined:.3g} from it in pictures, "
        f"and {choice.refused.other:.3g} with this filter"
    )


def test_a_level_beyond_the_budget_is_not_refined(scan, tmp_path) -> None:
    chooser = Chooser(scan, adapt=True, levels=[FACTORS], budget=RefineBudget(fine=1000, coarse=1000))
    assert not chooser.refines(FACTORS)
    choice, _ = chooser.choose(2, FACTORS, ("raised", "refined"), tmp_path.joinpath, lambda _: None)
    assert {trial.filter for trial in choice.trials} == {"raised"}


def test_what_a_budget_has_left_goes_to_more_rays_once_each_level_has_its_share() -> None:
    grid = Grid.of((48, 48, 48), (1.0, 1.0, 1.0))
    blocks = SeenBlocks(np.ones((12, 12, 12), np.bool_), 4)
    coarse, fine = (4, 4, 4), (2, 2, 2)

    def rays(samples: int, levels: list[tuple[int, int, int]]) -> dict[tuple[int, int, int], int]:
        chosen = refine_lines(grid, blocks, levels, 1, RefineBudget(fine=samples, coarse=10**9))
        taken = sum(int(ray_counts(each.lines.lengths_mm, grid.spacing_mm_zyx).sum()) for each in chosen.values())
        assert taken < 1.05 * samples
        return {factors: len(each.lines.lengths_mm) for factors, each in chosen.items()}

    voxels = 12**3
    assert rays(12 * 10**6, [coarse]) == {coarse: 40 * voxels}
    both = rays(16 * 10**6, [fine, coarse])
    assert both[coarse] == 24 * voxels
    assert 6 * 8 * voxels < both[fine] < 24 * 8 * voxels


def test_a_level_that_gets_too_few_rays_follows_those_of_the_coarser_one(scan) -> None:
    blocks = scan.looks.seen_blocks
    coarse, fine = (4, 4, 4), (2, 2, 2)
    alone = refine_lines(scan.grid, blocks, [coarse], 1, RefineBudget(fine=10**7, coarse=10**9))
    samples = int(ray_counts(alone[coarse].lines.lengths_mm, scan.grid.spacing_mm_zyx).sum())
    budget = RefineBudget(fine=samples + samples // 40, coarse=10**9)
    chosen = refine_lines(scan.grid, blocks, [coarse, fine], 1, budget)
    assert chosen[fine].shared > len(chosen[fine].lines.lengths_mm)
    found = refinements(scan, [coarse, fine], budget, adapt=True)
    assert len(found[fine].lines.lengths_mm) == len(chosen[fine].lines.lengths_mm) + chosen[fine].shared
    along = sample_level(scan.volume, scan.grid.spacing_mm_zyx, found[fine].lines)
    assert np.array_equal(along.light(TABLE), found[fine].lights["vessels"])


def test_a_level_follows_as_many_rays_of_the_coarser_one_as_there_are(scan, monkeypatch) -> None:
    monkeypatch.setattr("volprep.parts.levels.rays.MOST_SAMPLES", 60_000)
    levels = [(8, 8, 8), (4, 4, 4)]
    budget = RefineBudget(fine=500_000, coarse=10**9)
    chosen = refine_lines(scan.grid, scan.looks.seen_blocks, levels, 1, budget)
    coarse, fine = (chosen[factors] for factors in levels)
    assert fine.shared > len(coarse.lines.lengths_mm)
    found = refinements(scan, levels, budget, adapt=True)[levels[1]]
    assert len(found.lines.lengths_mm) == len(fine.lines.lengths_mm) + len(coarse.lines.lengths_mm)


def test_a_level_of_few_rays_follows_coarser_ones_and_takes_all_steps_where_there_is_room() -> None:
    grid = Grid.of((48, 48, 48), (1.0, 1.0, 1.0))
    blocks = SeenBlocks(np.ones((12, 12, 12), np.bool_), 4)
    coarse, fine = (4, 4, 4), (2, 2, 2)

    def chosen(samples: int, for_few: int = 0) -> dict[tuple[int, int, int], RefineRays]:
        budget = RefineBudget(fine=20 * 10**6, coarse=samples, coarse_for_few=for_few)
        return refine_lines(grid, blocks, [coarse, fine], 1, budget)

    ample = chosen(10**9)
    own = len(ample[fine].lines.lengths_mm) / (24**3)
    assert 6 < own < 20
    assert 0 < ample[fine].shared <= len(ample[coarse].lines.lengths_mm)
    assert ample[fine].rounds == ample[coarse].rounds
    tight, extra = chosen(32 * 10**6), chosen(32 * 10**6, for_few=10**9)
    assert tight[fine].shared < ample[fine].shared
    assert sum(tight[fine].rounds) < sum(ample[fine].rounds)
    assert (extra[fine].shared, extra[fine].rounds) == (ample[fine].shared, ample[fine].rounds)
    assert len(extra[coarse].lines.lengths_mm) == len(tight[coarse].lines.lengths_mm)


def test_a_level_of_few_rays_may_take_more_samples_of_level_0_if_it_is_refined_without_them() -> None:
    grid = Grid.of((48, 48, 48), (1.0, 1.0, 1.0))
    blocks = SeenBlocks(np.ones((12, 12, 12), np.bool_), 4)
    coarse, fine = (4, 4, 4), (2, 2, 2)

    def rays(samples: int, for_few: int) -> dict[tuple[int, int, int], int]:
        budget = RefineBudget(fine=samples, coarse=10**9, fine_for_few=for_few)
        chosen = refine_lines(grid, blocks, [coarse, fine], 1, budget)
        return {factors: len(each.lines.lengths_mm) for factors, each in chosen.items()}

    usual, more = rays(20 * 10**6, 0), rays(20 * 10**6, 5 * 10**6)
    assert more[coarse] == usual[coarse]
    assert usual[fine] * 1.2 < more[fine] <= 24 * 24**3
    assert rays(4 * 10**6, 10**8) == rays(4 * 10**6, 0)


def test_one_slice_has_as_many_rays_for_each_of_its_voxels_as_other_volumes() -> None:
    grid = Grid.of((1, 96, 96), (2.0, 1.0, 1.0))
    blocks = SeenBlocks(np.ones((1, 24, 24), np.bool_), 4)
    flat = refine_lines(grid, blocks, [(1, 2, 2)], 1, RefineBudget(fine=10**9, coarse=10**10))
    assert len(flat[1, 2, 2].lines.lengths_mm) == 24 * 48**2


def test_aimed_rays_pass_the_block_that_is_seen() -> None:
    grid = Grid.of((12, 10, 14), (1.0, 2.0, 0.5))
    seen = np.zeros((6, 5, 7), np.bool_)
    seen[4, 1, 5] = True
    lines = aimed_lines(grid, SeenBlocks(seen, 2), 0.0, 300, seed=3)
    # The middle of the block in millimetres, x first, and the distance of its corners from there.
    middle, radius = np.array([5.5, 6.0, 9.0]), np.sqrt(0.5**2 + 2.0**2 + 1.0**2)
    along = ((middle - lines.starts_mm_xyz) * lines.directions_xyz).sum(axis=1)
    nearest = lines.starts_mm_xyz + along[:, None] * lines.directions_xyz
    assert len(lines.lengths_mm) > 290
    assert (np.linalg.norm(nearest - middle, axis=1) <= radius + 1e-9).all()


def test_nothing_to_aim_at_gives_no_rays() -> None:
    lines = aimed_lines(Grid.of((4, 4, 4), (1.0, 1.0, 1.0)), SeenBlocks(np.zeros((4, 4, 4), bool), 1), 1.0, 9, 1)
    assert len(lines.lengths_mm) == 0
