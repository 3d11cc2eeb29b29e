"""What a scan is drawn as of which nobody has said anything."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.prepare import prepare
from volprep.scan.statistics import SlabMeasurer
from volprep.scene.first_look import with_first_look, with_segment_styles
from volprep.scene.presets import load_preset
from volprep.scene.profiles import load_profile
from volprep.scene.request import request_for_source
from volprep.scene.scene import Scene
from volprep.truth.camera import widest_view
from volprep.truth.path_traced import LUMINANCE
from volprep.truth.strip import strip
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.channel import Statistics
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.progress import Silent
from volprep_formats.source import SourceInfo

GLES3 = load_profile("gles3", Path())
NO_FACES = (np.full((2, 1), -np.inf),) * 3


def look(
    values: list[float],
    unit: str = "",
    *,
    labels: bool = False,
    level_set: bool = False,
    label_table: str | None = None,
    profile=GLES3,
    spacing_mm: float = 1.0,
    far_mm: float = 1.0,
    modality: str = "",
):
    voxels = np.array(values, np.float32).reshape(1, 1, -1)
    grid = Grid.of(voxels.shape, (spacing_mm, spacing_mm, spacing_mm * far_mm))
    info = SourceInfo(format="raw", grid=grid, stored_type="float32", unit=unit, level_set=level_set, modality=modality)
    gauge = SlabMeasurer(info)
    gauge.add(voxels)
    points = [{"value": 0.0, "colour": "#ffffff", "extinction_per_mm": 0.0}]
    source = {"path": "x", "labels": labels, "label_table": label_table}
    scene = Scene.model_validate({"name": "s", "source": source, "transfer": [{"name": "none", "points": points}]})
    measured = gauge.result("0" * 64)
    sample = voxels.astype(np.float64).ravel()
    return with_first_look(scene, profile, info, measured.statistics, sample, faces=NO_FACES)


def named(scene: Scene) -> str:
    (transfer,) = scene.transfer
    return transfer.name


def test_a_table_of_labels_for_values_that_are_none_is_refused() -> None:
    assert named(look([0, 1, 2], labels=True, label_table="freesurfer")) == "labels"
    with pytest.raises(VolprepError, match=r"VP3027 the table of labels freesurfer .*Give --labels"):
        look([0, 5, 9], label_table="freesurfer")


def test_each_kind_of_values_gets_a_look_of_its_own() -> None:
    assert named(look([0, 1, 2], labels=True)) == "labels"
    assert named(look([-1000, 0, 1500], "HU")) == "ct-bone"
    assert named(look([-1000, 0, 80], "HU")) == "ct-soft-tissue", "no bone in it, so ct-bone would show nothing"
    assert named(look([-3, 0, 5])) == "signed"
    assert named(look([0, 5, 9])) == "object"
    assert named(look([-1, 5, 9])) == "object", "a little below 0, as filters ring"
    assert named(look([7, 7])) == "grey"


def test_a_scan_of_one_value_has_no_jump_at_that_value() -> None:
    first, last = look([7, 7]).transfer[0].points
    assert (first.colour, first.extinction_per_mm) == (last.colour, last.extinction_per_mm)
    assert last.extinction_per_mm > 0.0


def test_a_small_object_in_a_field_of_one_value_is_lit_from_half_of_its_value_on() -> None:
    scene = look([0.0] * 4000 + [17.0] * 3)
    assert named(scene) == "object"
    assert scene.render.lighting == "headlight"
    assert "values up to 8.5 are background" in scene.recognised


@pytest.mark.parametrize("highest", [80, 1500])
def test_a_small_piece_of_a_ct_is_as_opaque_in_all_as_a_body(highest: int) -> None:
    body, piece = (look([-1000, 0, highest], "HU", spacing_mm=mm).transfer[0].resolved() for mm in (100.0, 5.0))
    diagonal_mm = np.hypot(15.0, np.hypot(5.0, 5.0))
    assert [point.value for point in piece.points] == [point.value for point in body.points]
    for of_body, of_piece in zip(body.points, piece.points, strict=True):
        assert of_piece.extinction_per_mm == pytest.approx(of_body.extinction_per_mm * 150.0 / diagonal_mm)


def test_bones_are_lit_where_the_devices_can() -> None:
    assert look([-1000, 1500], "HU").render.lighting == "headlight"
    assert look([-1000, 1500], "HU", profile=load_profile("gles1", Path())).render.lighting == "none"
    assert look([-3, 5]).render.lighting == "none"
    assert look([0, 5, 9]).render.lighting == "headlight"
    assert look([0, 5, 9], profile=load_profile("gles1", Path())).render.lighting == "none"


def test_a_level_set_is_a_lit_surface_where_the_devices_can() -> None:
    scene = look([-3, 0, 5], level_set=True)
    assert named(scene) == "surface"
    assert (scene.render.compositing, scene.render.lighting) == ("isosurface", "headlight")
    assert scene.transfer[0].resolved().isovalue == 0.0
    assert named(look([-3, 0, 5], level_set=True, profile=load_profile("gles1", Path()))) == "signed"
    assert named(look([1, 5], level_set=True)) == "object", "it has no surface"


def test_a_signed_map_shows_nothing_at_0_and_is_as_dense_below_as_above() -> None:
    function = look([-4, 0, 8]).transfer[0].resolved()
    at = {(point.value, point.colour): point.extinction_per_mm for point in function.points}
    values = {value: extinction for (value, _), extinction in at.items()}
    assert values[0.0] == 0.0
    assert values[-4.0] / 4 == pytest.approx(values[8.0] / 8)
    assert len({colour for _, colour in at}) == 2


def mixed(**peaks: tuple[float, float, int]) -> list[float]:
    """Return values around some places: mean, spread and count of each."""
    random = np.random.default_rng(8)
    return np.concatenate([random.normal(mean, spread, count) for mean, spread, count in peaks.values()]).tolist()


@pytest.mark.parametrize("offset", [1024, 1000])
def test_a_ct_is_recognised_also_if_its_values_are_offset(offset: int) -> None:
    values = mixed(air=(-1000, 8, 500), tissue=(40, 15, 300), bone=(900, 150, 60))
    scene = look([value + offset for value in values])
    assert named(scene) == "ct-bone"
    assert f"{offset} above Hounsfield" in scene.recognised
    bone = scene.transfer[0].resolved().points
    assert [point.value - offset for point in bone] == [150.0, 260.0, 500.0, 1200.0, 3000.0]
    assert scene.render.lighting == "headlight"


@pytest.mark.parametrize(
    "peaks",
    [
        {"air": (-1000, 20, 600), "tissue": (40, 25, 300), "contrast": (180, 20, 60)},
        {"air": (-1000, 20, 9300), "tissue": (100, 25, 300), "fat": (-100, 60, 300), "bone": (720, 60, 100)},
    ],
    ids=["without bone", "small body"],
)
def test_values_that_are_hounsfield_units_need_no_bone_and_little_tissue(peaks: dict) -> None:
    values = mixed(**peaks)
    assert look(values).recognised.startswith("recognised as a CT, preset ct-")
    # The same values with an offset may be of anything else.
    assert named(look([value + 1000 for value in values])) == "object"


def test_an_unusual_offset_of_a_ct_is_estimated() -> None:
    values = mixed(air=(-1000, 8, 500), tissue=(40, 15, 300), bone=(900, 150, 60))
    scene = look([value + 2024 for value in values])
    assert scene.transfer[0].points[0].value == pytest.approx(2024 + 150, abs=20)


def test_an_mr_is_no_ct_and_its_background_is_transparent() -> None:
    values = mixed(field=(0, 5, 600), tissue=(1000, 90, 400))
    scene = look([abs(value) for value in values])
    assert named(scene) == "object"
    first = scene.transfer[0].points[0]
    assert first.opacity == 0.0
    assert 100 < first.value < 700, "above the noise, below the tissue"


def test_bright_vessels_stay_visible_behind_tissue() -> None:
    values = mixed(field=(0, 4, 500), tissue=(100, 9, 480), vessels=(330, 12, 8))
    scene = look([abs(value) for value in values])
    assert "bright vessels" in scene.recognised
    opacity = {round(point.value): point.opacity for point in scene.transfer[0].points}
    assert max(value for place, value in opacity.items() if place < 150) <= 0.05
    assert max(value for place, value in opacity.items() if place > 230) >= 0.95


def test_a_stack_of_few_slices_looks_as_its_slices_do() -> None:
    voxels = np.random.default_rng(1).integers(0, 200, (5, 40, 40)).astype(np.float32)
    grid = Grid.of(voxels.shape, (1.0, 1.0, 1.0))
    info = SourceInfo(format="raw", grid=grid, stored_type="float32")
    gauge = SlabMeasurer(info)
    gauge.add(voxels)
    statistics = gauge.result("0" * 64).statistics
    scene = with_first_look(look([0, 1]), GLES3, info, statistics, voxels.astype(np.float64).ravel(), faces=NO_FACES)
    assert named(scene) == "slices"


def test_a_thin_stack_of_a_ct_is_drawn_as_its_slices_look_whatever_its_padding() -> None:
    voxels = np.full((2, 40, 40), -2000, np.float32)
    voxels[:, 8:32, 8:32] = 40
    info = SourceInfo(format="dicom", grid=Grid.of(voxels.shape, (1.0, 1.0, 1.0)), stored_type="float32", unit="HU")
    gauge = SlabMeasurer(info)
    gauge.add(voxels)
    scene = with_first_look(
        look([0, 1]), GLES3, info, gauge.result("0" * 64).statistics, voxels.astype(np.float64).ravel(), faces=NO_FACES
    )
    assert named(scene) == "slices"
    assert [point.value for point in scene.transfer[0].points] == [-200, -150, 300]


@pytest.mark.parametrize(
    ("extent_zyx", "view"),
    [((30, 40, 50), "anterior-left"), ((5, 40, 50), "inferior"), ((40, 5, 50), "anterior"), ((40, 50, 5), "left")],
)
def test_a_flat_volume_is_looked_at_from_its_widest_side(extent_zyx: tuple[int, int, int], view: str) -> None:
    assert widest_view(Grid.of(extent_zyx, (1.0, 1.0, 1.0))) == view


@pytest.mark.parametrize(("values", "expected"), [([-4.0, np.nan, 8.0], 0.0), ([3.0, np.nan, 8.0], 3.0)])
def test_nan_is_outside_where_no_scene_says_another_value(tmp_path: Path, values: list[float], expected: float) -> None:
    np.save(tmp_path / "map.npy", np.array(values * 4, np.float32).reshape(3, 2, 2))
    request = request_for_source(tmp_path / "map.npy")
    imported = import_draft(prepare(request), tmp_path / "draft", Silent())
    assert imported.scene.source.nan == expected
    assert any("NaN got the value" in remark for remark in imported.draft.manifest.source.info.remarks)
    told = import_draft(prepare(request.with_source(nan=9.0)), tmp_path / "other", Silent())
    assert told.draft.manifest.statistics.maximum == 9.0


def test_a_scan_of_nothing_but_nan_is_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "map.npy", np.full((3, 2, 2), np.nan, np.float32))
    request = request_for_source(tmp_path / "map.npy")
    with pytest.raises(VolprepError, match="VP1090"):
        import_draft(prepare(request), tmp_path / "draft", Silent())


def test_a_strip_shows_the_colours_of_a_function_over_black() -> None:
    ends = [TransferPoint(value=v, colour=(1.0, 0.0, 0.0), extinction_per_mm=e) for v, e in ((0.0, 0.0), (1.0, 1e6))]
    colours = strip(TransferFunction(name="f", points=tuple(ends)), 3)
    assert colours == [(0, 0, 0), (255, 0, 0), (255, 0, 0)]


def with_segments(profile: str, holding: Sequence[int] = (), **render: str) -> Scene:
    """Return the first look of a scan with segments, for what the options say of its picture."""
    info = SourceInfo(format="raw", grid=Grid.of((20, 20, 20), (1.0, 1.0, 1.0)), stored_type="float32")
    gauge = SlabMeasurer(info)
    gauge.add(np.linspace(0.0, 100.0, 8000, dtype=np.float32).reshape(20, 20, 20))
    points = [{"value": 0.0, "colour": "#ffffff", "extinction_per_mm": 0.0}]
    table = {"name": "s", "source": {"path": "x"}, "transfer": [{"name": "none", "points": points}]}
    scene = Scene.model_validate({**table, "segments": {"source": "organs.nii"}, "render": render})
    return with_segment_styles(scene, load_profile(profile, Path()), info, gauge.result("0" * 64).statistics, holding)


@pytest.mark.parametrize(("profile", "lighting"), [("gles3", "headlight"), ("gles1", "none")])
def test_segments_are_lit_and_dense_in_a_thin_veil(profile, lighting):
    shown = with_segments(profile)
    assert (shown.render.lighting, [each.name for each in shown.transfer][-1]) == (lighting, "inside")
    assert shown.segments is not None
    veil = max(point.extinction_per_mm for point in shown.transfer[0].resolved().points)
    inside = min(point.extinction_per_mm for point in shown.transfer[1].resolved().points)
    assert inside > 10 * veil * shown.segments.outside_opacity


def test_a_segment_that_holds_others_does_not_hide_them():
    shown = with_segments("gles3", holding=(7,))
    assert shown.segments is not None
    (style,) = shown.segments.style
    assert style.labels == (7,)
    dense_per_mm = min(point.extinction_per_mm for point in shown.transfer[1].resolved().points)
    assert 0.3 < style.opacity * dense_per_mm * 20 < 2.0
    assert "segments around others are faint: 7" in shown.recognised


def test_slices_of_a_thin_stack_are_tinted_by_its_segments_without_veil_or_light():
    info = SourceInfo(format="raw", grid=Grid.of((3, 40, 40), (1.0, 1.0, 1.0)), stored_type="float32", unit="HU")
    gauge = SlabMeasurer(info)
    values = np.linspace(-1000.0, 1500.0, 4800, dtype=np.float32)
    gauge.add(values.reshape(3, 40, 40))
    statistics = gauge.result("0" * 64).statistics
    points = [{"value": 0.0, "colour": "#ffffff", "extinction_per_mm": 0.0}]
    table = {"name": "s", "source": {"path": "x"}, "transfer": [{"name": "none", "points": points}]}
    scene = Scene.model_validate({**table, "segments": {"source": "organs.nii"}})
    looked = with_first_look(scene, GLES3, info, statistics, values.astype(np.float64), faces=NO_FACES)
    shown = with_segment_styles(looked, GLES3, info, statistics)
    assert shown.transfer == looked.transfer
    assert shown.render.lighting == "none"
    assert shown.segments is not None
    assert shown.segments.outside_opacity == 1.0
    assert "thin stack" in shown.recognised


@pytest.mark.parametrize(("render", "expected"), [({}, "auto"), ({"classification": "lookup"}, "lookup")])
def test_the_plan_chooses_how_segments_are_classified_where_nobody_says_it(render, expected):
    assert with_segments("gles3", **render).render.classification == expected


def test_segments_of_a_ct_have_a_veil_of_soft_tissue_also_if_the_file_states_no_unit():
    scene = look(mixed(air=(-1000, 8, 500), tissue=(40, 15, 300), bone=(900, 150, 60)))
    scene = Scene.model_validate({**scene.model_dump(exclude_unset=True), "segments": {"source": "organs.nii"}})
    info = SourceInfo(format="nifti", grid=Grid.of((1, 1, 860), (1.0, 1.0, 1.0)), stored_type="float32")
    shown = with_segment_styles(scene, GLES3, info, Statistics(minimum=-1030.0, maximum=1300.0, non_finite=0))
    assert [transfer.resolved().name for transfer in shown.transfer] == ["ct-soft-tissue", "inside"]


def test_the_veil_around_segments_of_a_ct_is_bright_enough_for_a_black_page():
    info = SourceInfo(format="nifti", grid=Grid.of((1, 1, 860), (1.0, 1.0, 1.0)), stored_type="float32", unit="HU")
    scene = look([-1000, 0, 1500], "HU")
    scene = Scene.model_validate({**scene.model_dump(exclude_unset=True), "segments": {"source": "organs.nii"}})
    shown = with_segment_styles(scene, GLES3, info, Statistics(minimum=-1030.0, maximum=1300.0, non_finite=0))
    veil, preset = shown.transfer[0].resolved(), load_preset("ct-soft-tissue")
    assert [point.value for point in veil.points] == [point.value for point in preset.points]
    assert [point.extinction_per_mm for point in veil.points] == [point.extinction_per_mm for point in preset.points]
    # Muscle has a luminance of 0.12: a tenth of it, which a thin veil shows, is nearly black.
    colours = [np.array(point.colour) for point in veil.points]
    assert min(colour @ LUMINANCE for colour in colours) > 0.33


def test_a_piece_cut_out_of_an_object_looks_as_its_slices_do_on_its_faces() -> None:
    voxels = np.random.default_rng(1).normal(100.0, 20.0, (30, 30, 30)).clip(1).astype(np.float32)
    info = SourceInfo(format="raw", grid=Grid.of(voxels.shape, (1.0, 1.0, 1.0)), stored_type="float32")

    def look_of(values):
        gauge = SlabMeasurer(info)
        gauge.add(values)
        found = gauge.result("0" * 64)
        return with_first_look(look([0, 1]), GLES3, info, found.statistics, found.rays_zyx[0], faces=found.faces)

    piece = look_of(voxels)
    assert named(piece) == "faces"
    whole = np.zeros_like(voxels)
    whole[6:24, 6:24, 6:24] = voxels[6:24, 6:24, 6:24]
    assert named(look_of(whole)) == "object"


@pytest.mark.parametrize(
    ("depth", "cut", "name"),
    [
        (20, slice(0, 20), "faces"),
        (20, slice(5, 20), "object"),
        (20, slice(5, 15), "object"),
        (60, slice(0, 60), "object"),
        (14, slice(0, 10), "faces"),
        (14, slice(2, 12), "object"),
    ],
    ids=["slab", "cut on one side", "whole", "long", "flat and cut on one side", "flat and whole"],
)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_slab_that_is_cut_open_looks_as_its_slices_do(depth, cut, name, axis) -> None:
    voxels = np.zeros((depth, 48, 48), np.float32)
    voxels[cut, 12:36, 12:36] = np.random.default_rng(1).normal(100.0, 20.0, (cut.stop - cut.start, 24, 24))
    voxels = np.ascontiguousarray(np.moveaxis(voxels, 0, axis))
    info = SourceInfo(format="raw", grid=Grid.of(voxels.shape, (1.0, 1.0, 1.0)), stored_type="float32")
    gauge = SlabMeasurer(info)
    gauge.add(voxels)
    found = gauge.result("0" * 64)
    sample = found.rays_zyx[0]
    assert named(with_first_look(look([0, 1]), GLES3, info, found.statistics, sample, faces=found.faces)) == name


@pytest.mark.parametrize(
    ("times", "far_mm", "modality", "name", "is_whole"),
    [
        (10.0, 4.0, "", "slices", True),
        (10.0, 2.0, "", "object", True),
        (10.0, 1.0, "MR", "object", True),
        (10.0, 1.0, "PT", "object", False),
        (1.0, 4.0, "", "object", True),
    ],
)
def test_a_spine_beside_its_coil_is_shown_whole(times, far_mm, modality, name, is_whole) -> None:
    rng = np.random.default_rng(4)
    tissue = rng.normal(100.0, 25.0, 6000).clip(20.0) * np.exp(-np.linspace(0.0, np.log(times), 6000))
    noise = np.abs(rng.normal(0.0, 2.0, 4000))
    scene = look([*tissue, *noise], far_mm=far_mm, modality=modality)
    assert named(scene) == name
    # An even scan of one brightness is a dark field and an object; the far end of an uneven one is a third of its end.
    (function,) = (each.resolved() for each in scene.transfer)
    (seen,) = (point.value for point in function.points[1:2])
    assert (seen < np.percentile(tissue, 30)) == is_whole


def head(**parts: tuple[float, float, int]) -> list[float]:
    """Return values of a CT of a head: air, soft tissue, and bone unless `parts` say something else."""
    usual = {"air": (-1000, 12, 6000), "fat": (-90, 15, 250), "tissue": (40, 15, 2600), "bone": (900, 150, 500)}
    return mixed(**{**usual, **parts})


@pytest.mark.parametrize(("slope", "added"), [(0.085, 85.0), (0.37, 607.0)], ids=["8 bits", "12 bits"])
def test_bones_stay_visible_behind_the_holder_of_a_head_in_other_units(slope: float, added: float) -> None:
    scene = look([slope * value + added for value in head(holder=(150, 8, 700))])
    assert "dense parts" in scene.recognised
    opacity = {(point.value - added) / slope: point.opacity for point in scene.transfer[0].points}
    assert max(value for hu, value in opacity.items() if hu < 320) <= 0.05
    assert max(value for hu, value in opacity.items() if hu < 700) >= 0.9
    assert scene.render.lighting == "headlight"


def test_dense_parts_need_one_tissue_around_them() -> None:
    assert "dense parts" not in look([0.1 * value for value in head(tissue=(40, 250, 2600))]).recognised
    assert "dense parts" not in look([0.1 * value for value in head(bone=(900, 150, 100))]).recognised


def test_slices_of_a_spine_are_bright_far_from_its_coil_too() -> None:
    rng = np.random.default_rng(4)
    tissue = rng.normal(100.0, 25.0, 6000).clip(20.0) * np.exp(-np.linspace(0.0, np.log(10.0), 6000))
    scene = look([*tissue, *np.abs(rng.normal(0.0, 2.0, 4000))], far_mm=4.0)
    points = scene.transfer[0].resolved().points
    shades = np.interp(np.percentile(tissue, [10, 50]), [p.value for p in points], [p.colour[0] for p in points])
    assert shades.min() > 0.1
    assert shades.max() > 0.3
