"""Leaving out: items are taken out and put in, measured against the planned package, and judged."""

import json

import pytest
from judged import validate
from phantom_scene import write_phantom_scene
from scene_builds import built

from volprep.lab.ablation import gauge, judge, measure
from volprep.lab.ablation.judge import MOST_CHANGE, judged_added, judged_without, level_outcome, table_outcome
from volprep.lab.ablation.measure import ITEMS, measure_ablation
from volprep.lab.ablation.page import ablation_page
from volprep.lab.ablation.records import FAULTS, Ablation, AblationRow, Measurement, Ratio, name_of
from volprep.lab.studies import ABLATION
from volprep.pipeline import make_plan
from volprep.plan.crop import choose_crop
from volprep.scene.scene import Scene
from volprep.validation.results.measurements import Driver
from volprep.validation.results.report import PackageFacts, Report
from volprep.validation.subjects.scan import find_scan
from volprep.validation.verdicts.verdict import Verdict
from volprep_cli.main import command_line
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

NAMED = {item.name: item for item in ITEMS}
FEW = ("empty border", "16-bit values", "skip table", "bricks", "shadows", "technique slabs")
"""Each is a build or two."""
TOLERANCE = Tolerance(rmse=0.02, maximum=0.25)
LOOSE = "[tolerance]\nrmse = 0.04\nmaximum = 1.0\nflip = 0.3\nkept_light = 0.0\n"
"""Codes of 8 bits, which change a view by RMSE 0.017, are enough for it: one decision may take half."""


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return built(write_phantom_scene(tmp_path_factory.mktemp("ablation"), more=LOOSE)).path


