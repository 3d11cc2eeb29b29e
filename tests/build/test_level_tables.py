"""Packages whose levels have lookup tables of their own: what is written, what is drawn, and what the plan says."""

import json
from pathlib import Path

import numpy as np
import pytest

import volprep
from tests.support.thin_phantom import SPACING_MM_ZYX, thin_things
from volprep.pipeline.build import build
from volprep.pipeline.origin import read_origin
from volprep.render.renderer import Renderer
from volprep.scene.request import load_request
from volprep.truth.camera import standard_views
from volprep.truth.decoded import level_volume, table_function
from volprep.truth.oracle import oracle_picture
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.package.tables import table_for
from volprep_formats.progress import Silent

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
    build(load_request(scene), folder / "thin.volpkg", Silent())
    return Package.open(folder / "thin.volpkg")


@pytest.fixture(scope="module", params=["gles3", "gles2-2048"])
def package(tmp_path_factory, request) -> Package:
    return built(tmp_path_factory.mktemp(request.param), request.param)


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


def test_a_level_is_drawn_with_its_own_table(package) -> None:
    level = package.manifest.levels[-1]
    volume = level_volume(package, level.index)
    camera = standard_views(package.manifest.levels[0].grid)["anterior-left"]
    view = camera.box_from_clip(volume.grid, 1.0)
    pictures = [
        oracle_picture(volume.stored, volume.grid, volume.slope, volume.intercept, function, view, (64, 64)).rgba
        for function in (table_function(package, "veil", level.index), table_function(package, "veil", 0))
    ]
    with Renderer(package, level=level.index) as renderer:
        drawn = renderer.render(view, (64, 64))
    own, common = (float(np.sqrt(np.mean((drawn - picture) ** 2))) for picture in pictures)
    assert own < 0.004
    assert common > 3 * own


def test_seconds_stand_beside_the_package_and_not_in_it(package) -> None:
    origin = read_origin(package.path)
    assert origin is not None
    tried = {trial.filter for choice in origin.levels for trial in choice.trials}
    assert tried == {"box", "median", "least-squares", "appearance"}
    assert "seconds" not in json.dumps(package.manifest.model_dump(mode="json"))


def test_the_same_scan_gives_the_same_package(tmp_path_factory) -> None:
    first, second = (built(tmp_path_factory.mktemp("same")) for _ in range(2))
    assert first.manifest.files == second.manifest.files


def test_a_wanted_filter_is_taken_and_may_have_tables_too(tmp_path) -> None:
    package = built(tmp_path, made_by="box")
    assert {level.filter for level in package.manifest.levels} == {"none", "box"}
    assert not [item for item in package.manifest.plan if item.name.startswith("filter of")]
    assert {texture.level for texture in package.manifest.textures if texture.role == "transfer"} > {None}


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
