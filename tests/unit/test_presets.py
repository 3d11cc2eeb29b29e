"""What scenes say of transfer functions: presets, places in the range, opacity of a reference length, wrong points."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from plans import plan_of_one

from volprep.scan.statistics import SlabMeasurer
from volprep.scene.points import Measure, ScenePoint
from volprep.scene.presets import load_preset, preset_names
from volprep.scene.profiles import load_profile
from volprep.scene.scene import LightingSettings, Scene, changed, load_scene
from volprep.scene.transfer import SceneTransfer
from volprep.transfer.preclassified import classified_texels, medium_of_texels
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.source import SourceInfo

MEASURE = Measure(low=100.0, high=300.0, diagonal_mm=50.0)
GLES3 = load_profile("gles3", Path())


def transfer(*points, **fields) -> SceneTransfer:
    return SceneTransfer(name="a", points=tuple({"colour": "#ffffff"} | point for point in points), **fields)


def plan(scene_transfer: dict, voxels: np.ndarray):
    info = SourceInfo(format="raw", grid=Grid.of(voxels.shape, (1.0, 1.0, 1.0)), stored_type=voxels.dtype.name)
    gauge = SlabMeasurer(info)
    gauge.add(voxels)
    scene = Scene.model_validate({"name": "s", "source": {"path": "x"}, "transfer": [scene_transfer]})
    return plan_of_one(scene, GLES3, info, gauge.result("0" * 64))


@pytest.mark.parametrize("name", preset_names())
def test_a_preset_is_a_function_that_shows_something_and_says_what(name) -> None:
    preset = load_preset(name)
    function = preset.function(name, MEASURE)
    extinctions = [point.extinction_per_mm for point in function.points]
    assert extinctions[0] == 0.0, "what is below the first point must not be seen"
    assert max(extinctions) > 0.0
    assert 10 < len(preset.shows) < 100
    assert not preset.opaque_points


def test_there_is_a_preset_for_each_kind_of_scan() -> None:
    kinds = {"angiography", "ct-bone", "ct-soft-tissue", "labels", "micro-ct", "mr-head"}
    assert set(preset_names()) == kinds | {"ct-bone-photograph", "mr-head-photograph"}


def test_a_photograph_is_a_preset_with_light_that_is_computed_once_where_the_profile_can_hold_it() -> None:
    scene = Scene.model_validate({"name": "s", "source": {"path": "x"}, "transfer": [{"preset": "ct-bone"}]})
    photograph = scene.with_preset("ct-bone-photograph", GLES3)
    assert load_preset("ct-bone-photograph").points == load_preset("ct-bone").points
    assert (photograph.lighting.baked, photograph.render.lighting) == ("scattering", "none")
    mosaics = scene.with_preset("ct-bone-photograph", load_profile("gles2-2048", Path()))
    assert (mosaics.lighting.baked, mosaics.render.lighting) == ("scattering", "none")
    slices = scene.with_preset("ct-bone-photograph", load_profile("gles1", Path()))
    assert (slices.lighting.baked, slices.render.lighting) == ("none", "none")
    stated = scene.model_copy(update={"lighting": LightingSettings(baked="occlusion")})
    assert stated.with_preset("ct-bone-photograph", GLES3).lighting.baked == "occlusion"


def test_a_preset_has_its_own_name_unless_the_scene_gives_it_one() -> None:
    assert SceneTransfer(preset="ct-bone").name == "ct-bone"
    assert SceneTransfer(preset="ct-bone", name="skeleton").resolved().name == "skeleton"


def test_each_label_has_one_colour_and_background_none() -> None:
    function = SceneTransfer(preset="labels").resolved(MEASURE)
    values = [point.value for point in function.points]
    for label in range(1, 13):
        inside = [p.colour for p in function.points if label - 0.5 <= p.value <= label + 0.5]
        assert function.points[values.index(label - 0.5) + 1].colour in inside
    steps = [point.extinction_per_mm for point in function.points]
    assert steps[0] == 0.0
    assert len(set(steps[1:])) == 1


def test_places_in_the_range_become_values_of_the_scan() -> None:
    function = transfer({"value": 0.25, "extinction_per_mm": 0.1}, values="range").resolved(MEASURE)
    assert function.points[0].value == 150.0


def test_the_range_is_that_of_the_scan_without_its_outliers() -> None:
    voxels = np.random.default_rng(1).integers(100, 201, (40, 40, 40)).astype(np.int16)
    voxels[3, 3, 3] = 30000
    decided = plan({"preset": "micro-ct"}, voxels)
    points = decided.transfer_functions[0].points
    assert points[0].value == pytest.approx(122, abs=1)
    assert points[-1].value == 200.0
    item = next(each for each in decided.items if each.name == "preset micro-ct")
    assert item.reason.endswith("here from 122 to 200")


def test_a_scan_of_one_value_has_a_range_all_the_same() -> None:
    assert plan({"preset": "micro-ct"}, np.full((4, 4, 4), 7, np.uint8)).lookups


def test_opacity_is_that_of_the_reference_length() -> None:
    in_mm = transfer({"value": 0.0, "opacity": 0.3}, reference_mm=2.0).resolved(MEASURE)
    assert in_mm.points[0].extinction_per_mm == pytest.approx(-math.log(0.7) / 2)
    of_scan = transfer({"value": 0.0, "opacity": 0.3}, reference_share=0.1).resolved(MEASURE)
    assert of_scan.points[0].extinction_per_mm == pytest.approx(-math.log(0.7) / 5)


def test_full_opacity_is_clamped_and_the_plan_says_so() -> None:
    points = [{"value": v, "colour": "#ffffff", "opacity": o} for v, o in ((50, 0.0), (100, 1.0))]
    voxels = np.arange(216).reshape(6, 6, 6).astype(np.uint8)
    decided = plan({"name": "a", "points": points, "reference_mm": 0.5}, voxels)
    assert decided.transfer_functions[0].points[1].extinction_per_mm == pytest.approx(16 * math.log(2) / 0.5)
    item = next(each for each in decided.items if each.name == "full opacity in a")
    assert not item.kept
    assert item.reason.startswith("points.1: opacity 1 has no finite extinction")


TRANSFER = """
name = "s"
[source]
path = "x"
[[transfer]]
name = "a"
{lines}
"""
POINT = '{ value = VALUE, colour = "#ffffff", extinction_per_mm = 0.1 }'


def wrong(tmp_path, lines: str) -> str:
    path = tmp_path / "scene.toml"
    path.write_text(TRANSFER.format(lines=lines), encoding="utf-8")
    with pytest.raises(VolprepError) as caught:
        load_scene(path)
    assert caught.value.code == "VP3003"
    return caught.value.summary


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("", "transfer.0: it needs points, or a preset, or a file: one of them"),
        ("points = []", "transfer.0: it needs points, or a preset, or a file: one of them"),
        ('preset = "ct-bone"\nfile = "x.vp"', "one of them"),
        ('preset = "ct-bones"', "transfer.0: preset: there is no ct-bones, only angiography, ct-bone"),
        ("points = [{0}, {2}, {1}]", "points.2: points must ascend: 2.0 stands before 1.0"),
        ("points = [{0}, {1}, {1}, {1}]", "points.3: at most two points may share a value: 1.0 has more"),
        ("points = [{0}, {nan}]", "transfer.0.points.1.value: Input should be a finite number"),
        ("points = [{0}, {inf}]", "transfer.0.points.1.value: Input should be"),
        ("points = [{0}, {1e300}]", "transfer.0.points.1.value: Input should be less than"),
        ('values = "range"\npoints = [{0}, {1.5}]', "transfer.0: points.1: 1.5 is no place in the range"),
        ('points = [{0}, {value = 1, colour = "#fff0000", opacity = 0.5}]', "transfer.0.points.1.colour"),
        (
            'points = [{0}, {value = 1, colour = "#ffffff", opacity = 0.5}]',
            "transfer.0: points.1: an opacity needs reference_mm",
        ),
        (
            'reference_mm = 1.0\npoints = [{value = 1, colour = "#ffffff", opacity = 1.5}]',
            "transfer.0.points.0.opacity: Input should be less than or equal to 1",
        ),
        (
            'reference_mm = 1.0\npoints = [{value = 1, colour = "#ffffff", opacity = 0.5, extinction_per_mm = 1.0}]',
            "transfer.0: points.0: either extinction_per_mm or opacity",
        ),
        (
            'points = [{0}, {value = 1, colour = "#ffffff"}]',
            "transfer.0: points.1: either extinction_per_mm or opacity",
        ),
        (
            'points = [{0}, {value = 1, colour = "#ffffff", extinction_per_mm = inf}]',
            "transfer.0.points.1.extinction_per_mm: Input should be",
        ),
        ("reference_mm = 0.0\npoints = [{0}]", "transfer.0.reference_mm: Input should be greater than 0"),
        ("reference_mm = 1.0\nreference_share = 0.1\npoints = [{0}]", "two reference lengths"),
    ],
)
def test_points_that_are_no_function_are_told_by_their_number(tmp_path, lines, message) -> None:
    for value in ("0", "1", "2", "nan", "inf", "1e300", "1.5"):
        lines = lines.replace("{" + value + "}", POINT.replace("VALUE", str(float(value))))
    assert message in wrong(tmp_path, lines)


def test_points_of_linear_and_srgb_colours_are_told_apart() -> None:
    point = ScenePoint(value=0.0, colour=(0.5, 0.5, 0.5), extinction_per_mm=1.0)
    linear = SceneTransfer(name="a", colour_space="linear", points=(point,)).resolved()
    srgb = SceneTransfer(name="a", points=(point,)).resolved()
    assert linear.points[0].colour[0] == 0.5
    assert srgb.points[0].colour[0] == pytest.approx(0.2140, abs=1e-4)


@pytest.mark.parametrize(
    ("wish", "message"),
    [({"classification": "post"}, "classification: Input should be"), ({"palette_entries": 1}, "palette_entries: ")],
)
def test_a_wrong_wish_of_the_verb_is_told(wish, message) -> None:
    scene = Scene.model_validate({"name": "s", "source": {"path": "x"}, "transfer": [{"preset": "labels"}]})
    with pytest.raises(VolprepError, match=message):
        changed(scene, "render", **wish)


def test_a_wish_of_the_verb_replaces_the_scenes() -> None:
    scene = Scene.model_validate({"name": "s", "source": {"path": "x"}, "transfer": [{"preset": "labels"}]})
    render = changed(scene, "render", classification="palette", palette_entries=None).render
    assert (render.classification, render.palette_entries) == ("palette", 60)
    assert changed(scene, "render", classification=None) == scene


@pytest.mark.parametrize("profile", ["gles2-2048", "gles3"])
def test_a_palette_has_entries_and_no_texture(profile: str) -> None:
    info = SourceInfo(format="raw", grid=Grid.of((4, 4, 4), (1.0, 1.0, 1.0)), stored_type="uint8")
    gauge = SlabMeasurer(info)
    gauge.add(np.arange(64).reshape(4, 4, 4).astype(np.uint8))
    tables = {"transfer": [{"preset": "labels"}], "render": {"classification": "palette"}}
    scene = Scene.model_validate({"name": "s", "source": {"path": "x"}, **tables})
    plan = plan_of_one(scene, load_profile(profile, Path()), info, gauge.result("0" * 64))
    assert not plan.lookups
    assert [(each.transfer, each.entries) for each in plan.palettes] == [("labels", 60)]
    assert not plan.lookups


def test_the_plan_says_what_pre_integration_gains_and_how_large_its_tables_are() -> None:
    info = SourceInfo(format="raw", grid=Grid.of((40, 16, 16), (1.0, 1.0, 1.0)), stored_type="uint8")
    gauge = SlabMeasurer(info)
    z = np.arange(40)[:, None, None] + np.random.default_rng(5).uniform(0, 6, (1, 16, 16))
    gauge.add(np.rint(127 + 120 * np.sin(z / 3)).astype(np.uint8))
    points = [
        {"value": v, "colour": "#ffffff", "extinction_per_mm": e} for v, e in ((99, 0), (99, 2), (103, 2), (103, 0))
    ]
    tables = {
        "transfer": [{"name": "a", "points": points}],
        "render": {"classification": "preintegrated", "step_voxels": 1.0},
    }
    scene = Scene.model_validate({"name": "s", "source": {"path": "x"}, **tables})
    plan = plan_of_one(scene, GLES3, info, gauge.result("0" * 64))
    (table,) = plan.preintegrated
    assert plan.rays.step_mm == 1.0
    item = next(each for each in plan.items if each.name == "pre-integrated table a")
    assert item.size_bytes == table.entries * 4 * 4
    found = [float(each) for each in re.findall(r"RMSE ([\d.e-]+),", item.reason)]
    own, few, many = found
    assert own < many < few
    assert own < few / 10


def classified(**tables) -> Scene:
    base = {"name": "s", "source": {"path": "x"}, "transfer": [{"preset": "labels"}]}
    return Scene.model_validate(base | {"render": {"classification": "preclassified"}} | tables)


def ramp_plan(scene: Scene, profile=GLES3):
    info = SourceInfo(format="raw", grid=Grid.of((9, 8, 8), (1.0, 1.0, 1.0)), stored_type="uint8")
    gauge = SlabMeasurer(info)
    gauge.add((np.arange(576).reshape(9, 8, 8) % 13).astype(np.uint8))
    return plan_of_one(scene, profile, info, gauge.result("0" * 64))


def test_classified_voxels_have_four_channels_and_no_table() -> None:
    decided = ramp_plan(classified())
    assert {(each.format, each.transfer) for each in decided.volumes} == {("rgba8unorm", "labels")}
    assert all(each.reference_mm == decided.volumes[0].reference_mm for each in decided.volumes)
    assert not decided.lookups
    assert [program.classification for program in decided.programs] == ["preclassified"]
    item = next(each for each in decided.items if each.name == "voxels classified by labels")
    assert "the sample of rays is off by RMSE" in item.reason


def test_classified_voxels_are_those_of_one_transfer_function() -> None:
    with pytest.raises(VolprepError, match=r"VP3041 .* cannot have several transfer functions"):
        ramp_plan(classified(transfer=[{"preset": "labels"}, {"preset": "micro-ct"}]))
    with pytest.raises(VolprepError, match=r"VP3041 .* cannot have \[grid\]"):
        ramp_plan(classified(grid={}))


def test_classified_voxels_of_devices_without_3d_textures_fill_a_texel_of_a_mosaic() -> None:
    decided = ramp_plan(classified(), load_profile("gles2-2048", Path()))
    assert {volume.format for volume in decided.volumes} == {"rgba8unorm"}
    layouts = [volume.mosaic for volume in decided.volumes]
    assert {(each.slices_per_texel, each.components_per_voxel) for each in layouts if each} == {(1, 4)}


def test_texels_of_voxels_are_premultiplied_and_give_back_what_they_hold() -> None:
    table = Table(np.array([0.0, 10.0]), np.array([[0.0, 0.5, 1.0], [1.0, 0.5, 0.0]]), np.array([0.0, 2.0]))
    values = np.linspace(0.0, 10.0, 101)
    texels = classified_texels(table, values, 0.5)
    opacity = 1 - np.exp(-0.5 * values / 5)
    assert np.abs(texels[:, 3] / 255 - opacity).max() <= 0.5 / 255 + 1e-12
    assert np.abs(texels[:, 1] / 255 - 0.5 * opacity).max() <= 0.5 / 255 + 1e-12
    colour, extinction = medium_of_texels(texels / 255, 0.5)
    # Half a step of the opacity, over what is left of it, is the error of the optical depth.
    assert (np.abs(extinction - values / 5) * 0.5 <= 0.6 / 255 / (1 - opacity)).all()
    assert np.abs(colour[20:, 1] - 0.5).max() <= 1 / 255 / opacity[20]
    assert not texels[0].any()


def test_an_opaque_texel_is_the_middle_of_what_it_stands_for() -> None:
    _, extinction = medium_of_texels(np.ones((1, 4)), 2.0)
    assert extinction[0] == pytest.approx(np.log(512) / 2)


def test_all_255_labels_have_colours_of_their_own() -> None:
    function = SceneTransfer(preset="labels").resolved(MEASURE)
    at = {}
    for label in range(1, 256):
        (low,) = [p for p in function.points if p.value == label - 0.5][-1:]
        (high,) = [p for p in function.points if p.value == label + 0.5][:1]
        assert low.colour == high.colour
        at[label] = low.colour
    assert len(set(at.values())) == 255
    nearest = min(np.abs(np.subtract(at[a], at[a + 1])).max() for a in range(1, 255))
    assert nearest > 0.1, "neighbours must be told apart"
