"""Bits of a scan that is lit by differences of its codes: a wide range turns gradients in flat parts."""

import numpy as np
import pytest

from volprep.parts.values.decision import choose_values
from volprep.pipeline.build import plan_build
from volprep.plan.item_kinds import LIT_CODES
from volprep.scan.statistics import SlabMeasurer
from volprep.scene.profiles import load_profile
from volprep.scene.request import Request
from volprep.scene.scene import Scene
from volprep_formats.grid import Grid
from volprep_formats.progress import Silent
from volprep_formats.source import SourceInfo

GRID = Grid.of((20, 22, 24), (2.0, 2.0, 2.0))
INFO = SourceInfo(format="raw", grid=GRID, stored_type="int16")
SCENE = {
    "name": "s",
    "source": {"path": "x"},
    "transfer": [
        {
            "name": "object",
            "reference_mm": 1.0,
            "points": [
                {"value": 8000.0, "colour": "#ffffff", "opacity": 0.0},
                {"value": 12000.0, "colour": "#ffffff", "opacity": 0.6},
            ],
        }
    ],
    "render": {"lighting": "headlight"},
}


@pytest.fixture(scope="module")
def measured():
    """Measure a block whose values rise by less than an 8-bit code from voxel to voxel, with one bright voxel."""
    z, y, x = np.indices(GRID.shape_zyx)
    values = np.where(np.minimum(z, y) > 3, 15000 + 80 * z + 100 * y + 90 * x, 0)
    values[10, 10, 10] = 30000
    gauge = SlabMeasurer(INFO)
    gauge.add(values.astype(np.int16))
    return gauge.result("0" * 64)


def chosen(measured, tmp_path, profile="gles3", **changes):
    scene = Scene.model_validate(SCENE | changes)
    functions = tuple(each.resolved() for each in scene.transfer)
    return choose_values(scene, load_profile(profile, tmp_path), INFO, measured, functions)


def test_flat_parts_of_a_wide_range_that_are_lit_by_codes_get_16_bits(measured, tmp_path):
    unlit = chosen(measured, tmp_path, render={"lighting": "none"})
    lit = chosen(measured, tmp_path, lighting={"normals": "central"})
    assert (unlit.quantize.bits, unlit.lit_error) == (8, None)
    assert lit.quantize.bits == 16
    assert lit.narrow_error.rmse > 5 * lit.lit_error.rmse


def test_stored_normals_are_made_from_whole_codes(measured, tmp_path):
    stored = chosen(measured, tmp_path, lighting={"normals": "volume"})
    assert stored.quantize.bits == 16
    assert stored.lit_error.rmse < 0.005


def test_the_choice_says_how_far_lit_rays_are_off_where_there_are_only_8_bits(measured, tmp_path):
    choice = chosen(measured, tmp_path, "gles2-2048", lighting={"normals": "central"})
    assert choice.quantize.bits == 8
    assert choice.lit_error.rmse > 0.01


def test_the_plan_warns_of_normals_that_may_not_be_filtered(tmp_path):
    places = np.indices((14, 16, 18)) / np.array([13, 15, 17]).reshape(3, 1, 1, 1)
    hill = np.exp(-((places - 0.5) ** 2).sum(axis=0) / 0.09)
    np.save(tmp_path / "scan.npy", np.rint(1000 * hill).astype(np.int16))
    points = [
        {"value": value, "colour": "#ffffff", "extinction_per_mm": value / 2000 - 0.05} for value in (100.0, 900.0)
    ]

    def warned(code):
        scene = {
            "name": "s",
            "source": {"path": str(tmp_path / "scan.npy"), "array": {"spacing_mm_zyx": [1.2, 1.0, 0.9]}},
            "transfer": [{"name": "t", "points": points}],
            "render": {"lighting": "headlight"},
            "normals": {"code": code},
        }
        plan = plan_build(Request(Scene.model_validate(scene), load_profile("gles3", tmp_path), tmp_path), Silent())
        return [(item.name, "biased8" in item.reason) for item in plan.items if item.kind == LIT_CODES]

    assert warned("biased8") == []
    assert warned("oct8") == [("light from oct8 normals", True)]
    assert warned("oct12") == [("light from oct12 normals", True)]