@pytest.fixture(scope="module")
def found(package, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(measure, "ITEMS", tuple(NAMED[name] for name in FEW))
        patch.setattr(gauge, "_LEAST_TURNS", 2)
        patch.setattr(gauge, "_SECONDS", 0.0)
        # Of two turns on a busy machine nothing is faster for sure; what times say is judged below, with given ones.
        patch.setattr(judge, "_CLEARLY_FASTER", 0.0)
        folder = tmp_path_factory.mktemp("scratch")
        return measure_ablation(Package.open(package).manifest, find_scan(package, None), folder, Silent(), 48)


def row_of(found: Ablation, name: str) -> AblationRow:
    return next(row for row in found.rows if name_of(row) == name)


@pytest.mark.long
def test_each_item_of_the_package_has_a_row_and_says_which_way_it_went(found) -> None:
    names = [name_of(row) for row in found.rows]
    assert len(names) == len(set(names))
    assert not row_of(found, "empty border").kept
    assert not row_of(found, "bricks").kept
    assert row_of(found, "skip table of core").kept
    assert {f"level {k} of shell" for k in (1, 2)} <= set(names)
    assert {"level 0", "lookup table shell", "lookup table core", "shaders"} <= set(names)
    assert all(row.finding for row in found.rows)


@pytest.mark.long
def test_a_technique_that_takes_the_same_samples_is_rightly_left_out(found) -> None:
    row = row_of(found, "technique slabs")
    assert not row.kept
    assert row.outcome == "rightly left out"
    assert {each.name for each in ITEMS if each.name.startswith("technique")} == {
        "technique slabs",
        "technique tiles",
        "technique two-pass",
    }


@pytest.mark.long
def test_shadows_are_asked_about_where_the_scene_has_them(found) -> None:
    assert "shadows" not in {row.item for row in found.rows}


@pytest.mark.long
def test_what_no_program_can_draw_without_earns_its_place(found) -> None:
    for name in ("level 0", "lookup table core", "shaders"):
        row = row_of(found, name)
        assert row.outcome == "earns its place"
        # The package that could not be drawn is gone: its place says nothing.
        assert f"VP5018 {name}: the package cannot draw" in row.finding
        assert "/" not in row.finding


@pytest.mark.long
def test_a_border_and_bricks_are_rightly_left_out_and_cost_bytes(found) -> None:
    for name in ("empty border", "bricks"):
        row = row_of(found, name)
        assert row.outcome == "rightly left out", row.finding
        assert row.change_maximum <= MOST_CHANGE
        assert row.other.gpu_bytes > found.planned.gpu_bytes
        assert row.other.package_bytes > found.planned.package_bytes


@pytest.mark.long
@pytest.mark.parametrize("reach", [1, 0])
def test_a_border_that_light_reads_is_told_from_the_place_of_samples(reach, tmp_path, monkeypatch) -> None:
    """Gradients of the outermost voxels that are seen reach one voxel into the border."""
    monkeypatch.setattr(make_plan, "choose_crop", lambda *given, **_: choose_crop(*given, reach=reach))
    monkeypatch.setattr(measure, "ITEMS", (NAMED["empty border"],))
    monkeypatch.setattr(gauge, "_LEAST_TURNS", 2)
    monkeypatch.setattr(gauge, "_SECONDS", 0.0)
    monkeypatch.setattr(judge, "_CLEARLY_FASTER", 0.0)
    scene = write_phantom_scene(tmp_path)
    text = scene.read_text(encoding="utf-8").replace("value = 200.0", "value = 400.0")
    text = text.replace("value = 600.0", "value = 410.0").replace("extinction_per_mm = 0.2", "extinction_per_mm = 5.0")
    text = text[: text.rindex("[[transfer]]")] + '[render]\nlighting = "headlight"\n'
    scene.write_text(text, encoding="utf-8")
    built(scene, tmp_path / "lit.volpkg")
    judged_by = find_scan(tmp_path / "lit.volpkg", None)
    (tmp_path / "scratch").mkdir()
    measured = measure_ablation(
        Package.open(tmp_path / "lit.volpkg").manifest, judged_by, tmp_path / "scratch", Silent(), 48
    )
    row = row_of(measured, "empty border")
    assert row.outcome == ("rightly left out" if reach else "wrongly left out"), row.finding
    assert (row.change_maximum < 1e-6) == bool(reach)


@pytest.mark.long
def test_a_skip_table_changes_no_pixel(found) -> None:
    row = row_of(found, "skip table of core")
    assert row.change_maximum == 0.0
    assert row.other.ratio.turns == 2
    assert row.other.package_bytes < found.planned.package_bytes


@pytest.mark.long
def test_more_bits_change_pictures_and_the_change_is_told(found) -> None:
    row = row_of(found, "16-bit values")
    assert row.change_rmse > 0
    assert row.other.rmse <= found.planned.rmse
    assert row.outcome in {"rightly left out", "traded for bytes"}


@pytest.mark.long
def test_the_package_with_everything_is_larger_in_every_way(found) -> None:
    assert found.everything_has == ("empty border", "16-bit values")
    for field in ("package_bytes", "upload_bytes", "gpu_bytes"):
        assert getattr(found.everything, field) > 1.5 * getattr(found.planned, field)


@pytest.mark.long
def test_the_page_shows_every_row_and_the_data_come_back_as_they_were(found) -> None:
    page = ablation_page(found)
    for row in found.rows:
        assert name_of(row) in page
    assert "with everything" in page
    assert Ablation.model_validate_json(found.model_dump_json()) == found


def test_devices_without_shaders_are_refused(package, tmp_path) -> None:
    manifest = Package.open(package).manifest
    profile = manifest.profile.model_copy(update={"name": "old", "api": "es1.1"})
    with pytest.raises(VolprepError, match="VP6080 --ablate needs shaders"):
        measure_ablation(
            manifest.model_copy(update={"profile": profile, "programs": ()}),
            find_scan(package, None),
            tmp_path,
            Silent(),
            32,
        )


def measured(ratio: tuple[float, float, float] | None = (1.0, 1.0, 1.0), **changes: float) -> Measurement:
    spread = None if ratio is None else Ratio(low=ratio[0], median=ratio[1], high=ratio[2], turns=15)
    given = dict.fromkeys(("package_bytes", "transport_bytes", "upload_bytes", "gpu_bytes"), 100)
    return Measurement(**{**given, "milliseconds": 1, "rmse": 0.001, "maximum": 0.01, **changes}, ratio=spread)


def a_row(other: Measurement, change: float, *, kept: bool, chosen_by: str = "plan") -> AblationRow:
    return AblationRow(
        item="thing",
        kept=kept,
        chosen_by=chosen_by,
        reason=None,
        other=other,
        change_rmse=change / 2,
        change_maximum=change,
        outcome="not available",
        finding="",
    )


PLANNED = measured(None)
FASTER, SLOWER, ALIKE = (0.7, 0.75, 0.8), (1.2, 1.25, 1.3), (0.95, 1.0, 1.05)


@pytest.mark.parametrize(
    ("change", "ratio", "chosen_by", "outcome"),
    [
        (0.0, ALIKE, "plan", "rightly left out"),
        (0.9 * MOST_CHANGE, SLOWER, "plan", "rightly left out"),
        (1.1 * MOST_CHANGE, SLOWER, "plan", "wrongly left out"),
        (0.0, FASTER, "plan", "wrongly left out"),
        (0.0, FASTER, "scene", "rightly left out"),
        (0.0, (0.7, 0.85, 0.95), "plan", "rightly left out"),
    ],
)
def test_what_was_left_out_must_change_nothing_and_gain_nothing(change, ratio, chosen_by, outcome) -> None:
    row = a_row(measured(ratio), change, kept=False, chosen_by=chosen_by)
    assert judged_added(row, "time", PLANNED, TOLERANCE, lossy=False).outcome == outcome


@pytest.mark.parametrize(
    ("change", "outcome"),
    [(2 * MOST_CHANGE, "rightly left out"), (0.019, "traded for bytes"), (0.021, "wrongly left out")],
)
def test_what_trades_accuracy_may_take_half_of_the_tolerance(change, outcome) -> None:
    # The root mean square of these rows is half of their largest change.
    row = a_row(measured(ALIKE), change, kept=False)
    assert judged_added(row, "truth", PLANNED, TOLERANCE, lossy=True).outcome == outcome


def test_memory_that_could_be_saved_without_loss_was_wrongly_not_saved() -> None:
    smaller = a_row(measured(ALIKE, gpu_bytes=50), 0.0, kept=False)
    assert judged_added(smaller, "memory", PLANNED, TOLERANCE, lossy=True).outcome == "wrongly left out"
    larger = a_row(measured(ALIKE, gpu_bytes=150), 0.0, kept=False)
    assert judged_added(larger, "memory", PLANNED, TOLERANCE, lossy=True).outcome == "rightly left out"


@pytest.mark.parametrize(
    ("gain", "other", "change", "outcome"),
    [
        ("time", measured(SLOWER), 0.0, "earns its place"),
        ("time", measured(ALIKE), 0.0, "not distinguishable"),
        ("time", measured(FASTER), 0.0, "does not earn its place"),
        ("time", measured(FASTER, rmse=0.03), 0.0, "earns its place"),
        ("time", measured(FASTER, maximum=0.3), 0.0, "earns its place"),
        ("memory", measured(FASTER, gpu_bytes=101), 0.0, "earns its place"),
        ("memory", measured(SLOWER, gpu_bytes=100), 0.0, "does not earn its place"),
        ("truth", measured(FASTER, rmse=0.002), 3 * MOST_CHANGE, "earns its place"),
        ("truth", measured(SLOWER, rmse=0.002), 1.5 * MOST_CHANGE, "does not earn its place"),
        ("truth", measured(SLOWER, rmse=0.0005), 3 * MOST_CHANGE, "does not earn its place"),
        ("wish", measured(FASTER), 0.0, "earns its place"),
    ],
)
def test_what_is_kept_must_be_missed(gain, other, change, outcome) -> None:
    row = a_row(other, change, kept=True)
    assert judged_without(row, gain, PLANNED, TOLERANCE, ["editing is nothing"]).outcome == outcome


def test_a_wish_that_changes_nothing_does_not_earn_its_place() -> None:
    row = a_row(measured(ALIKE), 0.0, kept=True)
    assert judged_without(row, "wish", PLANNED, TOLERANCE, []).outcome == "does not earn its place"


@pytest.mark.parametrize(
    ("ratio", "upload", "outcome"),
    [
        (SLOWER, 90, "earns its place"),
        (FASTER, 50, "earns its place"),
        (FASTER, 51, "does not earn its place"),
        (ALIKE, 51, "not distinguishable"),
    ],
)
def test_a_level_is_faster_or_half_the_upload_of_the_next_finer_one(ratio, upload, outcome) -> None:
    assert level_outcome(a_row(measured(ratio), 0.0, kept=True), 0, upload).outcome == outcome


def test_a_level_is_nearer_to_the_scan_with_its_own_table() -> None:
    row = a_row(PLANNED, 0.0, kept=True)
    assert table_outcome(row, 0.01, 0.02).outcome == "earns its place"
    assert table_outcome(row, 0.02, 0.01).outcome == "does not earn its place"


@pytest.mark.long
def test_what_the_scene_asks_for_is_no_fault_of_the_plan(found) -> None:
    wrong = row_of(found, "bricks").model_copy(update={"outcome": "wrongly left out"})
    of_plan = wrong.model_copy(update={"item": "mine", "chosen_by": "plan"})
    assert found.model_copy(update={"rows": (wrong, of_plan)}).faults == ("mine",)


def test_every_item_says_how_a_scene_has_it_and_how_it_has_not() -> None:
    scene = Scene.model_validate(
        {
            "name": "s",
            "source": {"path": "x"},
            "transfer": [{"name": "t", "points": [{"value": 0, "colour": "#ffffff", "extinction_per_mm": 0.1}]}],
        }
    )
    for item in ITEMS:
        assert item.gain(scene) in {"time", "memory", "transport", "truth", "wish"}
        assert item.chosen_by(scene) in {"plan", "scene"}
        assert item.without
        # With shadows it would be another picture.
        assert (item.added(scene) is None) == (item.name in {"shadows", "baked light"})


def reported(ablation: Ablation, monkeypatch) -> None:
    """Let the command line get a report with this ablation, and nothing else."""
    verdict = Verdict.model_construct(code="within", levels=())
    driver = Driver(vendor="v", renderer="r", version="3")
    report = Report.model_construct(
        verdict=verdict, programs=(), witness=None, derivation=None, tolerance=TOLERANCE, driver=driver
    )

    def validated(_package, folder, *_, studies, **__):
        assert studies == [ABLATION]
        (folder / "studies").mkdir(parents=True)
        (folder / "studies" / "ablation.json").write_text(ablation.model_dump_json())
        return report

    monkeypatch.setattr("volprep.report.validate.validate", validated)


@pytest.mark.long
def test_a_plan_that_is_wrong_ends_with_status_1_and_its_items(found, monkeypatch, capsys, tmp_path) -> None:
    wrong = row_of(found, "bricks").model_copy(update={"outcome": "wrongly left out", "chosen_by": "plan"})
    right = [row for row in found.rows if row.outcome not in FAULTS]
    reported(found.model_copy(update={"rows": (*right, wrong)}), monkeypatch)
    arguments = ["validate", "p.volpkg", "--ablate", "--report", str(tmp_path / "r")]
    with pytest.raises(VolprepError, match=r"VP6081 .*that do not pay \(1\): bricks") as caught:
        command_line(["validate"])(arguments, standalone_mode=False)
    assert caught.value.status is ExitStatus.TOLERANCE
    said = capsys.readouterr().out
    assert "with everything" in said
    assert "without skip table of core" in said


@pytest.mark.long
def test_a_plan_that_is_right_ends_well(found, monkeypatch, capsys, tmp_path) -> None:
    right = [row for row in found.rows if row.outcome not in FAULTS]
    reported(found.model_copy(update={"rows": tuple(right)}), monkeypatch)
    arguments = ["validate", "p.volpkg", "--ablate", "--report", str(tmp_path / "r")]
    command_line(["validate"])(arguments, standalone_mode=False)
    assert "rightly left out" in capsys.readouterr().out


@pytest.mark.long
def test_validate_writes_the_page_and_the_numbers(found, package, tmp_path, monkeypatch) -> None:
    facts = PackageFacts.model_construct(manifest=Package.open(package).manifest)
    stub = Report.model_construct(package=facts, generator="volprep")
    monkeypatch.setattr("volprep.report.validate.measure_package", lambda *_, **__: stub)
    monkeypatch.setattr("volprep.lab.studies.measure_ablation", lambda *_: found)
    monkeypatch.setattr("volprep.report.validate.page", lambda _, studies: studies[0].title)
    for _ in range(2):
        validate(package, tmp_path / "phantom.report", picture_size=32, studies=[ABLATION])
    names = sorted(path.name for path in (tmp_path / "phantom.report").iterdir())
    assert names == ["index.html", "pictures", "report.json", "studies"]
    assert (tmp_path / "phantom.report" / "index.html").read_text() == "Leaving out"
    data = json.loads((tmp_path / "phantom.report" / "studies" / "ablation.json").read_text())
    assert len(data["rows"]) == len(found.rows)
