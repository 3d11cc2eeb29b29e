"""Packages whose transfer functions users may edit: nothing rests on these but tables, and these can be made anew."""

import numpy as np
import pytest
from channel_scene import write_channel_scene
from command_line import volprep
from phantom_scene import SHAPE_ZYX, write_phantom_scene
from scene_builds import built, planned

from volprep.parts.editing.inputs import FunctionEdit
from volprep.parts.levels.stage import FREE_CANDIDATES
from volprep.pipeline.origin import read_origin
from volprep.plan.products import SkipPlan
from volprep.render.renderer import Renderer
from volprep.scene.request import load_edit
from volprep.truth.camera import standard_views
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package

PROFILES = ["gles3", "gles2-2048"]
EDIT = """
points = [
    { value = 20.0, colour = "#2040ff", extinction_per_mm = 0.0 },
    { value = 45.0, colour = "#40ff80", extinction_per_mm = 0.08 },
    { value = 300.0, colour = "#ff2010", extinction_per_mm = 0.9 },
    { value = 640.0, colour = "#ff2010", extinction_per_mm = 0.0 },
]
"""
"""Shows the noise around the blobs, which the scene's own functions leave empty, and hides the core of the larger."""


def write_scene(folder, profile="gles3", more="", *, points=None, level_filter="auto"):
    """A phantom of editable transfer functions; `points` replace those of the first."""
    path = write_phantom_scene(folder, profile, level_filter)
    text = path.read_text()
    if points is not None:
        begin, end = text.index("points = ["), text.index('[[transfer]]\nname = "core"')
        text = text[:begin] + points.strip() + "\n\n" + text[end:]
    path.write_text(f"editable = true\n{more}\n{text}")
    return path


@pytest.fixture(scope="module", params=PROFILES)
def pair(request, tmp_path_factory):
    """The package, and one that was built with the edited function, both with levels of one filter."""
    folder = tmp_path_factory.mktemp(request.param)
    packages = []
    for name, points in (("before", None), ("after", EDIT)):
        (folder / name).mkdir()
        path = write_scene(folder / name, request.param, points=points, level_filter="least-squares")
        packages.append(built(path))
    edit = folder / "edit.toml"
    edit.write_text(EDIT)
    return (*packages, edit)


def drawn(package, level, edit=None):
    grid = package.manifest.levels[0].grid
    views = standard_views(grid)
    with Renderer(package, level=level, edit=None if edit is None else FunctionEdit(edit)) as renderer:
        return [renderer.render(views[name].box_from_clip(grid, 1.0), (40, 40)) for name in ("anterior", "left")]


@pytest.mark.long(keep=1)
def test_an_edit_is_drawn_as_a_package_that_was_built_with_it(pair):
    before, after, file = pair
    edit = load_edit(file, before.manifest.grid)
    for level in before.manifest.levels:
        pictures = drawn(before, level.index, edit)
        assert np.array_equal(pictures, drawn(after, level.index))
        assert not np.allclose(pictures, drawn(before, level.index), atol=0.05)


def test_nothing_rests_on_transfer_functions_but_their_tables(pair):
    before, after, _ = pair
    of_functions = {each.file for each in before.manifest.textures if each.role in {"transfer", "skip"}}
    digests = [
        {
            record.path: record.sha256
            for record in package.manifest.files
            if record.path not in of_functions and record.role != "preview"
        }
        for package in (before, after)
    ]
    assert digests[0] == digests[1]
    assert before.manifest.grid == before.manifest.source.info.grid
    assert before.manifest.quantization == after.manifest.quantization
    assert before.manifest.quantization.clipped_above == before.manifest.quantization.clipped_below == 0
    assert before.manifest.opacity_cutoff is not None


def test_it_holds_ranges_and_tables_of_empty_space_for_every_level_and_function(pair):
    package = pair[0]
    levels = {level.index for level in package.manifest.levels}
    skipping = package.manifest.skipping
    assert {ranges.level for ranges in skipping.ranges} == levels
    assert {(table.level, table.transfer) for table in skipping.tables} == {
        (level, name) for level in levels for name in ("shell", "core")
    }
    assert {table.block for table in skipping.tables} == {ranges.block for ranges in skipping.ranges}


