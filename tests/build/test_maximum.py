"""Maximum intensity projection: from the scene to the picture, the verdict and the report."""

import json
from functools import partial

import numpy as np
import pytest
import scene_builds
from command_line import volprep
from judged import validate
from scene_builds import assert_skipping_changes_no_pixel, built, write_raw_scene

from volprep.parts.editing.inputs import FunctionEdit
from volprep.scene.request import load_edit
from volprep_formats.diagnostics import VolprepError

PROFILES = ["gles3", "gles2-2048"]
SHAPE_ZYX = (24, 48, 56)
VESSELS = """
[[transfer]]
name = "vessels"
reference_mm = 4.0
points = [
    { value = 300.0, colour = "#000000", opacity = 0.0 },
    { value = 900.0, colour = "#ffffff", opacity = 0.99 },
]
"""


def vessels() -> np.ndarray:
    """Two bent tubes, one behind the other, brighter than a low noise, and nothing in a corner."""
    z, y, x = np.meshgrid(*(np.arange(n) for n in SHAPE_ZYX), indexing="ij")
    noise = np.random.default_rng(5).uniform(0, 120, SHAPE_ZYX)
    one = 900 * np.exp(-((x - 12 - 3 * np.sin(z / 4)) ** 2 + (y - 14) ** 2) / 6)
    other = 600 * np.exp(-((x - 14 - z) ** 2 + (y - 38) ** 2) / 9)
    return np.rint(noise + np.maximum(one, other)).astype("<i2")


def write_scene(folder, profile="gles3", more="", render="", transfer=VESSELS):
    tables = f"""[pyramid]
coarsest_longest_axis = 16
[render]
compositing = "maximum"
{render}
{transfer}"""
    return write_raw_scene(folder, vessels(), tables, profile=profile, top=more)


def package_of(folder, *args, **kwargs):
    return built(write_scene(folder, *args, **kwargs))


@pytest.fixture(scope="module", params=PROFILES)
def package(request, tmp_path_factory):
    skip = '[skip]\nkind = "distance"\nblock = 4\n'
    return package_of(tmp_path_factory.mktemp(request.param), request.param, more="", transfer=skip + VESSELS)


@pytest.fixture(scope="module")
def report(package):
    return validate(package, picture_size=96)


drawn = partial(scene_builds.drawn, shape_hw=(96, 96))


def test_every_program_says_so_and_goes_from_voxel_to_voxel(package) -> None:
    assert {program.compositing for program in package.manifest.programs} == {"maximum"}
    assert package.manifest.step_mm == pytest.approx(0.8)
    assert package.manifest.opacity_cutoff is None


def test_the_reversed_view_is_the_same_picture(package) -> None:
    for one, other in (("anterior", "posterior"), ("left", "right")):
        picture, back = drawn(package, one), drawn(package, other)
        assert picture[..., 3].max() > 0.5
        assert np.abs(picture - back[:, ::-1]).max() <= 1 / 255 + 1e-6
        assert np.sqrt(np.mean((picture - back[:, ::-1]) ** 2)) < 2e-3


def test_skipping_changes_no_pixel(package) -> None:
    assert_skipping_changes_no_pixel(package, (96, 96))


def test_the_block_of_noise_alone_is_empty_and_the_border_of_noise_is_cut(package) -> None:
    assert any(texture.role == "skip" for texture in package.manifest.textures)
    assert package.manifest.grid.shape_zyx[1] < SHAPE_ZYX[1] - 8


def test_where_a_steep_function_meets_noise_no_coarse_level_holds_maxima(package) -> None:
    assert all(level.filter in {"box", "appearance", "raised"} for level in package.manifest.levels[1:])


@pytest.mark.long(keep=1)
def test_it_is_within_the_tolerance_and_exact_from_a_voxel_on(report) -> None:
    assert report.verdict.code == "within", report.verdict.worse
    (program,) = report.programs
    assert program.views[0].total.rmse < 0.01
    errors = {point.step_ratio: point.quadrature.rmse for point in program.sweep.points if point.level == 0}
    # Ten times what float32 leaves: 5e-7 and 6e-7 (llvmpipe).
    assert max(error for ratio, error in errors.items() if ratio <= 1.0) < 6e-6
    assert errors[4.0] > errors[2.0] > 1e-3


@pytest.mark.long(keep=1)
def test_the_oracle_of_the_package_is_the_maximum(report) -> None:
    """With emission and absorption the picture of the data would be another one by far: data and truth agree."""
    assert max(view.data.rmse for view in report.programs[0].views) < 0.004


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("profile", PROFILES)
def test_an_edited_window_is_drawn_as_a_package_that_was_built_with_it(tmp_path, profile) -> None:
    edited = VESSELS.replace("4.0", "0.5").replace("300.0", "100.0").replace("0.99", "0.7")
    (tmp_path / "before").mkdir()
    (tmp_path / "after").mkdir()
    before = package_of(tmp_path / "before", profile, more="editable = true")
    after = package_of(tmp_path / "after", profile, more="editable = true", transfer=edited)
    file = tmp_path / "edit.toml"
    file.write_text(edited.split('"vessels"\n')[1])
    edit = load_edit(file, before.manifest.grid)
    for level in (each.index for each in before.manifest.levels[:2]):
        unedited, picture = drawn(before, level=level), drawn(before, level=level, edit=FunctionEdit(edit))
        # Tables of 8 bits round the extinctions of two lengths differently.
        assert np.abs(picture - drawn(after, level=level)).max() <= (2 if profile == "gles3" else 4) / 255
        assert np.abs(picture - unedited).max() > 0.2


@pytest.mark.parametrize(
    ("render", "transfer", "what"),
    [
        ('lighting = "headlight"', VESSELS, "lighting headlight"),
        ('classification = "preintegrated"', VESSELS, "classification preintegrated"),
        ('classification = "palette"', VESSELS, "classification palette"),
    ],
)
def test_what_a_maximum_does_not_go_with_is_refused_before_the_scan_is_measured(
    tmp_path, render, transfer, what
) -> None:
    with pytest.raises(VolprepError, match=what) as found:
        package_of(tmp_path, render=render, transfer=transfer)
    assert found.value.code == "VP3045"


def test_labels_have_no_maximum(tmp_path) -> None:
    scene = write_scene(tmp_path)
    np.minimum(vessels(), 200).tofile(tmp_path / "scan.raw")
    scene.write_text(scene.read_text().replace("[source]", "[source]\nlabels = true"))
    with pytest.raises(VolprepError, match="labels") as found:
        built(scene, tmp_path / "a.volpkg")
    assert found.value.code == "VP3045"


@pytest.mark.long
def test_the_plan_says_that_no_ray_ends_early(tmp_path) -> None:
    done = volprep("plan", write_scene(tmp_path), "--json")
    items = {item["name"]: item for item in json.loads(done.stdout)["items"]}
    assert not items["early ray termination"]["kept"]
    assert "maximum" in items["early ray termination"]["reason"]
