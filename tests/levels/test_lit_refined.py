"""Levels refined through lit rays, on a folded body."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import ndimage

from volprep.compositing import COMPOSITINGS
from volprep.parts.levels.cut_faces import cut_face_lines
from volprep.parts.levels.level_input import LevelInput, level_slices
from volprep.parts.levels.level_results import _refined_lit
from volprep.parts.levels.lit_refined import LIT_AUTO, LitBudget, LitLevels
from volprep.parts.levels.rays import random_lines
from volprep.parts.levels.rendered_rays import RaySight, SeenLevels
from volprep.parts.levels.stage import _candidates
from volprep.parts.levels.stage import _refined_lit as refined_at_stage
from volprep.plan.level_choice import LevelChoice, PictureErrors
from volprep.plan.records import LevelPlan
from volprep.scan.in_memory import InMemory
from volprep.transfer.lookup import lookup_table
from volprep_formats.grid import Grid
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint

FACTORS = (2, 2, 2)
SHAPE = (28, 26, 27)
PLAN = LevelPlan(channel="scan", index=1, factors_zyx=FACTORS, shape_zyx=(14, 13, 14), filter="auto")
WINDOW = (0.0, 255.0)
FUNCTION = TransferFunction(
    name="body",
    points=(
        TransferPoint(value=60.0, colour=(0.6, 0.4, 0.3), extinction_per_mm=0.0),
        TransferPoint(value=150.0, colour=(0.9, 0.8, 0.7), extinction_per_mm=0.8),
    ),
)
SIGHT = RaySight((FUNCTION,), WINDOW, "linear", COMPOSITINGS["emission-absorption"], lit=True)


@dataclass(frozen=True)
class Body:
    scan: LevelInput
    level: InMemory

    def error(self, volume: InMemory) -> float:
        """The lit light of other rays, by samples and gradients in numpy."""
        seen = SeenLevels(self.scan, SIGHT, random_lines(self.scan.grid, 2000, seed=99))
        return seen.errors(volume, FACTORS, ())[0].rmse


@pytest.fixture(scope="module")
def body():
    folds = ndimage.gaussian_filter(np.random.default_rng(4).standard_normal(SHAPE), 1.5)
    z, y, x = np.indices(folds.shape) - 13.0
    inside = 10.0 - np.sqrt(z**2 + y**2 + x**2) + 2.0 * folds / folds.std()
    voxels = np.clip(110 + 40 * inside, 0, 255).astype(np.uint8)
    grid = Grid.of(voxels.shape, (1.0, 1.0, 1.0))
    scan = LevelInput(InMemory.of(voxels), grid, {"body": lookup_table(FUNCTION, WINDOW, 256)})
    level = np.concatenate([slices for slices, _ in level_slices(scan, "box", FACTORS)])
    return Body(scan, InMemory.of(level))


@pytest.fixture(scope="module")
def lit(body):
    return LitLevels(body.scan, [FACTORS], LIT_AUTO)


def test_a_level_comes_nearer_to_the_lit_light_of_level_0_along_other_rays_too(body, lit) -> None:
    level, errors = lit.refined(body.level, FACTORS, ())
    assert level.dtype == np.uint8
    assert errors.refined < 0.8 * errors.other
    assert body.error(InMemory.of(level)) < 0.95 * body.error(body.level)


def test_the_file_of_a_level_is_only_replaced_by_a_nearer_one(body, tmp_path) -> None:
    class Refines:
        def __init__(self, refined: float) -> None:
            self.errors = PictureErrors(refined=refined, other=0.2)

        def refines(self, _) -> bool:
            return True

        def refined(self, volume, *_):
            return np.full(volume.shape_zyx, 7, np.uint8), self.errors

    class Seen:
        def errors(self, *_):
            return ()

    choice = LevelChoice(level=1, filter="refined")
    for refined, is_replaced, text in (
        (0.1, True, "; refined through lit rays, it is 0.1 from it in lit pixels; before, 0.2"),
        (0.3, False, "; refined through lit rays, it is 0.3 from it in lit pixels, and is not taken; before, 0.2"),
    ):
        codes = InMemory(tmp_path / "level.raw", body.level.shape_zyx, body.level.dtype, body.level.voxels)
        codes.path.write_bytes(b"before")
        made = refined_at_stage(choice, codes, PLAN, Seen(), Refines(refined))
        assert (codes.path.read_bytes() == bytes([7]) * body.level.voxels.size) == is_replaced
        assert _refined_lit(made) == text


def test_a_level_beyond_the_budget_is_told(body) -> None:
    small = LitLevels(body.scan, [FACTORS], LitBudget(fine=1000, coarse=10**9))
    assert not small.refines(FACTORS)
    made = refined_at_stage(LevelChoice(level=1, filter="refined"), body.level, PLAN, None, small)
    assert _refined_lit(made) == "; refining it through lit rays is beyond the budget"


def test_a_level_comes_nearer_straight_at_a_face_that_cuts_the_body_open(body) -> None:
    voxels = np.ascontiguousarray(body.scan.volume.read_slab(0, SHAPE[0])[14:])
    grid = Grid.of(voxels.shape, (1.0, 1.0, 1.0))
    scan = LevelInput(InMemory.of(voxels), grid, body.scan.tables)
    before = InMemory.of(np.concatenate([slices for slices, _ in level_slices(scan, "box", FACTORS)]))
    after, _ = LitLevels(scan, [FACTORS], LIT_AUTO).refined(before, FACTORS, ())
    lines = cut_face_lines(grid, scan.looks.seen_blocks, FACTORS, 8, seed=98)
    assert len(lines.lengths_mm) > 500
    seen = SeenLevels(scan, SIGHT, lines)
    error, was = (seen.errors(each, FACTORS, ())[0].rmse for each in (InMemory.of(after), before))
    # Along rays in all directions alone 0.71.
    assert error < 0.6 * was


def test_the_coarsest_level_comes_first_where_the_budget_is_small(body) -> None:
    coarse = (4, 4, 4)
    lit = LitLevels(body.scan, [FACTORS, coarse], LitBudget(fine=10**9, coarse=700_000))
    assert lit.refines(coarse)
    assert not lit.refines(FACTORS)


def test_levels_share_the_rays_whose_light_in_level_0_is_known(body) -> None:
    coarse = (4, 4, 4)
    for levels in ([FACTORS], [FACTORS, coarse]):
        # 8000 rays of 54 samples are enough for either level.
        lit = LitLevels(body.scan, levels, LitBudget(fine=700_000, coarse=10**9))
        assert all(map(lit.refines, levels))


def candidates(refines: LitLevels | None, **changes):
    shared = SimpleNamespace(compositing="emission-absorption")
    plan = SimpleNamespace(is_classified=False, part=lambda _: None, shared=shared)
    return _candidates(PLAN.model_copy(update=changes), plan, refines)


def test_unlit_rays_refine_only_what_lit_rays_do_not_unless_that_is_to_be_thorough(lit) -> None:
    def is_tried(refines: LitLevels | None, **changes) -> bool:
        return "refined" in candidates(refines, **changes)

    assert not is_tried(lit, lit=True)
    assert is_tried(lit, lit=True, refine="thorough")
    assert is_tried(lit, lit=True, factors_zyx=(4, 4, 4))
    assert is_tried(None, lit=True)
    assert is_tried(lit, lit=False)


def test_fewer_filters_are_tried_where_lit_rays_refine_a_level(lit) -> None:
    assert candidates(lit, lit=True) == ("box", "least-squares", "appearance")
    for more in ({"refine": "thorough"}, {"refine": "none"}, {"factors_zyx": (4, 4, 4)}, {"lit": False}):
        assert len(candidates(lit, **{"lit": True} | more)) > 3
