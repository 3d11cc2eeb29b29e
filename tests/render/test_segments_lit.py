"""A scan with its segments, lit: pictures are those of the oracle, and the laws of labels hold."""

from pathlib import Path
from unittest.mock import patch

import nibabel
import numpy as np
import pytest
from judged import validate
from segment_scan import AFFINE, TINTS, built, drawn, truth, write_segments

from volprep.shading import program
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package

FINE = {"step_voxels": 0.25, "opacity_cutoff": 1.0, "picture_size": 48}
LIT = {"render": {**FINE, "lighting": "headlight"}}
PLACED = {"render": {**FINE, "lighting": "phong"}, "lighting": {"light_mm": [-60.0, -80.0, 40.0]}}

SHADED = {**PLACED, "lighting": {**PLACED["lighting"], "shadows": "rays"}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return write_segments(tmp_path_factory.mktemp("segments"))


@pytest.fixture(scope="module")
def lit(folder) -> Package:
    return built(folder, "lit", change=LIT, outside_opacity=0.3, style=[{"labels": [2], "visible": False}])


def rms(difference: np.ndarray) -> float:
    return float(np.sqrt((difference**2).mean()))


def test_a_headlight_lights_borders_by_the_visible_extinction(folder, lit):
    picture, expected = drawn(lit), truth(folder, lit)
    # Where a normal turns away its light has a kink, which a step sees late or early.
    assert rms(picture - expected) < 0.002
    assert np.abs(picture - expected).max() < 0.02
    unlit = truth(folder, built(folder, "unlit", outside_opacity=0.3, style=[{"labels": [2], "visible": False}]))
    assert rms(picture[..., :3] - unlit[..., :3]) > 0.02
    assert np.abs(expected[..., 3] - unlit[..., 3]).max() < 1e-5


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("change", [LIT, PLACED], ids=["headlight", "phong"])
def test_crisp_borders_are_lit(folder, change):
    package = built(folder, f"crisp-{change['render']['lighting']}", change=change, border="crisp")
    assert rms(drawn(package) - truth(folder, package)) < 0.005


def test_a_light_at_a_place_lights_segments(folder):
    package = built(folder, "phong", change=PLACED, outside_opacity=0.3)
    assert rms(drawn(package) - truth(folder, package)) < 0.004


def test_lit_labels_that_look_alike_draw_the_scan_alone(folder):
    styles = [{"transfer": "veil", "tint": "#ffffff"}]
    with patch.object(program, "samples_of_group", return_value=1):
        each = built(folder, "alike-each", change=LIT, style=styles)
    alone = drawn(built(folder, "alone", change={**LIT, "lighting": {"normals": "central"}}), transfer="veil")
    assert np.abs(drawn(each) - alone).max() < 1e-6
    # The scan alone takes a normal for each sample, segments take one for two.
    alike = built(folder, "alike", change=LIT, style=styles)
    assert rms(drawn(alike) - alone) < 0.001


def test_dividing_a_lit_label_changes_nothing(folder):
    """Segments 1 and 2 side by side look like one: their common border is no surface."""
    styles = [{"tint": "#ffffff"}, {"labels": [3, 200], "visible": False}]
    divided = built(folder, "divided", change=LIT, style=styles, outside_opacity=0.1)
    one = built(folder, "one", change=LIT, style=styles, outside_opacity=0.1, source=str(folder / "joined.nii"))
    assert np.abs(drawn(divided) - drawn(one)).max() < 1e-6


@pytest.mark.parametrize("change", [LIT, PLACED], ids=["headlight", "phong"])
def test_lit_labels_permuted_with_their_table_change_nothing(folder, change):
    numbers = {1: 200, 2: 3, 3: 1, 200: 2}
    labels = nibabel.load(folder / "labels.nii").get_fdata().astype(np.int16)
    permuted = np.select([labels == number for number in numbers], list(numbers.values()), 0).astype(np.int16)
    nibabel.save(nibabel.Nifti1Image(permuted, AFFINE), folder / "permuted.nii")
    styles = [{"labels": [number], "tint": tint, "visible": number != 2} for number, tint in TINTS.items()]
    renamed = [{**style, "labels": [numbers[style["labels"][0]]]} for style in styles]
    name = change["render"]["lighting"]
    source = {"outside_opacity": 0.3, "change": change}
    first = built(folder, f"first-{name}", style=styles, **source)
    other = built(folder, f"permuted-{name}", style=renamed, source=str(folder / "permuted.nii"), **source)
    assert first.manifest.segments.sha256 != other.manifest.segments.sha256
    assert np.abs(drawn(first) - drawn(other)).max() < 1e-6


def test_hiding_everything_lit_leaves_nothing(folder):
    package = built(folder, "nothing", change=LIT, style=[{"visible": False}], outside_opacity=0.0)
    assert not drawn(package).any()


def test_a_lit_mosaic_of_labels_draws_what_a_3d_texture_does(folder, lit):
    mosaic = built(
        folder, "mosaic", "gles2-2048", change=LIT, outside_opacity=0.3, style=[{"labels": [2], "visible": False}]
    )
    assert check(mosaic.path) == []
    difference = np.abs(drawn(mosaic, target="rgba8") - drawn(lit)).max(axis=-1)
    assert np.sort(difference, axis=None)[-4] < 0.01


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    "change",
    [{"bricks": {"size": 4, "reach": 2}}, {"technique": "slabs"}, {"compositing": "back-to-front"}],
    ids=["bricks", "slabs", "back-to-front"],
)
def test_other_ways_to_draw_light_segments_alike(folder, lit, change):
    render = {name: value for name, value in change.items() if name != "bricks"}
    more = {name: value for name, value in change.items() if name == "bricks"}
    wanted = {**more, "render": {**LIT["render"], **render}, "lighting": {"normals": "central"}}
    name = "-".join(change)
    looks = {"outside_opacity": 0.3, "style": [{"labels": [2], "visible": False}]}
    package = built(folder, name, change=wanted, **looks)
    if "compositing" in change:
        # Rays from the far end share nothing between samples.
        with patch.object(program, "samples_of_group", return_value=1):
            lit = built(folder, "lit-each", change=LIT, **looks)
    assert np.abs(drawn(package) - drawn(lit)).max() < 1e-3