def test_it_is_sound_and_each_coarser_level_has_a_histogram_and_tables(pair):
    package = pair[0]
    assert check(package.path) == []
    coarser = {level.index for level in package.manifest.levels} - {0}
    assert {each.level for each in package.manifest.editing.histograms} == coarser
    own = {(each.level, each.transfer) for each in package.manifest.textures if each.role == "transfer"}
    assert own >= {(level, name) for level in coarser for name in ("shell", "core")}
    (item,) = (item for item in package.manifest.plan if item.name == "joint histograms")
    assert item.kept
    assert set(item.files) == {each.file for each in package.manifest.editing.histograms}


@pytest.mark.parametrize(
    ("profile", "more", "what"),
    [
        ("gles3", 'render = { classification = "palette" }', "classification palette"),
        ("gles3", 'render = { classification = "preintegrated" }', "classification preintegrated"),
        ("gles3", "proxy = {}", "proxy"),
        ("gles1", 'lab.slices = { form = "rgba" }', "slices.form rgba"),
    ],
)
def test_what_rests_on_transfer_functions_is_refused(tmp_path, profile, more, what):
    with pytest.raises(VolprepError, match=f"VP3080 .*{what}"):
        planned(write_scene(tmp_path, profile, more))


def test_a_filter_that_looks_through_transfer_functions_is_refused(tmp_path):
    with pytest.raises(VolprepError, match="VP3080"):
        planned(write_scene(tmp_path, level_filter="appearance"))


def test_without_skipping_there_are_no_ranges_either(tmp_path):
    plan = planned(write_scene(tmp_path, more='skip = { kind = "none" }'))
    (channel,) = plan.channels
    assert channel.part(SkipPlan).tables == channel.part(SkipPlan).ranges == ()


@pytest.mark.long
def test_channels_have_histograms_of_their_own_and_filters_that_depend_on_no_function(tmp_path):
    path = write_channel_scene(tmp_path, level_filter="auto")
    path.write_text(f"editable = true\n{path.read_text()}")
    package = built(path, tmp_path / "tissues.volpkg")
    assert check(package.path) == []
    found = {(each.channel, each.level) for each in package.manifest.editing.histograms}
    coarser = {level.index for level in package.manifest.levels} - {0}
    assert found == {(name, level) for name in ("skin", "bone") for level in coarser}
    tried = {trial.filter for choice in read_origin(package.path).levels for trial in choice.trials}
    assert tried == set(FREE_CANDIDATES)
    edit = tmp_path / "edit.toml"
    edit.write_text('points = [{ value = 0.5, colour = "#ffffff", extinction_per_mm = 1.0 }]')
    assert np.ptp(drawn(package, max(coarser), load_edit(edit, package.manifest.grid))) > 0.5


def test_labels_need_no_histogram(tmp_path):
    path = write_scene(tmp_path)
    path.write_text(path.read_text().replace("[source]", "[source]\nlabels = true").replace("uint16", "uint8"))
    (np.arange(np.prod(SHAPE_ZYX)) % 251 // 50 * 60).astype(np.uint8).tofile(tmp_path / "phantom.raw")
    package = built(path, tmp_path / "labels.volpkg")
    assert package.manifest.editing.histograms == ()
    assert check(package.path) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("points = [", "VP3002"),
        ("points = []", "VP3003"),
        ('preset = "mr-head"', "VP3003 .*places in the range"),
        (None, "VP3001"),
    ],
)
def test_a_file_that_is_no_transfer_function_is_refused(tmp_path, text, message):
    edit = tmp_path / "edit.toml"
    if text is not None:
        edit.write_text(text)
    with pytest.raises(VolprepError, match=message):
        load_edit(edit, Grid.of((2, 2, 2), (1.0, 1.0, 1.0)))


@pytest.mark.parametrize("pair", ["gles3"], indirect=True)
def test_the_command_draws_an_edit(pair, tmp_path):
    before, _, file = pair
    done = volprep("render", before.path, "-o", tmp_path / "p.png", "--edit", file, "--size", "24x24")
    assert done.returncode == 0, done.stderr


def test_a_package_that_is_not_editable_says_so(built_package, tmp_path):
    package = Package.open(built_package)
    assert package.manifest.editing is None
    edit = tmp_path / "edit.toml"
    edit.write_text(EDIT)
    with pytest.raises(VolprepError, match="VP5023"):
        Renderer(package, edit=FunctionEdit(load_edit(edit, package.manifest.grid)))
