"""Frames of files: their times, and axes that the file says are no time."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tifffile
import typer
import zarr
from minc_files import minc1, minc2
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


def test_a_folder_of_volumes_is_a_series_in_the_order_of_its_numbers(tmp_path: Path) -> None:
    for number in (2, 9, 10):
        np.save(tmp_path / f"smoke_{number}.npy", np.full((3, 4, 5), number, np.uint8))
    (tmp_path / "smoke.json").write_text("{}")
    folder = SourceSpec(path=str(tmp_path), frames="all")
    with pytest.raises(VolprepError, match=r"VP1343 .*after smoke_2\.npy comes smoke_9\.npy"):
        frames_of(folder)
    (tmp_path / "smoke_2.npy").rename(tmp_path / "smoke_8.npy")
    found = frames_of(folder)
    assert [frame.time_s for _, frame in found] == [None, None, None]
    assert [int(read(tmp_path, volume=spec.volume).max()) for spec, _ in found] == [2, 9, 10]
    assert int(read(tmp_path, frames="2:3").max()) == 9
    with pytest.raises(VolprepError, match=r"VP2017 .*no volume 4; the series holds 3"):
        read(tmp_path, volume=4)
    np.save(tmp_path / "other_8.npy", np.zeros((3, 4, 5), np.uint8))
    with pytest.raises(VolprepError, match=r"VP1340 .*differ in more than one number"):
        frames_of(folder)


def ome_tiff(path: Path, pixels: str = "", inside: str = "") -> Path:
    nt, nz, ny, nx = FRAMES.shape
    xml = (
        '<?xml version="1.0"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image ID="Image:0">'
        f'<Pixels ID="Pixels:0" DimensionOrder="XYZCT" Type="uint8" SizeX="{nx}" SizeY="{ny}" SizeZ="{nz}" SizeC="1" '
        f'SizeT="{nt}" PhysicalSizeX="1" PhysicalSizeY="1" PhysicalSizeZ="1" {pixels}><Channel ID="Channel:0:0"/>'
        f"<TiffData/>{inside}</Pixels></Image></OME>"
    )
    tifffile.imwrite(path, FRAMES.reshape(-1, ny, nx), description=xml, metadata=None, photometric="minisblack")
    return path


def imagej(path: Path, more: str) -> Path:
    nt, nz, ny, nx = FRAMES.shape
    text = f"ImageJ=1.53t\nimages={nt * nz}\nslices={nz}\nframes={nt}\nhyperstack=true\n{more}"
    tifffile.imwrite(path, FRAMES.reshape(-1, ny, nx), description=text, metadata=None, photometric="minisblack")
    return path


def ome_zarr(path: Path, unit: str | None) -> Path:
    axis = {"name": "t", "type": "time"} | ({} if unit is None else {"unit": unit})
    axes = [axis, *({"name": name, "type": "space", "unit": "millimeter"} for name in "zyx")]
    transformations = [{"type": "scale", "scale": [0.5, 1, 1, 1]}]
    group = zarr.open_group(path, mode="w", zarr_format=2)
    group.create_array("0", data=FRAMES)
    dataset = {"path": "0", "coordinateTransformations": transformations}
    group.attrs["multiscales"] = [{"version": "0.4", "axes": axes, "datasets": [dataset]}]
    return path


def test_microscopes_say_their_times(tmp_path: Path) -> None:
    planes = "".join(f'<Plane TheZ="0" TheC="0" TheT="{t}" DeltaT="{t * t}" DeltaTUnit="min"/>' for t in range(3))
    told = {
        ome_tiff(tmp_path / "a.ome.tif", 'TimeIncrement="20" TimeIncrementUnit="ms"'): (0.0, 0.02, 0.04),
        ome_tiff(tmp_path / "b.ome.tif", 'TimeIncrement="20"', planes): (0.0, 60.0, 240.0),
        ome_tiff(tmp_path / "c.ome.tif"): None,
        imagej(tmp_path / "a.tif", "finterval=1.5\ntunit=sec\n"): (0.0, 1.5, 3.0),
        imagej(tmp_path / "b.tif", "finterval=1.5\ntunit=frog\n"): None,
        ome_zarr(tmp_path / "a.zarr", "minute"): (0.0, 30.0, 60.0),
        ome_zarr(tmp_path / "b.zarr", None): None,
    }
    for path, expected in told.items():
        found = frames_of(SourceSpec(path=str(path), frames="all"))
        seconds = [frame.time_s for _, frame in found]
        assert seconds == ([None] * 3 if expected is None else pytest.approx(expected)), path.name
        for (spec, _), frame in zip(found, FRAMES, strict=True):
            np.testing.assert_array_equal(read(path, volume=spec.volume), frame)


@pytest.mark.parametrize("write", [minc1, minc2])
def test_minc_says_its_times(write: Callable[..., Path], tmp_path: Path) -> None:
    voxels, names = FRAMES.astype(np.int16), ("time", "zspace", "yspace", "xspace")
    path = write(tmp_path / "a.mnc", voxels, names=names, time__step=2.0, time__start=1.0, time__units=b"s")
    assert times(path) == pytest.approx((1.0, 3.0, 5.0))
