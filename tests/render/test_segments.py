"""A scan with its segments: what the package draws is what the oracle integrates, and the laws of labels hold."""

import re
from pathlib import Path
from unittest.mock import patch

import nibabel
import numpy as np
import pytest
from judged import validate
from scene_builds import view_of
from segment_scan import AFFINE, DENSE_INSIDE, FAINT_STYLES, INSIDE, SOFT, built, drawn, scene_of, truth, write_segments

from volprep.parts.segments import stage
from volprep.parts.segments.level_labels import coarse_labels
from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.scene.profiles import load_profile
from volprep.scene.request import Request
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.parts.segments.texels import held_labels
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return write_segments(tmp_path_factory.mktemp("segments"))


@pytest.fixture(scope="module")
def mixed(folder) -> Package:
    return built(folder, "mixed", outside_opacity=0.5)


@pytest.mark.parametrize("view", ["anterior-left", "superior"])
def test_mixed_borders_are_those_of_the_oracle(folder, mixed, view):
    picture = drawn(mixed, view)
    # Tables have 256 entries, and the step is a quarter of a voxel.
    assert np.abs(picture - truth(folder, mixed, view)).max() < 0.004
    assert picture[..., 3].max() > 0.5


@pytest.mark.parametrize(("profile", "most"), [("gles3", 0.001), ("gles2-4096", 0.0035)])
def test_faint_segments_are_as_opaque_as_the_scene_says_or_the_build_says_how_far_off(folder, profile, most):
    change = {"transfer": DENSE_INSIDE, "render": {"step_voxels": 0.0625, "opacity_cutoff": 1.0}}
    package = built(folder, f"faint-{profile}", profile, change, outside_opacity=0.0, style=FAINT_STYLES)
    off = np.abs(drawn(package) - truth(folder, package)).max()
    assert off < most
    (said,) = [item.reason for item in package.manifest.plan if item.name == "opacities of segments"] or [""]
    assert ("off by 0.0035" in said) == (off > 0.0025)


@pytest.mark.parametrize(("step_voxels", "samples"), [(0.0625, 4), (0.125, 2), (0.25, 2), (0.3, 1)])
def test_labels_are_read_once_for_samples_that_are_near_each_other(folder, step_voxels, samples):
    change = {"render": {"step_voxels": step_voxels, "opacity_cutoff": 1.0}}
    package = built(folder, f"step-{step_voxels}", change=change, outside_opacity=0.5)
    assert samples_of_a_group(package) == samples
    # The densest value has 0.2 per mm. The error is of order 2, as that of values.
    assert np.abs(drawn(package) - truth(folder, package)).max() < 0.003 + 0.02 * step_voxels**2


@pytest.mark.parametrize("why", ["crisp", "opaque"])
def test_steps_at_borders_and_opaque_voxels_need_the_labels_of_each_sample(folder, why):
    change = {"render": {"step_voxels": 0.3}} if why == "opaque" else {}
    package = built(folder, why, change=change, border="crisp" if why == "crisp" else "mixed")
    assert samples_of_a_group(package) == 1


@pytest.mark.parametrize("border", ["mixed", "crisp"])
@pytest.mark.parametrize(("step_voxels", "samples"), [(0.0625, 2), (0.25, 2), (0.3, 1)])
def test_two_lit_samples_share_their_normal_where_voxels_absorb_little(folder, step_voxels, samples, border):
    change = {"render": {"step_voxels": step_voxels, "opacity_cutoff": 1.0, "lighting": "headlight"}}
    package = built(folder, f"lit-{border}-{step_voxels}", change=change, border=border, outside_opacity=0.3)
    assert samples_of_a_group(package) == samples
    difference = drawn(package) - truth(folder, package)
    # With normals of each sample it is 0.0001 less with steps of a quarter of a voxel.
    assert np.sqrt((difference**2).mean()) < 0.0005 + (0.005 if border == "crisp" else 0.002) * step_voxels


