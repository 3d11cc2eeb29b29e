"""What devices send back: read as foreign files, put into the report, and used by the plan."""

import json
import re
import shutil
from pathlib import Path

import jsonschema
import pytest
from command_line import volprep
from device_files import device_record_text

from volprep.plan.device_choice import choose_for_frame
from volprep.plan.device_files import ENDING, read_device, read_devices
from volprep.plan.device_records import DeviceRecord
from volprep.report.page import page
from volprep_formats.diagnostics import ExitStatus, VolprepError

SCHEMA = Path(__file__).parents[2] / "formats" / "schemas" / "device.schema.json"


def record(**changes: object) -> DeviceRecord:
    return DeviceRecord.model_validate_json(device_record_text(**changes))


def of_phantom(phantom) -> str:
    """A measurement of the phantom's package."""
    manifest = phantom.report.package.manifest
    sources = [{"channel": each.name, "sha256": each.source.sha256} for each in manifest.channels]
    digest = phantom.report.package.manifest_sha256
    return device_record_text(manifest_sha256=digest, sources=sources, profile=manifest.profile.name)


def test_the_schema_takes_a_measurement_and_refuses_one_with_a_foreign_key() -> None:
    validator = jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text(encoding="utf-8")))
    assert validator.is_valid(json.loads(device_record_text()))
    assert not validator.is_valid(json.loads(device_record_text(home="/home/me")))


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "Invalid JSON"),
        (b"\x00" * 300_000, "more than 262144 bytes"),
        (device_record_text(version="9.0").encode(), "version"),
        (device_record_text(seconds=-1.0).encode(), "seconds"),
        (device_record_text(generator="x" * 200).encode(), "generator"),
        (device_record_text(seconds=float("nan")).encode(), "seconds"),
        (device_record_text(generator="a\x1b[2J").encode(), "generator"),
        (device_record_text(generator="a\u202eb").encode(), "generator"),
    ],
)
def test_a_file_that_is_no_measurement_is_refused(tmp_path, content, problem) -> None:
    path = tmp_path / f"a{ENDING}"
    path.write_bytes(content)
    with pytest.raises(VolprepError, match=f"VP7036 .*{problem}"):
        read_device(path)


def test_a_folder_gives_its_measurements_in_order_and_nothing_else(tmp_path) -> None:
    for name, seconds in (("b", 2.0), ("a", 1.0)):
        (tmp_path / f"{name}{ENDING}").write_text(device_record_text(seconds=seconds))
    (tmp_path / "notes.txt").write_text("not for us")
    assert [each.seconds for each in read_devices(tmp_path, "0" * 64)] == [1.0, 2.0]


def test_a_measurement_of_another_package_is_refused(tmp_path) -> None:
    (tmp_path / f"a{ENDING}").write_text(device_record_text(manifest_sha256="5" * 64))
    with pytest.raises(VolprepError, match=r"VP7037 .*phantom .*555555555555.*000000000000"):
        read_devices(tmp_path, "0" * 64)


