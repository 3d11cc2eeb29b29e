"""Codes and tables of projections: a pixel shows one value, and each value of the scan may be one."""

import numpy as np
import pytest

from volprep.parts.values.decision import choose_values
from volprep.scan.statistics import SlabMeasurer
from volprep.scene.profiles import load_profile
from volprep.scene.scene import Scene
from volprep_formats.grid import Grid
from volprep_formats.source import SourceInfo

GRID = Grid.of((24, 24, 24), (1.0, 1.0, 1.0))
STEEP = [
    {"value": 0.0, "colour": "#204060", "extinction_per_mm": 0.02},
    {"value": 2000.0, "colour": "#204060", "extinction_per_mm": 0.02},
    {"value": 2008.0, "colour": "#ffffff", "extinction_per_mm": 3.0},
    {"value": 4000.0, "colour": "#ffffff", "extinction_per_mm": 3.0},
]


def chosen(compositing, folder, **settings):
    """Return the codes of a scan whose few bright voxels lie on a steep part of the function."""
    values = np.full(GRID.shape_zyx, 300, np.uint16)
    values[7, 9, 5], values[13, 3, 8] = 2004, 4000
    scene = Scene.model_validate(
        {
            "name": "s",
            "source": {"path": "x"},
            "transfer": [{"name": "t", "points": STEEP, "reference_mm": 1.0}],
            "render": {"compositing": compositing},
            **settings,
        }
    )
    info = SourceInfo(format="raw", grid=GRID, stored_type="uint16")
    gauge = SlabMeasurer(info)
    gauge.add(values)
    functions = tuple(each.resolved() for each in scene.transfer)
    return choose_values(scene, load_profile("gles3", folder), info, gauge.result("0" * 64), functions)


@pytest.mark.parametrize("compositing", ["maximum", "minimum"])
def test_codes_keep_the_largest_error_of_any_value(compositing, tmp_path):
    assert chosen(compositing, tmp_path).quantize.bits == 16


def test_tables_keep_the_largest_error_of_any_value(tmp_path):
    found = chosen("maximum", tmp_path, quantize={"bits": 16})

    assert found.entries > 256
    assert found.error.maximum < 0.125


def test_the_plan_tells_the_largest_error_of_any_value(tmp_path):
    assert chosen("maximum", tmp_path, quantize={"bits": 8}).error.maximum > 0.25