@pytest.mark.parametrize("shadows", ["none", "rays"])
def test_lit_samples_with_shadow_rays_share_nothing(folder, shadows):
    light = {"lighting": {"light_mm": [-60.0, -80.0, 40.0], "shadows": shadows}}
    change = {"render": {"step_voxels": 0.25, "lighting": "phong"}, **light}
    package = built(folder, f"phong-{shadows}", change=change, outside_opacity=0.3)
    assert samples_of_a_group(package) == (2 if shadows == "none" else 1)


def samples_of_a_group(package: Package) -> int:
    (program,) = (each for each in package.manifest.level_programs if each.transfer == "segments")
    texts = [program.fragment, *([program.tiles.cost] if program.tiles else [])]
    text = "".join(package.read_text(each) for each in texts)
    found = re.findall(r"  for \(int k = 0; k < (\d); k\+\+\) \{\n *float i = ", text)
    return int(found[0]) if found else 1


def test_crisp_borders_are_those_of_the_oracle(folder):
    package = built(folder, "crisp", border="crisp")
    difference = np.abs(drawn(package) - truth(folder, package)).max(axis=-1)
    # Of order 1: a ray may take one step more or less through a label.
    assert np.sqrt((difference**2).mean()) < 0.004
    assert difference.max() < 0.03


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("border", ["mixed", "crisp"])
@pytest.mark.parametrize("labels", ["labels", "many"])
def test_a_mosaic_of_labels_draws_what_a_3d_texture_does(folder, border, labels):
    name = f"mosaic-{border}-{labels}"
    source = {"border": border, "source": str(folder / f"{labels}.nii"), "style": []}
    mosaic = built(folder, name, profile="gles2-2048", **source)
    assert {each.format for each in mosaic.manifest.textures if each.role == "labels"} == {
        "r8unorm" if labels == "labels" else "rg8unorm"
    }
    assert check(mosaic.path) == []
    other = built(folder, f"3d-{name}", **source)
    for view in ("anterior-left", "superior"):
        difference = np.abs(drawn(mosaic, view, target="rgba8") - drawn(other, view)).max(axis=-1)
        # Half a step of 8 bits. Where a ray touches a face, float32 may find the other label.
        assert np.sort(difference, axis=None)[-4] < 0.006 if border == "crisp" else difference.max() < 0.004


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    "change",
    [
        {"bricks": {"size": 4}},
        {"render": {"step_voxels": 0.25, "opacity_cutoff": 1.0, "technique": "slabs"}},
        {"render": {"step_voxels": 0.25, "opacity_cutoff": 1.0, "technique": "two-pass"}},
        {"render": {"step_voxels": 0.25, "opacity_cutoff": 1.0, "technique": "view-slices"}},
        {"render": {"step_voxels": 0.25, "opacity_cutoff": 1.0, "compositing": "back-to-front"}},
    ],
    ids=["bricks", "slabs", "two-pass", "view-slices", "back-to-front"],
)
def test_other_ways_to_draw_give_the_picture_of_ray_casting(folder, mixed, change):
    name = "-".join(map(str, next(iter(change.values())).values()))
    package = built(folder, name, change=change, outside_opacity=0.5)
    assert check(package.path) == []
    (program,) = package.manifest.level_programs
    assert (program.sampling == "bricks") == ("bricks" in change)
    drawn_otherwise, expected = drawn(package), drawn(mixed)
    # Layers are rounded to half floats one by one; from the back, other pairs of samples share labels. Other ways take
    # the same samples.
    largest = {"view-slices": 0.01, "back-to-front": 0.002}
    most = next((bound for way, bound in largest.items() if way in name), 1e-3)
    assert np.abs(drawn_otherwise - expected).max() < most


@pytest.mark.long
def test_a_mosaic_of_labels_is_validated(folder):
    package = built(folder, "mosaic", profile="gles2-2048", border="mixed", outside_opacity=0.5)
    assert validate(package.path, folder / "mosaic.report", witness=False).verdict.passed