@pytest.mark.long
def test_a_lit_package_is_validated(folder, lit):
    assert check(lit.path) == []
    report = validate(lit.path, folder / "lit.report", witness=False)
    assert report.verdict.passed
    assert report.verdict.worst_rmse < 0.003


@pytest.mark.long
@pytest.mark.parametrize("border", ["mixed", "crisp"])
def test_segments_cast_shadows_on_each_other(folder, border):
    package = built(folder, f"shadows-{border}", change=SHADED, border=border, outside_opacity=0.3)
    picture, expected = drawn(package), truth(folder, package)
    assert rms(picture - expected) < 0.002
    bare = built(folder, f"bare-{border}", change=PLACED, border=border, outside_opacity=0.3)
    assert rms(picture[..., :3] - drawn(bare)[..., :3]) > 0.01


@pytest.mark.long
@pytest.mark.parametrize("border", ["mixed", "crisp"])
def test_half_angle_slices_cast_the_shadows_of_segments(folder, border):
    change = {
        "render": {**PLACED["render"], "technique": "view-slices"},
        "lighting": {**PLACED["lighting"], "shadows": "half-angle"},
    }
    package = built(folder, f"half-angle-{border}", change=change, border=border, outside_opacity=0.3)
    assert check(package.path) == []
    bare = built(folder, f"half-angle-bare-{border}", change=PLACED, border=border, outside_opacity=0.3)
    # From before and behind the light.
    for view in ("anterior-left", "posterior"):
        picture, expected = drawn(package, view), truth(folder, package, view)
        assert rms(picture - expected) < 0.002
        assert rms(picture[..., :3] - drawn(bare, view)[..., :3]) > 0.01


@pytest.mark.long
def test_hidden_segments_cast_no_shadow(folder):
    numbers = nibabel.load(folder / "labels.nii").get_fdata()
    nibabel.save(nibabel.Nifti1Image(np.where(numbers == 3, 3, 0).astype(np.int16), AFFINE), folder / "alone.nii")
    styles = [{"labels": [1, 2, 200], "visible": False}]
    hidden = built(folder, "hidden", style=styles, outside_opacity=0.0, change=SHADED)
    alone = built(folder, "one-alone", style=[], source=str(folder / "alone.nii"), outside_opacity=0.0, change=SHADED)
    tints = [
        next(each.tint for each in package.manifest.segments.segments if each.number == 3)
        for package in (hidden, alone)
    ]
    assert drawn(hidden)[..., 3].max() > 0.3
    assert tints[0] == tints[1]
    assert np.abs(drawn(hidden) - drawn(alone)).max() < 1e-6


@pytest.mark.long
def test_a_package_with_shadows_is_validated(folder):
    small = {**SHADED, "render": {**SHADED["render"], "picture_size": 24}}
    package = built(folder, "shadows", change=small, border="mixed", outside_opacity=0.3)
    assert validate(package.path, folder / "shadows.report", witness=False).verdict.passed
