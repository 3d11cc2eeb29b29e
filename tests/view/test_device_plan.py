"""Times of a device on the canvas of an app, and the cheapest package for each device of a folder."""

import json
import re
from copy import deepcopy

import pytest
from command_line import volprep
from device_files import device_record_text

from volprep.plan.device_cheapest import DeviceLimits, cheapest
from volprep.plan.device_choice import choose_for_frame
from volprep.plan.device_files import ENDING
from volprep.plan.device_records import DeviceProgram, DeviceRecord
from volprep.plan.device_scaling import Canvas, canvas_of, growth_of
from volprep_formats.diagnostics import ExitStatus, VolprepError

SIZE = 48


def record(**changes: object) -> DeviceRecord:
    return DeviceRecord.model_validate_json(device_record_text(**changes))


def with_sizes(*times: tuple[int, float, float, float]) -> DeviceProgram:
    """A program that was timed in pictures of these sizes: median, fastest and slowest time."""
    (program,) = json.loads(device_record_text())["programs"]
    names = ("size", "draw_ms", "fastest_ms", "slowest_ms")
    program["sizes"] = [dict(zip(names, each, strict=True), draws=5) for each in times]
    return DeviceProgram.model_validate_json(json.dumps(program))


def square(size: int) -> Canvas:
    return Canvas(width=size, height=size)


def test_a_time_grows_along_the_line_of_the_measured_sizes() -> None:
    # 4 ms for a draw, and 1 ms for each 100 pixels.
    program = with_sizes((10, 5.0, 5.0, 5.0), (20, 8.0, 8.0, 8.0))
    growth = growth_of(program, 10, square(100))
    assert growth.factor.expected == pytest.approx(104 / 5)
    assert growth.ns_per_pixel.expected == pytest.approx(10_000.0)
    assert not growth.proportional
    assert growth_of(program, 10, square(20)).factor.expected == pytest.approx(8 / 5)


def test_the_uncertainty_is_that_of_the_fastest_and_the_slowest_times() -> None:
    program = with_sizes((10, 5.0, 4.5, 6.0), (20, 8.0, 7.5, 9.0))
    growth = growth_of(program, 10, square(30))
    # From the larger picture 500 more pixels, at 1.5, 3 and 4.5 ms for 300.
    assert growth.factor.least == pytest.approx((7.5 + 500 * 1.5 / 300) / 5)
    assert growth.factor.expected == pytest.approx((8.0 + 500 * 3.0 / 300) / 5)
    assert growth.factor.most == pytest.approx((9.0 + 500 * 4.5 / 300) / 5)
    point = program.points[0]
    time = growth.time_ms(point)
    assert time.most == pytest.approx(point.slowest_ms * growth.factor.most)
    assert time.least < time.expected < time.most


def test_one_size_is_scaled_in_proportion_and_says_so() -> None:
    growth = growth_of(with_sizes(), SIZE, square(2 * SIZE))
    assert (growth.factor.expected, growth.factor.most, growth.proportional) == (4.0, 4.0, True)


def test_a_smaller_canvas_is_not_taken_as_faster() -> None:
    for program in (with_sizes(), with_sizes((48, 40.0, 39.0, 41.0), (96, 148.0, 145.0, 152.0))):
        assert growth_of(program, SIZE, square(8)).factor.most == 1.0


@pytest.mark.parametrize("text", ["", "1170", "1170x", "0x10", "16385x10", "-1x5", "1e3x10", "10x10x10", "10 x 10"])
def test_what_is_no_canvas_is_refused(text) -> None:
    with pytest.raises(VolprepError, match=r"VP7044 .*--canvas 1170x2532"):
        canvas_of(text)


def test_a_device_takes_a_faster_draw_for_a_larger_canvas() -> None:
    (small,) = choose_for_frame(record(), 100.0).choices
    (large,) = choose_for_frame(record(), 100.0, square(2 * SIZE)).choices
    assert (small.chosen.level, small.chosen.step_mm) == (0, 0.25)
    # 3.8 times as long as measured, by the slowest times.
    assert (large.chosen.level, large.chosen.step_mm) == (1, 1.0)
    assert large.chosen_ms.expected == pytest.approx(15.0 * 148 / 40)
    with pytest.raises(VolprepError, match=r"VP7038 Adreno .* takes up to 1266\.1 ms"):
        choose_for_frame(record(), 100.0, canvas_of("320x640"))


def other_profile(profile: str, digit: str, **changes: object) -> dict:
    """A measurement of a package for another profile, on the same device."""
    found = json.loads(device_record_text(profile=profile, manifest_sha256=digit * 64))
    for level in found["programs"][0]["levels"]:
        level.update(deepcopy(changes))
    return found


def answer(found: list[dict], wish: DeviceLimits):
    (device,) = cheapest([DeviceRecord.model_validate_json(json.dumps(each)) for each in found], wish).devices
    return device


def test_the_cheapest_package_is_the_one_with_the_fewest_bytes_that_fits() -> None:
    gles3 = json.loads(device_record_text())
    gles2 = other_profile("gles2-2048", "2", form="ray-casting, RGBA mosaic", upload_bytes=30_000)
    # Within RMSE 0.01: level 0, or level 1 with a step of 0.5 mm. Level 1 has fewer bytes.
    chosen = answer([gles3], DeviceLimits(frame_ms=50.0, seen_rmse=0.01)).package
    assert (chosen.profile, chosen.draws[0].level, chosen.draws[0].step_mm) == ("gles3", 1, 0.5)
    assert answer([gles3, gles2], DeviceLimits(50.0, 0.01)).package.profile == "gles2-2048"
    assert answer([gles3, gles2], DeviceLimits(50.0, 0.01)).package.draws[0].form == "ray-casting, RGBA mosaic"
    # Level 1 is beyond this error.
    assert answer([gles3], DeviceLimits(50.0, 0.005)).package.draws[0].level == 0


