"""Frames of files: their times, and axes that the file says are no time."""

from pathlib import Path

import numpy as np
import pytest
import typer
from time_series import moving, save_series

from volprep.scan.frames import frames_of
from volprep_cli.choices import Choices
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source, time_axis_of
from volprep_formats.source import SourceSpec

FRAMES = moving(3)


def times(path: Path) -> tuple[float, ...] | None:
    return time_axis_of(SourceSpec(path=str(path), frames="all"), Path("/")).times_s


def read(path: Path, **settings: object) -> np.ndarray:
    with open_source(SourceSpec(path=str(path), **settings), Path("/"), Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0])


def nrrd(path: Path, kind: str, unit: str = "s", more: str = "") -> Path:
    nz, ny, nx = FRAMES[0].shape
    head = (
        f"NRRD0005\ntype: uint8\ndimension: 4\nsizes: {nx} {ny} {nz} 3\nkinds: domain domain domain {kind}\n"
        f'spacings: 1 1 1 2.5\nunits: "mm" "mm" "mm" "{unit}"\nencoding: raw\n{more}\n'
    )
    path.write_bytes(head.encode() + FRAMES.tobytes())
    return path


def metaimage(path: Path, channels: int = 1) -> Path:
    nz, ny, nx = FRAMES[0].shape
    sizes = f"NDims = 4\nDimSize = {nx} {ny} {nz} 3" if channels == 1 else f"NDims = 3\nDimSize = {nx} {ny} {nz}"
    head = f"{sizes}\nElementNumberOfChannels = {channels}\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
    path.write_bytes(head.encode() + FRAMES.tobytes())
    return path


@pytest.mark.parametrize(("unit", "seconds"), [("sec", 40.0), ("msec", 0.04), ("usec", 4e-5)])
def test_nifti_says_its_times(unit: str, seconds: float, tmp_path: Path) -> None:
    assert times(save_series(tmp_path / "a.nii", FRAMES, unit)) == pytest.approx((0.0, seconds, 2 * seconds))


def test_files_without_a_unit_of_time_have_frames_without_times(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", FRAMES)
    paths = (
        save_series(tmp_path / "a.nii", FRAMES, "unknown"),
        nrrd(tmp_path / "a.nrrd", "list", unit=""),
        metaimage(tmp_path / "a.mha"),
        tmp_path / "a.npy",
    )
    for path in paths:
        found = frames_of(SourceSpec(path=str(path), frames=2))
        assert [frame.time_s for _, frame in found] == [None, None]
        for (spec, _), frame in zip(found, FRAMES[::2], strict=True):
            np.testing.assert_array_equal(read(path, volume=spec.volume), frame)
        # Who opens the series gets its first frame.
        np.testing.assert_array_equal(read(path, frames="2:3"), FRAMES[1])


def test_nrrd_says_its_times(tmp_path: Path) -> None:
    assert times(nrrd(tmp_path / "a.nrrd", "time")) == pytest.approx((0.0, 2.5, 5.0))
    assert times(nrrd(tmp_path / "b.nrrd", "time", unit="ms")) == pytest.approx((0.0, 0.0025, 0.005))


def test_an_axis_that_is_no_time_is_refused_by_its_name(tmp_path: Path) -> None:
    weighted = save_series(tmp_path / "dwi.nii", FRAMES)
    (tmp_path / "dwi.bval").write_text("0 1000 1000\n")
    vectors = save_series(tmp_path / "v.nii", FRAMES)
    data = bytearray(vectors.read_bytes())
    data[68:70] = (1007).to_bytes(2, "little")
    vectors.write_bytes(data)
    refused = {
        weighted: "b-values",
        vectors: "intent code 1007 is a vector",
        save_series(tmp_path / "f.nii", FRAMES, "hz"): "unit is Hz",
        nrrd(tmp_path / "v.nrrd", "vector"): "kind vector",
        nrrd(tmp_path / "d.nrrd", "list", more="DWMRI_b-value:=1000\n"): "DWMRI",
        metaimage(tmp_path / "c.mha", channels=3): "3 components",
    }
    for path, what in refused.items():
        with pytest.raises(VolprepError, match=f"VP1340 .*{what}"):
            times(path)


def test_a_series_without_the_option_is_refused_with_its_name(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", FRAMES)
    paths = save_series(tmp_path / "a.nii", FRAMES), nrrd(tmp_path / "a.nrrd", "time"), metaimage(tmp_path / "a.mha")
    for path in (*paths, tmp_path / "a.npy"):
        with pytest.raises(VolprepError, match="--frames all"):
            read(path)


def test_formats_without_time_have_no_frames(tmp_path: Path) -> None:
    (tmp_path / "a.mrc").write_bytes(bytes(208) + b"MAP " + bytes(812))
    with pytest.raises(VolprepError, match=r"VP1004 .*frames"):
        times(tmp_path / "a.mrc")


@pytest.mark.parametrize("wanted", ["1:99999999", "99999999999", "0", "3:x", "", "9" * 5000])
def test_frames_that_a_scene_refuses_are_a_wrong_command_line(wanted: str) -> None:
    with pytest.raises(typer.BadParameter):
        Choices(frames=wanted)._frames()


@pytest.mark.parametrize(("wanted", "chosen"), [("all", "all"), ("3", 3), ("2:9:2", "2:9:2"), (None, None)])
def test_frames_of_the_command_line_are_those_of_a_scene(wanted: str | None, chosen: str | int | None) -> None:
    assert Choices(frames=wanted)._frames() == chosen
