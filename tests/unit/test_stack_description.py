"""What ImageJ and tifffile write of a TIFF file: distances between voxels, and arrays that are no single volume."""

from pathlib import Path

import numpy as np
import pytest
import tifffile
from header_files import read, refusal_at_open

from volprep_formats.isolation import workers
from volprep_formats.progress import Silent
from volprep_formats.readers import channels_of, open_source
from volprep_formats.readers.pictures.file import unsound
from volprep_formats.source import SourceSpec, StackLayout

VOXELS = np.random.default_rng(5).integers(0, 900, (4, 3, 5)).astype(np.uint16)


@pytest.fixture(scope="module", autouse=True)
def kept_workers():
    """Workers live as long as this module, not as long as one file is open."""
    with workers():
        yield


def of_imagej(file: Path, x: float, y: float, **words: object) -> Path:
    tifffile.imwrite(file, VOXELS, imagej=True, resolution=(x, y), metadata={"axes": "ZYX"} | words)
    return file


@pytest.mark.parametrize(
    ("x", "y", "words", "spacing_mm_zyx"),
    [
        (2.0, 4.0, {"unit": "um", "spacing": 2.0}, (2e-3, 0.25e-3, 0.5e-3)),
        (2.0, 2.0, {"unit": "mm", "spacing": -3.0}, (3.0, 0.5, 0.5)),
        (0.5, 0.5, {"unit": "micron"}, (1e-3, 2e-3, 2e-3)),
        (1.0, 1.0, {"unit": "\\u00B5m", "spacing": 5.0}, (5e-3, 1e-3, 1e-3)),
        (1.0, 0.5, {"unit": "um", "zunit": "nm", "spacing": 2500.0}, (2.5e-3, 2e-3, 1e-3)),
        (1.0, 0.5, {"unit": "um", "yunit": "nm", "zunit": "mm", "spacing": 3.0}, (3.0, 2e-6, 1e-3)),
    ],
)
def test_the_distances_of_imagej_are_taken_and_remarked(tmp_path, x, y, words, spacing_mm_zyx) -> None:
    values, info = read(of_imagej(tmp_path / "a.tif", x, y, **words))
    assert np.array_equal(values, VOXELS)
    assert info.grid.spacing_mm_zyx == pytest.approx(spacing_mm_zyx, rel=1e-6)
    assert info.remarks == ("the distances between voxels are those that ImageJ wrote",)


def test_distances_in_the_scene_replace_those_of_imagej(tmp_path) -> None:
    file = of_imagej(tmp_path / "a.tif", 2.0, 2.0, unit="um", spacing=2.0)
    told = SourceSpec(path=str(file), stack=StackLayout(spacing_mm_zyx=(3, 2, 1)))
    with open_source(told, Path(), Silent()) as source:
        assert source.info.grid.spacing_mm_zyx == (3, 2, 1)
        assert source.info.remarks == ()


@pytest.mark.parametrize("words", [{"unit": "pixel", "spacing": 2.0}, {"spacing": 2.0}, {"unit": "um", "spacing": "x"}])
def test_distances_that_imagej_does_not_say_as_lengths_are_assumed(tmp_path, words) -> None:
    _, info = read(of_imagej(tmp_path / "a.tif", 2.0, 2.0, **words))
    assert info.grid.spacing_mm_zyx == (1, 1, 1)
    assert any("1 mm is assumed" in remark for remark in info.remarks)


def test_a_resolution_in_another_unit_than_the_description_says_nothing(tmp_path) -> None:
    file = tmp_path / "a.tif"
    words = "ImageJ=1.54\nimages=4\nslices=4\nunit=um\nspacing=2.0\n"
    tifffile.imwrite(
        file,
        VOXELS,
        photometric="minisblack",
        description=words,
        metadata=None,
        resolution=(72, 72),
        resolutionunit="INCH",
    )
    assert read(file)[1].grid.spacing_mm_zyx == (1, 1, 1)