def test_a_package_must_fit_each_time_that_it_was_measured() -> None:
    slow = json.loads(device_record_text())
    for point in slow["programs"][0]["points"]:
        point.update(draw_ms=900.0, fastest_ms=890.0, slowest_ms=910.0)
    assert answer([slow, json.loads(device_record_text())], DeviceLimits(50.0, 0.01)).package is None


def test_a_package_must_fit_with_each_of_its_transfer_functions() -> None:
    both = json.loads(device_record_text())
    second = deepcopy(both["programs"][0])
    second["transfer"] = "core"
    for point in second["points"]:
        point["seen_rmse"] = 0.5
    both["programs"].append(second)
    found = answer([both], DeviceLimits(50.0, 0.01))
    assert found.package is None
    assert found.reason == "the least error is 0.5 (gles3, core, level 0, step 0.25 mm)"


def test_the_transfer_function_that_binds_is_told() -> None:
    both = json.loads(device_record_text())
    second = deepcopy(both["programs"][0])
    second["transfer"] = "core"
    for point in second["points"]:
        point["slowest_ms"] = 10 * point["slowest_ms"]
    both["programs"].append(second)
    # The other one misses the time, too, by less.
    found = answer([both], DeviceLimits(frame_ms=10.0, seen_rmse=0.01))
    assert found.reason == "the fastest with this error takes up to 310 ms (gles3, core, level 1, step 0.5 mm)"


def test_why_nothing_fits_is_told() -> None:
    gles3 = json.loads(device_record_text())
    late = answer([gles3], DeviceLimits(frame_ms=10.0, seen_rmse=0.01))
    assert late.reason == "the fastest with this error takes up to 31 ms (gles3, shell, level 1, step 0.5 mm)"
    gles3["programs"][0]["points"] = []
    gles3["left_out"] = ["shell, level 0: no time"]
    assert answer([gles3], DeviceLimits(10.0, 0.01)).reason == "nothing was timed: shell, level 0: no time"


def folder_of(phantom, tmp_path, **devices: str):
    """A folder with a measurement of the phantom on each device: its GPU by the name of the file."""
    manifest = phantom.report.package.manifest
    sources = [{"channel": each.name, "sha256": each.source.sha256} for each in manifest.channels]
    folder = tmp_path / "phones"
    folder.mkdir()
    for name, gpu in devices.items():
        found = json.loads(device_record_text(sources=sources))
        found["device"]["gpu"] = gpu
        (folder / f"{name}{ENDING}").write_text(json.dumps(found))
    return folder


@pytest.mark.long
def test_plan_prints_the_cheapest_package_for_each_device_of_a_folder(phantom, tmp_path) -> None:
    folder = folder_of(phantom, tmp_path, a="Adreno (TM) 750", b="Mali-G715")
    (folder / f"other{ENDING}").write_text(device_record_text())
    scene = phantom.package.with_suffix(".toml")
    wishes = ("--devices", folder, "--canvas", "96x96", "--frame-ms", "160")
    done = volprep("plan", scene, *wishes, "--error", "0.01")
    assert done.returncode == 0, done.stderr
    assert "cheapest packages within RMSE 0.01 in 160 ms, for 96×96 pixels" in done.stdout
    rows = re.findall(
        r"(Adreno|Mali).* gles3 +shell +1 +0\.5 mm .*R8 3D texture +111 \(107 to 118\) +0\.008", done.stdout
    )
    assert rows == ["Adreno", "Mali"]
    assert "1 measurements of other scans are left out" in done.stderr
    as_json = json.loads(volprep("plan", scene, *wishes, "--error", "0.01", "--json").stdout)
    assert [each["package"]["draws"][0]["level"] for each in as_json["devices"]] == [1, 1]
    assert as_json["canvas"] == {"width": 96, "height": 96}
    none = volprep("plan", scene, *wishes, "--error", "0.0001")
    assert (none.returncode, "VP7046 2 of 2 devices" in none.stderr) == (ExitStatus.TOLERANCE, True)
    assert "no package fits: the least error is 0.002" in none.stdout


def test_plan_refuses_wishes_and_folders_that_make_no_sense(phantom, tmp_path) -> None:
    scene = phantom.package.with_suffix(".toml")
    empty = tmp_path / "empty"
    empty.mkdir()
    folder = folder_of(phantom, tmp_path, a="Adreno (TM) 750")

    def refused(*wishes: object) -> str:
        done = volprep("plan", scene, *wishes)
        assert done.returncode == ExitStatus.USAGE, done.stdout
        return done.stderr

    assert "VP7044" in refused("--devices", folder, "--canvas", "big")
    assert "VP7045" in refused("--devices", empty)
    assert "VP7036" in refused("--devices", tmp_path / "nowhere")
    assert "--device" in refused("--canvas", "10x10")
    assert "--devices" in refused("--error", "0.1")
    (folder / f"b{ENDING}").write_text(device_record_text()[:-20])
    assert "VP7036" in refused("--devices", folder)


def test_a_point_of_a_level_without_form_and_bytes_is_refused() -> None:
    found = json.loads(device_record_text())
    found["programs"][0]["levels"].pop()
    with pytest.raises(ValueError, match="level 1 was timed"):
        DeviceRecord.model_validate_json(json.dumps(found))
