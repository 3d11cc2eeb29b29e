"""volprep render, as a person would use it."""

import json

import numpy as np
import OpenImageIO
import pytest
from command_line import volprep
from tiny_packages import ES2, function, lossless, tiny_package

from volprep_formats.package.channel import ChannelPart
from volprep_formats.package.manifest import Contribution, StageRecord
from volprep_formats.package.storage.draft import Draft

RED = function((0.0, (1.0, 0.0, 0.0), 5.0), name="red")


def sealed(folder, transfer_function):
    """Sealed package of a box of one value, 4 × 6 × 12 mm along the body."""
    tiny_package(folder, np.full((12, 6, 4), 9, np.uint8), transfer_function, ES2)
    stored = lossless()
    part = ChannelPart(name="scan", stored_type="uint8", quantization=stored)
    record = StageRecord(name="seal", key="0" * 64, made=(Contribution(channel=part),))
    Draft.open(folder).commit(record, seal=True)
    return folder


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Package whose box is opaque and red."""
    return sealed(tmp_path_factory.mktemp("red") / "red.volpkg", RED)


def picture(path):
    return OpenImageIO.ImageBuf(str(path)).get_pixels(OpenImageIO.UINT8)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("background", "corner"), [("black", [0, 0, 0]), ("white", [255, 255, 255]), ("transparent", [0, 0, 0, 0])]
)
def test_a_picture_has_the_size_and_background_that_were_asked_for(package, tmp_path, background, corner):
    done = volprep("render", package, "-o", tmp_path / "p.png", "--size", "61x31", "--background", background)
    assert done.returncode == 0, done.stderr
    drawn = picture(tmp_path / "p.png")
    assert drawn.shape == (31, 61, len(corner))
    assert drawn[0, 0].tolist() == corner
    assert drawn[15, 30, :3].tolist() == [255, 0, 0]
    assert "61×31, level 0, program ray-caster" in done.stdout


@pytest.mark.long
def test_a_picture_that_shows_nothing_says_so(package, tmp_path):
    clear = sealed(tmp_path / "clear.volpkg", function((0.0, (1.0, 0.0, 0.0), 0.0), name="clear"))
    same = ("-o", tmp_path / "p.png", "--size", "9", "--force")
    said = {path: volprep("render", path, *same).stdout for path in (package, clear)}
    assert "Nothing is seen" in said[clear]
    assert "Nothing is seen" not in said[package]
    whole = ("--view", "anterior", "--no-fill")
    drawn = volprep("render", package, "-o", tmp_path / "p.png", "--force", "--size", "14", "--json", *whole)
    assert json.loads(drawn.stdout)["seen"] == pytest.approx(4 * 12 / 14**2, abs=0.03)


def test_one_number_is_width_and_height_as_it_is_for_validate(package, tmp_path):
    assert volprep("render", package, "-o", tmp_path / "p.png", "--size", "20").returncode == 0
    assert picture(tmp_path / "p.png").shape[:2] == (20, 20)


@pytest.mark.long
def test_views_differ_and_an_eye_may_stand_anywhere(package, tmp_path):
    wishes = {"front": ("--view", "anterior"), "side": ("--view", "left"), "eye": ("--eye", "300,2.5,5.5")}
    widths = {}
    for name, wish in wishes.items():
        path = tmp_path / f"{name}.png"
        done = volprep("render", package, "-o", path, "--size", "64x64", "--no-fill", *wish)
        assert done.returncode == 0, done.stderr
        widths[name] = int((picture(path)[32, :, 0] > 0).sum())
    # 4 and 6 mm of 14 mm, in 64 pixels; the eye stands on the left.
    assert widths == {"front": 18, "side": 28, "eye": 28}


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (("--view", "above"), 2, "VP5022 there is no view above"),
        (("--eye", "1,2"), 2, "is not three numbers"),
        (("--eye", "1.5,2.5,5.5"), 7, "VP5020"),
        (("--size", "big"), 2, "is not a size"),
        (("--size", "0x10"), 7, "VP5009"),
        (("--level", "3"), 5, "cannot draw level 3 with any transfer function. It can draw level "),
        (("--small", "600"), 2, "600 is larger than the picture, 512x512"),
        (("--step", "0.001"), 7, "VP5019"),
        (("--background", "pink"), 2, "pink"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_an_impossible_wish_is_one_message_and_leaves_no_picture(package, tmp_path, arguments, status, message):
    done = volprep("render", package, "-o", tmp_path / "p.png", *arguments, COLUMNS="200")
    assert done.returncode == status
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "p.png").exists()


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("target", ["nowhere/p.png", "p.jpg", "p"])
def test_a_picture_that_cannot_be_written_is_one_message(package, tmp_path, target):
    done = volprep("render", package, "-o", tmp_path / target)
    assert done.returncode == 6
    assert "VP5021" in done.stderr
    assert not (tmp_path / target).exists()


@pytest.mark.long
def test_the_volume_may_have_fewer_pixels_than_the_lines_around_it(package, tmp_path):
    wishes = {"plain": (), "lines": ("--lines",), "small": ("--lines", "--small", "8x6")}
    pictures = {}
    for name, wish in wishes.items():
        path = tmp_path / f"{name}.png"
        done = volprep("render", package, "-o", path, "--size", "64x48", "--view", "anterior-left", *wish)
        assert done.returncode == 0, done.stderr
        pictures[name] = picture(path).astype(int)
    white = {name: int((each.min(axis=-1) > 250).sum()) for name, each in pictures.items()}
    assert white["plain"] == 0
    assert white["lines"] == white["small"] > 50
    colours = {name: len(np.unique(each.reshape(-1, 3), axis=0)) for name, each in pictures.items()}
    # An outline of 8×6 pixels, enlarged, is a slope.
    assert colours["small"] > colours["lines"] + 10


def test_an_estimate_of_opacity_is_for_devices_without_alpha(package, tmp_path):
    done = volprep("render", package, "-o", tmp_path / "p.png", "--opacity", "luminance-average")
    assert done.returncode == 2
    assert "VP5050" in done.stderr
    assert not (tmp_path / "p.png").exists()


def test_a_small_size_that_is_none_is_named(package, tmp_path):
    done = volprep("render", package, "-o", tmp_path / "p.png", "--small", "8y6")
    assert done.returncode == 2
    assert "--small" in done.stderr


def test_a_picture_is_written_frame_by_frame(package, tmp_path):
    size = ("--size", "40x32")
    done = volprep("study", "progressive", package, "-o", tmp_path / "frames", "--budget", "0", *size)
    assert done.returncode == 0, done.stderr
    assert volprep("render", package, "-o", tmp_path / "p.png", *size).returncode == 0
    assert "17 frames by structured" in done.stdout
    found = json.loads((tmp_path / "frames" / "frames.json").read_text())
    assert found["order"] == "structured"
    assert [each["finished"] for each in found["frames"]] == [number / 16 for number in range(17)]
    assert found["frames"][-1]["dssim"] == 0.0
    last = picture(tmp_path / "frames" / found["frames"][-1]["file"])
    np.testing.assert_array_equal(last, picture(tmp_path / "p.png"))


def test_an_order_that_the_package_does_not_have_is_refused(package, tmp_path):
    done = volprep("study", "progressive", package, "-o", tmp_path / "frames", "--order", "slabs", "--size", "16")
    assert "VP5041" in done.stderr
    assert not (tmp_path / "frames").exists()
