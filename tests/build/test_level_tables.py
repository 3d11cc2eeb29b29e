"""Packages whose levels have lookup tables of their own: what is written, what is drawn, and what the plan says."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scene_builds

import volprep
from tests.support.thin_phantom import SPACING_MM_ZYX, thin_things
from volprep.parts.levels.stage import CANDIDATES
from volprep.pipeline.origin import read_origin
from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep.truth.decoded import level_volume, table_function
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.package.tables import table_for

SCENE = """
name = "thin"
profile = "{profile}"
{top}
[source]
path = "thin.raw"
[source.raw]
shape_zyx = {shape}
dtype = "uint8"
spacing_mm_zyx = {spacing}
[pyramid]
coarsest_longest_axis = 16
filter = "{filter}"
[[transfer]]
name = "veil"
points = [
    {{ value = 40.0, colour = "#33508a", extinction_per_mm = 0.0 }},
    {{ value = 90.0, colour = "#6680c0", extinction_per_mm = 0.006 }},
    {{ value = 150.0, colour = "#e07040", extinction_per_mm = 0.1 }},
    {{ value = 220.0, colour = "#ffe9a0", extinction_per_mm = 0.7 }},
]
"""


def built(folder, profile="gles3", made_by="auto", top="") -> Package:
    thin_things().tofile(folder / "thin.raw")
    scene = folder / "thin.toml"
    shape, spacing = list(thin_things().shape), list(SPACING_MM_ZYX)
    scene.write_text(SCENE.format(profile=profile, shape=shape, spacing=spacing, filter=made_by, top=top))
    return scene_builds.built(scene, folder / "thin.volpkg")


@pytest.fixture(scope="module", params=["gles3", pytest.param("gles2-2048", marks=pytest.mark.long)])
def package(tmp_path_factory, request) -> Package:
    return built(tmp_path_factory.mktemp(request.param), request.param)


@pytest.mark.long
def test_levels_are_made_by_what_is_nearest_and_the_plan_says_so(package) -> None:
    coarse = [level for level in package.manifest.levels if level.index > 0]
    items = {item.name: item for item in package.manifest.plan}
    assert coarse
    for level in coarse:
        reason = items[f"filter of level {level.index}"].reason
        assert reason.startswith(f"{level.filter}: ")
        assert all(name in reason for name in ("box", "median", "least-squares", "appearance"))
        table = table_for(package.manifest.textures, "transfer", "veil", level.index)
        assert table is not None
        assert table.level == level.index
        assert items[f"lookup table veil of level {level.index}"].files == (table.file,)
    assert check(package.path) == []


@pytest.mark.long
def test_a_level_is_drawn_with_its_own_table(package) -> None:
    level = package.manifest.levels[-1]
    volume = level_volume(package, level.index)
    camera = standard_views(package.manifest.levels[0].grid)["anterior-left"]
    view = camera.box_from_clip(volume.grid, 1.0)
    pictures = [
        oracle_picture(volume, function, view, (64, 64)).rgba
        for function in (table_function(package, "veil", level.index), table_function(package, "veil", 0))
    ]
    with Renderer(package, level=level.index) as renderer:
        drawn = renderer.render(view, (64, 64), min(package.manifest.levels[0].grid.spacing_mm_zyx) / 2)
    own, common = (float(np.sqrt(np.mean((drawn - picture) ** 2))) for picture in pictures)
    assert own < 0.004
    assert common > 3 * own


@pytest.fixture(scope="module", params=["gles3", pytest.param("gles2-2048", marks=pytest.mark.long)])
def preintegrated(tmp_path_factory, request) -> Package:
    top = '[render]\nclassification = "preintegrated"\n'
    return built(tmp_path_factory.mktemp(f"preintegrated-{request.param}"), request.param, "box", top)


@pytest.mark.long(keep=1)
def test_a_level_has_a_pre_integrated_table_of_its_own(preintegrated) -> None:
    manifest = preintegrated.manifest
    tables = [texture for texture in manifest.textures if texture.role == "preintegrated"]
    own = [texture for texture in tables if texture.level is not None]
    assert own
    items = {item.name: item for item in manifest.plan}
    for texture in own:
        assert items[f"pre-integrated table veil of level {texture.level}"].files == (texture.file,)
    # One shader reads them all.
    assert len({(texture.shape_zyx, texture.max_extinction_per_mm) for texture in tables}) == 1
    assert check(preintegrated.path) == []


def test_a_pre_integrated_table_of_a_level_brings_its_picture_nearer_to_that_of_the_scan(preintegrated) -> None:
    """Against the level with the function itself, integrated exactly."""
    manifest = preintegrated.manifest
    level = next(each.level for each in manifest.textures if each.role == "preintegrated" and each.level is not None)
    function = manifest.transfer_functions[0]
    volume, scan = level_volume(preintegrated, level), thin_things()
    view = standard_views(manifest.levels[0].grid)["anterior-left"].box_from_clip(volume.grid, 1.0)
    grid = manifest.channels[0].source.info.grid
    truth_view = standard_views(manifest.levels[0].grid)["anterior-left"].box_from_clip(grid, 1.0)
    truth = oracle_picture(Volume(scan, grid), function, truth_view, (64, 64)).rgba
    with Renderer(preintegrated, level=level) as renderer:
        own = renderer.render(view, (64, 64))
    common = oracle_picture(volume, function, view, (64, 64)).rgba
    errors = [float(np.sqrt(np.mean((picture - truth) ** 2))) for picture in (own, common)]
    assert errors[0] < 0.9 * errors[1]


def test_every_level_is_drawn_nearer_with_its_own_pre_integrated_table_than_with_the_common_one(preintegrated) -> None:
    """Adapted and pre-integrated together (Díaz-García et al. 2018, section 3), with and without 3D textures."""
    manifest = preintegrated.manifest
    tables = {texture.level: texture for texture in manifest.textures if texture.role == "preintegrated"}
    scan, grid = thin_things(), manifest.channels[0].source.info.grid
    cameras = standard_views(manifest.levels[0].grid)
    views = ("anterior-left", "anterior-right", "posterior-left")
    truths = [
        oracle_picture(
            Volume(scan, grid), manifest.transfer_functions[0], cameras[view].box_from_clip(grid, 1.0), (64, 64)
        ).rgba
        for view in views
    ]

    def with_the_common_one(_package, inputs):
        textures = [tables[None] if texture.role == "preintegrated" else texture for texture in inputs.textures]
        return replace(inputs, textures=textures)

    own = [level for level in tables if level is not None]
    assert own
    assert None in tables
    for level in own:
        errors = []
        for edit in (None, with_the_common_one):
            with Renderer(preintegrated, level=level, edit=edit) as renderer:
                drawn = [
                    renderer.render(cameras[view].box_from_clip(manifest.levels[0].grid, 1.0), (64, 64))
                    for view in views
                ]
            errors.append(float(np.sqrt(np.mean((np.array(drawn) - np.array(truths)) ** 2))))
        assert errors[0] < 0.9 * errors[1]


def test_a_pre_integrated_table_stands_for_the_function_that_it_was_made_of(preintegrated) -> None:
    levels = [each.level for each in preintegrated.manifest.textures if each.role == "preintegrated"]
    level = next(level for level in levels if level is not None)
    fitted = table_function(preintegrated, "veil", level)
    exact = preintegrated.manifest.transfer_functions[0]
    values = [point.value for point in exact.points]
    at = np.interp(values, [p.value for p in fitted.points], [p.extinction_per_mm for p in fitted.points])
    given = np.array([point.extinction_per_mm for point in exact.points])
    # The first point, from which on something is seen, lies between two entries.
    assert at[0] == pytest.approx(0.0, abs=0.02 * given.max())
    assert np.abs(at - given).max() > 0.01 * given.max()
    assert np.abs(at - given).max() < given.max()


@pytest.mark.long
def test_seconds_stand_beside_the_package_and_not_in_it(package) -> None:
    origin = read_origin(package.path)
    assert origin is not None
    tried = {trial.filter for choice in origin.levels for trial in choice.trials}
    assert tried == set(CANDIDATES)
    assert "seconds" not in json.dumps(package.manifest.model_dump(mode="json"))


@pytest.mark.long
def test_steps_of_coarser_levels_are_measured_on_these_levels(package) -> None:
    origin = read_origin(package.path)
    assert origin is not None
    steps = {each.level: each.step_mm for each in package.manifest.pictures[0].drawings}
    reasons = {(item.kind, item.level): item.reason for item in package.manifest.plan}
    assert origin.levels
    for choice in origin.levels:
        assert choice.step is not None
        assert steps[choice.level] == choice.step.step_mm
        assert "on the level as it is" in reasons["step", choice.level]


@pytest.mark.long
@pytest.mark.usefixtures("stages_run_again")
def test_the_same_scan_gives_the_same_package(tmp_path_factory) -> None:
    first, second = (built(tmp_path_factory.mktemp("same")) for _ in range(2))
    assert first.manifest.files == second.manifest.files


def test_a_wanted_filter_is_taken_and_may_have_tables_too(tmp_path) -> None:
    package = built(tmp_path, made_by="box")
    assert {level.filter for level in package.manifest.levels} == {"none", "box"}
    assert not [item for item in package.manifest.plan if item.name.startswith("filter of")]
    assert {texture.level for texture in package.manifest.textures if texture.role == "transfer"} > {None}


@pytest.mark.long
def test_a_package_of_coarse_levels_only_has_no_common_table_where_none_is_read(tmp_path) -> None:
    profile = tmp_path / "small.toml"
    text = (Path(volprep.__file__).parent / "scene" / "profiles" / "gles3.toml").read_text()
    profile.write_text(text.replace("max_3d_texture_size = 1024", "max_3d_texture_size = 32"))
    package = built(tmp_path, profile="small.toml")
    assert min(level.index for level in package.manifest.levels) == 1
    tables = [texture.level for texture in package.manifest.textures if texture.role == "transfer"]
    assert None not in tables
    item = next(item for item in package.manifest.plan if item.name == "lookup table veil")
    assert not item.kept
    assert check(package.path) == []