@pytest.mark.long
def test_wrong_labels_of_coarse_levels_are_found_by_pictures(folder):
    """Both the package and what validation derives from the scan have them: only pictures tell."""

    def upside_down(labels: np.ndarray, factors_zyx: tuple[int, int, int], *_: object) -> np.ndarray:
        return np.ascontiguousarray(coarse_labels(labels, factors_zyx)[::-1])

    levels = {"pyramid": {"coarsest_longest_axis": 12}}
    right = built(folder, "coarse", change=levels, outside_opacity=0.3)
    assert validate(right.path, folder / "coarse.report", witness=False).verdict.worse == ()
    with patch.object(stage, "coarse_labels", upside_down):
        wrong = built(folder, "upside-down", change=levels, outside_opacity=0.3)
        verdict = validate(wrong.path, folder / "upside-down.report", witness=False).verdict
    assert verdict.code == "worse-than-box"
    assert verdict.worse == ("level 1 with segments", "level 2 with segments")


@pytest.mark.long
def test_a_segment_that_vanishes_from_a_coarse_level_fails_the_verdict(folder):
    def without_200(labels: np.ndarray, factors_zyx: tuple[int, int, int], *light: object) -> np.ndarray:
        found = coarse_labels(labels, factors_zyx, *light)
        return np.where(found == found.max(), 0, found)

    levels = {"pyramid": {"coarsest_longest_axis": 12}}
    right = built(folder, "all-kept", change=levels, outside_opacity=0.3)
    others = validate(right.path, folder / "kept.report", witness=False).programs[0].others
    assert [style.lost for other in others for style in other.styles] == [()] * 4
    with patch.object(stage, "coarse_labels", without_200):
        wrong = built(folder, "one-lost", change=levels, outside_opacity=0.3)
        report = validate(wrong.path, folder / "lost.report", witness=False)
    assert "level 1 with segments" in report.verdict.beyond
    (style,) = (each for each in report.programs[0].others[0].styles if each.transfer == "inside")
    assert (style.lost, style.least_kept_light) == (("segment-200",), 0.0)
    assert style.kept_light > 0.8


def test_a_crisp_border_is_within_a_quarter_of_a_voxel_of_the_truth(folder):
    """Values are places along the view, and colours are values: where a ray first meets what is opaque."""
    own = folder / "places"
    own.mkdir()
    shape = (24, 20, 18)
    values = np.broadcast_to(np.arange(20)[:, None] * 12, shape).astype(np.uint8)
    x, y, z = np.indices(shape)
    ball = (x - 12) ** 2 + (y - 10) ** 2 + (z - 9) ** 2 < 49
    nibabel.save(nibabel.Nifti1Image(values, np.diag([-1.0, -1.0, 1.0, 1.0])), own / "scan.nii")
    nibabel.save(nibabel.Nifti1Image(ball.astype(np.int16), np.diag([-1.0, -1.0, 1.0, 1.0])), own / "labels.nii")
    solid = [
        {"value": 0.0, "colour": "#000000", "extinction_per_mm": 100.0},
        {"value": 228.0, "colour": "#ffffff", "extinction_per_mm": 100.0},
    ]
    change = {
        "transfer": [{"name": "veil", "points": [SOFT]}, {"name": "inside", "points": solid}],
        "render": {"picture_size": 48},
    }
    styles = [{"tint": "#ffffff"}]
    package = built(own, "places", change=change, border="crisp", style=styles, outside_opacity=0.0)
    found, expected = drawn(package, "anterior"), truth(own, package, "anterior")
    hit = (found[..., 3] > 0.99) & (expected[..., 3] > 0.99)
    assert hit.sum() > 200
    places = [19 * picture[hit, 0] / picture[hit, 3] for picture in (found, expected)]
    assert np.ptp(places[1]) > 4
    step_mm = package.manifest.step_mm
    assert step_mm <= 0.5
    # What a sample sees begins half a step in front of it. The view runs towards smaller places, or larger ones.
    towards = np.sign(np.median(places[1]) - 10)
    assert np.abs(places[0] + towards * step_mm / 2 - places[1]).max() < 0.25


def test_labels_that_look_alike_draw_the_scan_alone(folder):
    styles = [{"transfer": "veil", "tint": "#ffffff"}]
    package = built(folder, "alike", style=styles)
    alone = built(folder, "alone")
    # In 8 bits no pixel differs; in float32 sums of eight weights round.
    assert np.abs(drawn(package) - drawn(alone, transfer="veil")).max() < 1e-6