def test_a_folder_that_is_not_there_is_told_of(tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP7036"):
        read_devices(tmp_path / "nowhere", "0" * 64)


@pytest.mark.parametrize(
    ("frame_ms", "level", "step_mm", "given_up"),
    [(100.0, 0, 0.25, 0.0), (82.0, 0, 0.25, 0.0), (81.0, 0, 0.5, 0.001), (34.0, 1, 0.5, 0.003), (16.0, 1, 1.0, 0.006)],
)
def test_the_least_error_in_time_is_chosen_by_the_slowest_time(frame_ms, level, step_mm, given_up) -> None:
    (choice,) = choose_for_frame(record(), frame_ms).choices
    assert (choice.chosen.level, choice.chosen.step_mm) == (level, step_mm)
    assert choice.given_up_rmse == pytest.approx(given_up)
    assert (choice.best.level, choice.best.step_mm) == (0, 0.25)


def test_a_frame_that_nothing_keeps_is_refused_with_the_fastest() -> None:
    with pytest.raises(VolprepError, match=r"VP7038 Adreno .* level 1 with a step of 1 mm, takes up to 15\.5 ms"):
        choose_for_frame(record(), 10.0)


def test_spread_and_throttling_are_marked() -> None:
    measured = record(throttling={"first_ms": 40.0, "last_ms": 50.0})
    assert measured.throttling.throttled
    assert not record().throttling.throttled
    (program,) = measured.programs
    assert [point.steady for point in program.points] == [True, True, False, True, True]


def test_the_report_has_a_curve_and_a_row_for_each_device_and_foreign_text_stays_text(phantom) -> None:
    hostile = {"gpu": "<script>alert(1)</script>", "browser": "$\\frac$ _"}
    other = json.loads(device_record_text())["device"] | hostile
    devices = (record(), record(device=other, throttling={"first_ms": 1.0, "last_ms": 2.0}))
    text = page(phantom.report.model_copy(update={"devices": devices}))
    section = text[text.index('<section id="devices">') :].partition("</section>")[0]
    assert section.count('<th scope="row"') == 2
    # In the legends of the wide and of the narrow plot.
    assert section.count("&lt;script&gt;alert(1)&lt;/script&gt;, $\\frac$") == 2
    assert "100 %" in section
    assert "<script>" not in text


def test_a_report_without_devices_says_nothing_of_them(phantom) -> None:
    assert phantom.report.devices == ()
    assert "On devices" not in (phantom.report_folder / "index.html").read_text(encoding="utf-8")


def test_plan_chooses_for_a_device_and_says_what_it_gives_up(phantom, tmp_path) -> None:
    file = tmp_path / f"phone{ENDING}"
    file.write_text(of_phantom(phantom))
    scene = phantom.package.with_suffix(".toml")
    done = volprep("plan", scene, "--device", file, "--frame-ms", "36")
    assert done.returncode == 0, done.stderr
    assert "Adreno (TM) 750: the least error in 36 ms, for pictures of 48×48 pixels" in done.stdout
    assert re.search(
        r"shell +1 +0\.5 mm +30 \(29\.5 to 31\) +0\.004 .* RMSE 0\.003: level 0 with 0\.25 mm has 0\.001, in up to 82 ",
        done.stdout,
    )
    as_json = json.loads(volprep("plan", scene, "--device", file, "--frame-ms", "36", "--json").stdout)
    assert as_json["device"]["choices"][0]["chosen"]["level"] == 1
    assert as_json["stages"]


def test_plan_refuses_a_device_that_measured_another_scan_or_profile(phantom, tmp_path) -> None:
    file = tmp_path / f"phone{ENDING}"
    file.write_text(device_record_text())
    scene = phantom.package.with_suffix(".toml")
    done = volprep("plan", scene, "--device", file)
    assert (done.returncode, "VP7037" in done.stderr) == (ExitStatus.USAGE, True)
    file.write_text(of_phantom(phantom))
    done = volprep("plan", scene, "--device", file, "--profile", "gles2-2048")
    assert (done.returncode, "VP7037" in done.stderr) == (ExitStatus.USAGE, True)


@pytest.mark.long
def test_validate_puts_a_folder_of_devices_into_the_report(phantom, tmp_path) -> None:
    folder = tmp_path / "devices"
    folder.mkdir()
    (folder / f"phone{ENDING}").write_text(of_phantom(phantom))
    place = tmp_path / "with.report"
    done = volprep("validate", phantom.package, "--report", place, "--size", "16", "--devices", folder)
    assert done.returncode in {ExitStatus.OK, ExitStatus.TOLERANCE}, done.stderr
    data = json.loads((place / "report.json").read_text(encoding="utf-8"))
    assert [each["device"]["gpu"] for each in data["devices"]] == ["Adreno (TM) 750"]
    assert '<section id="devices">' in (place / "index.html").read_text(encoding="utf-8")
    shutil.copy(folder / f"phone{ENDING}", folder / f"other{ENDING}")
    (folder / f"other{ENDING}").write_text(device_record_text())
    refused = volprep("validate", phantom.package, "--report", tmp_path / "no.report", "--devices", folder)
    assert (refused.returncode, "VP7037" in refused.stderr) == (ExitStatus.USAGE, True)
    assert not (tmp_path / "no.report").exists()