def test_an_array_of_four_axes_is_no_stack_of_slices(tmp_path) -> None:
    tifffile.imwrite(tmp_path / "a.tif", np.stack([VOXELS] * 2), photometric="minisblack")
    error = refusal_at_open(tmp_path / "a.tif")
    assert error.code == "VP1168"
    assert "2×4×3×5" in error.summary
    tifffile.imwrite(tmp_path / "b.tif", VOXELS[None], photometric="minisblack")
    assert np.array_equal(read(tmp_path / "b.tif")[0], VOXELS)
    colours = np.stack([VOXELS] * 3, -1)
    tifffile.imwrite(tmp_path / "c.tif", colours, photometric="rgb")
    assert np.array_equal(read(tmp_path / "c.tif")[0], VOXELS)


@pytest.mark.parametrize(
    "text", ['{"shape": "x"}', '{"shape": [2, "4", 3, 5]}', "{", "[" * 9000, '{"shape": [[2], 4]}']
)
def test_a_description_that_only_looks_like_an_array_is_no_reason_to_refuse(tmp_path, text) -> None:
    tifffile.imwrite(tmp_path / "a.tif", VOXELS, photometric="minisblack", description=text, metadata=None)
    assert np.array_equal(read(tmp_path / "a.tif")[0], VOXELS)


def test_a_compression_that_the_decoder_lacks_is_named(tmp_path) -> None:
    error = unsound(tmp_path / "a.tif", "TIFFReadEncodedStrip failed: ZSTD compression support is not configured")
    assert error.code == "VP1166"
    assert "ZSTD compression" in error.summary


def test_half_floats_are_not_called_spread(tmp_path) -> None:
    tifffile.imwrite(tmp_path / "a.tif", VOXELS.astype(np.float16), photometric="minisblack", metadata=None)
    values, info = read(tmp_path / "a.tif")
    assert np.array_equal(values, VOXELS)
    assert not any("spread" in remark for remark in info.remarks)


def test_one_channel_at_one_time_of_a_hyperstack_of_imagej_is_read(tmp_path) -> None:
    several = np.arange(3 * 4 * 2 * 3 * 5).reshape(3, 4, 2, 3, 5).astype(np.uint16)  # [t, z, c, y, x]
    file = tmp_path / "a.tif"
    tifffile.imwrite(file, several, imagej=True, resolution=(2, 2), metadata={"axes": "TZCYX", "unit": "um"})
    for time, channel in np.ndindex(3, 2):
        values, info = read(file, volume=time + 1, channel=channel + 1)
        assert np.array_equal(values, several[time, :, channel])
        assert info.grid.shape_zyx == (4, 3, 5)
    assert channels_of(file) == ["", ""]
    for told, code in (({}, "VP1221"), ({"channel": 1}, "VP1221"), ({"channel": 3, "volume": 1}, "VP1222")):
        assert refusal_at_open(file, **told).code == code


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_stack_of_imagej_whose_file_has_one_page_is_read(tmp_path, order) -> None:
    several = np.arange(4 * 2 * 3 * 5).reshape(4, 2, 3, 5).astype(np.uint16)
    words = "ImageJ=1.54\nimages=8\nchannels=2\nslices=4\nhyperstack=true\nunit=um\nspacing=3.0\n"
    told = {"description": words, "metadata": None, "photometric": "minisblack", "resolution": (2, 2)}
    file = tmp_path / "a.tif"
    tifffile.imwrite(file, several[0, 0], byteorder=order, resolutionunit="NONE", **told)
    at = file.read_bytes().index(several[0, 0].astype(order + "u2").tobytes())
    file.write_bytes(file.read_bytes()[:at] + several.astype(order + "u2").tobytes())
    for channel in (0, 1):
        values, info = read(file, channel=channel + 1)
        assert np.array_equal(values, several[:, channel])
    assert info.grid.spacing_mm_zyx == pytest.approx((3e-3, 0.5e-3, 0.5e-3))
    file.write_bytes(file.read_bytes()[:-2])
    assert refusal_at_open(file, channel=1).code == "VP1008"
    tifffile.imwrite(file, several[0, 0], compression="zlib", resolutionunit="NONE", **told)
    assert refusal_at_open(file, channel=1).code == "VP1166"