def test_what_is_hidden_is_not_drawn(folder):
    package = built(folder, "hidden", style=[{"visible": False}], outside_opacity=0.0)
    assert not drawn(package).any()


def test_rays_skip_the_blocks_of_segments_that_a_package_hides(folder):
    skip = {"skip": {"kind": "distance", "block": 2}}
    style = [{"labels": [1, 2], "visible": False}]
    shown = built(folder, "blocks-shown", change=skip, outside_opacity=0.0)
    hidden = built(folder, "blocks-hidden", change=skip, outside_opacity=0.0, style=style)
    plain = built(folder, "blocks-plain", change={"skip": {"kind": "none"}}, outside_opacity=0.0, style=style)
    shares = [each.manifest.skipping.tables[0].empty_share for each in (shown, hidden)]
    assert shares[1] > shares[0] + 0.3
    assert drawn(hidden)[..., 3].max() > 0.5
    assert np.array_equal(drawn(hidden), drawn(plain))
    assert [each.role for each in plain.manifest.textures if each.role == "label-sets"] == []


def test_three_styles_in_one_cell_are_told_apart(folder):
    styles = [{"tint": "#ffffff"}, {"labels": [3], "transfer": "veil", "tint": "#ff0000", "opacity": 0.25}]
    package = built(folder, "styles", style=styles, outside="inside", outside_opacity=0.1)
    assert package.manifest.segments.transfers == ("veil", "inside")
    # As above, and labels are those halfway between two samples, an eighth of a voxel away.
    assert np.abs(drawn(package) - truth(folder, package)).max() < 0.005


def test_the_package_is_sound_and_holds_one_byte_more_for_each_voxel(mixed):
    assert check(mixed.path) == []
    textures = {texture.role: texture for texture in mixed.manifest.textures}
    assert textures["labels"].format == "r8unorm"
    assert textures["labels"].shape_zyx == textures["volume"].shape_zyx
    assert textures["looks"].shape_zyx == (1, 1, 256)
    # Half floats are for opacities that bytes round too much: they draw more slowly.
    assert textures["looks"].format == "rgba8unorm"


def test_what_only_segments_show_is_cropped_to_them_and_skipped_where_there_are_none(folder):
    """The style of segments shows every value: without their labels no voxel and no block would be empty."""
    labels = np.zeros((48, 40, 36), np.int16)
    labels[2:5, 20:24, 6:9] = 1
    labels[40:43, 20:24, 28:31] = 2
    values = np.random.default_rng(3).integers(0, 255, labels.shape, dtype=np.uint8)
    own = folder / "apart"
    own.mkdir()
    nibabel.save(nibabel.Nifti1Image(values, AFFINE), own / "scan.nii")
    nibabel.save(nibabel.Nifti1Image(labels, AFFINE), own / "labels.nii")
    nothing = {"value": 0.0, "colour": "#000000", "extinction_per_mm": 0.0}
    change = {"transfer": [{"name": "veil", "points": [nothing]}, {"name": "inside", "points": INSIDE}], "crop": "auto"}
    package = built(own, "apart", change=change, style=[])
    assert package.manifest.grid.shape_zyx == (27, 6, 43)
    assert package.manifest.skipping.tables[0].empty_share > 0.7
    whole = built(own, "whole", change={**change, "crop": "none", "skip": {"kind": "none"}}, style=[])
    grid = package.manifest.grid
    world = grid.world_from_box @ view_of(grid, "anterior-left")
    pictures = []
    for each in (package, whole):
        with Renderer(each, target="rgba32f") as renderer:
            pictures.append(renderer.render(np.linalg.inv(each.manifest.grid.world_from_box) @ world, (48, 48)))
    assert pictures[0].max() > 0.05
    # Their samples lie at other places of the same field, and are a quarter of a voxel apart.
    assert np.abs(pictures[0] - pictures[1]).max() < 0.01


