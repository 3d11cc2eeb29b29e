"""What a scan is drawn as of which nobody has said anything."""

from pathlib import Path

import numpy as np
import pytest

from volprep.scan.statistics import Gauge
from volprep.scene.first_look import with_first_look
from volprep.scene.profiles import load_profile
from volprep.scene.scene import Scene
from volprep.truth.strip import strip
from volprep_formats.grid import Grid
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.source import SourceInfo

GLES3 = load_profile("gles3", Path())


def look(values: list[float], unit: str = "", *, labels: bool = False, level_set: bool = False, profile=GLES3):
    voxels = np.array(values, np.float32).reshape(1, 1, -1)
    grid = Grid.of(voxels.shape, (1.0, 1.0, 1.0))
    info = SourceInfo(format="raw", grid=grid, stored_type="float32", unit=unit, level_set=level_set)
    gauge = Gauge(info)
    gauge.add(voxels)
    points = [{"value": 0.0, "colour": "#ffffff", "extinction_per_mm": 0.0}]
    scene = Scene.model_validate(
        {"name": "s", "source": {"path": "x", "labels": labels}, "transfer": [{"name": "none", "points": points}]}
    )
    return with_first_look(scene, profile, info, gauge.result("0" * 64).statistics)


def named(scene: Scene) -> str:
    (transfer,) = scene.transfer
    return transfer.name


def test_each_kind_of_values_gets_a_look_of_its_own() -> None:
    assert named(look([0, 1, 2], labels=True)) == "labels"
    assert named(look([-1000, 0, 1500], "HU")) == "ct-bone"
    assert named(look([-1000, 0, 80], "HU")) == "grey", "no bone in it, so the preset would show nothing"
    assert named(look([-3, 0, 5])) == "signed"
    assert named(look([0, 5])) == "grey"


def test_bones_are_lit_where_the_devices_can() -> None:
    assert look([-1000, 1500], "HU").render.lighting == "headlight"
    assert look([-1000, 1500], "HU", profile=load_profile("gles1", Path())).render.lighting == "none"
    assert look([-3, 5]).render.lighting == "none"


def test_a_level_set_is_a_lit_surface_where_the_devices_can() -> None:
    scene = look([-3, 0, 5], level_set=True)
    assert named(scene) == "surface"
    assert (scene.render.compositing, scene.render.lighting) == ("isosurface", "headlight")
    assert scene.transfer[0].resolved().isovalue == 0.0
    assert named(look([-3, 0, 5], level_set=True, profile=load_profile("gles1", Path()))) == "signed"
    assert named(look([1, 5], level_set=True)) == "grey", "it has no surface"


def test_a_signed_map_shows_nothing_at_0_and_is_as_dense_below_as_above() -> None:
    function = look([-4, 0, 8]).transfer[0].resolved()
    at = {(point.value, point.colour): point.extinction_per_mm for point in function.points}
    values = {value: extinction for (value, _), extinction in at.items()}
    assert values[0.0] == 0.0
    assert values[-4.0] / 4 == pytest.approx(values[8.0] / 8)
    assert len({colour for _, colour in at}) == 2


def test_a_strip_shows_the_colours_of_a_function_over_black() -> None:
    ends = [TransferPoint(value=v, colour=(1.0, 0.0, 0.0), extinction_per_mm=e) for v, e in ((0.0, 0.0), (1.0, 1e6))]
    colours = strip(TransferFunction(name="f", points=tuple(ends)), 3)
    assert colours == [(0, 0, 0), (255, 0, 0), (255, 0, 0)]