def test_segments_know_their_volume_and_names_stay_out(mixed):
    segments = mixed.manifest.segments.segments
    assert [segment.name for segment in segments] == ["segment-1", "segment-2", "segment-3", "segment-200"]
    assert segments[2].volume_ml == pytest.approx(7 * 6 * 5 * 3.0 / 1000)


def test_a_validated_package_follows_from_scan_and_segments(folder, mixed):
    report = validate(mixed.path, folder / "mixed.report", witness=False)
    assert report.verdict.passed
    assert not report.derivation.findings
    assert {program.transfer for program in report.programs} == {"segments"}
    assert report.verdict.worst_rmse < 0.002


@pytest.mark.long
def test_coarser_levels_are_for_previews_and_no_worse_than_box_means(folder):
    package = built(folder, "levels", coarsest=12, border="mixed")
    assert package.manifest.previews == {1, 2}
    report = validate(package.path, folder / "levels.report", witness=False)
    assert report.verdict.passed
    assert len(report.programs[0].others) == 2
    said = [item.reason for item in package.manifest.plan if item.kind == "light-of-segments"]
    for text, other in zip(said, report.programs[0].others, strict=True):
        judged = [style for style in other.styles if style.least is not None]
        least = min(judged, key=lambda style: style.least_kept_light)
        kept = f"{least.least} keeps {least.least_kept_light:.2f} of its light"
        assert text.startswith(f"{kept} at level {other.level}, ")


def test_what_is_outside_all_segments_takes_no_voxels_from_them(tmp_path):
    """A bright sheet between two segments keeps little of its light; votes for it would cut both of them."""
    x = np.indices((24, 24, 24))[0]
    labels = np.select([x == 11, x < 11, x < 16], [0, 1, 2])
    values = np.where(labels > 0, 40, np.where(x == 11, 250, 0))
    for name, voxels in (("scan", values.astype(np.uint8)), ("labels", labels.astype(np.int16))):
        nibabel.save(nibabel.Nifti1Image(voxels, AFFINE), tmp_path / f"{name}.nii")
    package = built(tmp_path, "sheet", coarsest=6, border="mixed", style=[])
    held = held_labels(package.manifest.textures, 2, package.read_bytes)
    np.testing.assert_array_equal(
        held, coarse_labels(labels.T.astype(np.uint16), package.manifest.levels[2].factors_zyx)
    )


@pytest.mark.long
def test_smoothed_borders_follow_from_the_scan_and_their_losses_are_said(folder):
    package = built(folder, "smooth", border="mixed", smoothing_mm=2.0)
    remarks = [item.reason for item in package.manifest.plan if item.kind == "source-of-segments"]
    (said,) = [each for each in remarks if "smoothed with a Gaussian of 2 mm" in each]
    assert "segments 200 are too thin and vanish" in said
    assert package.manifest.segments.sha256 != built(folder, "rough", border="mixed").manifest.segments.sha256
    report = validate(package.path, folder / "smooth.report", witness=False)
    assert report.verdict.passed


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"smoothing_mm": 10.0}, "VP3225"),
        ({"style": [{"labels": ["liver"]}]}, "VP3222"),
        ({"inside": "bone"}, "VP3223"),
    ],
)
def test_wishes_that_cannot_be_are_refused(folder, change, code):
    with pytest.raises(VolprepError, match=code):
        built(folder, "bad", **change)


@pytest.mark.parametrize("render", [{"compositing": "average"}, {"technique": "view-slices-as-published"}])
def test_what_segments_do_not_go_with_is_refused(folder, render):
    scene = scene_of(folder, border="mixed")
    scene = scene.model_copy(update={"render": scene.render.model_copy(update=render)})
    with pytest.raises(VolprepError, match="VP3220"):
        build(Request(scene, load_profile("gles3", folder), None), folder / "bad.volpkg", Silent())


def test_devices_without_shaders_draw_no_segments(folder):
    with pytest.raises(VolprepError, match=r"VP3220 .*gles1, which has no shaders"):
        build(
            Request(scene_of(folder, border="mixed"), load_profile("gles1", folder), None),
            folder / "bad.volpkg",
            Silent(),
        )
