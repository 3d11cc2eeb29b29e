"""Time series of DICOM: time points in order with their times, and what is no time, by its name."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dicom_files import image, save, save_all
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source, time_axis_of
from volprep_formats.source import SourceSpec

ENHANCED_MR = "1.2.840.10008.5.1.4.1.1.4.1"
PLACES = 5


def series(folder: Path, images: list[dict[str, Any]], places: int = PLACES) -> Path:
    """Write for each entry an image at every place; its pixels have the number of the entry, from 1.

    Values that can be called give the attribute at a place.
    """
    made = []
    for k, attributes in enumerate(images):
        for z in range(places):
            own = {name: value(z) if callable(value) else value for name, value in attributes.items()}
            made.append(image(np.full((4, 3), k + 1, np.uint16), (0.0, 0.0, 2.0 * z), **own))
    save_all(made[::-1], folder)
    return folder


def times(path: Path, **told: Any) -> tuple[float, ...] | None:
    return time_axis_of(SourceSpec(path=str(path), frames="all", **told), Path("/")).times_s


def values(path: Path, count: int, **told: Any) -> list[list[int]]:
    """The values in each time point: one, if the images of different time points are not mixed."""
    found = []
    for number in range(1, count + 1):
        with open_source(
            SourceSpec(path=str(path), frames="all", **told).at_frame(number), Path("/"), Silent()
        ) as source:
            found.append(np.unique(source.read_slab(0, source.info.grid.shape_zyx[0])).tolist())
    return found


def test_trigger_times_that_differ_from_slice_to_slice_are_phases_of_a_heart(tmp_path: Path) -> None:
    # Each slice is taken in a heart beat of its own: the delays differ a little, and no delay has a whole volume.
    phases = [{"TriggerTime": lambda z, k=k: f"{100 * k + 7 * z}"} for k in range(3)]
    assert times(series(tmp_path, phases)) == pytest.approx((0.014, 0.114, 0.214))
    assert values(tmp_path, 3) == [[1], [2], [3]]


def test_time_points_with_an_identifier_take_their_times_from_a_clock(tmp_path: Path) -> None:
    points = [
        {"TemporalPositionIdentifier": str(k + 1), "AcquisitionTime": lambda z, k=k: f"2359{50 + k}.{z}00000"}
        for k in range(3)
    ]
    assert times(series(tmp_path / "a", points)) == pytest.approx((0.0, 1.0, 2.0))
    untimed = series(tmp_path / "b", [{"TemporalPositionIdentifier": str(k)} for k in range(1, 12)])
    assert times(untimed) is None
    assert values(untimed, 11) == [[k] for k in range(1, 12)], "as numbers, not as text"


def test_times_of_the_day_go_on_after_midnight_and_begin_at_zero(tmp_path: Path) -> None:
    clock = ["235958", "235959.5", "000001"]
    assert times(series(tmp_path, [{"AcquisitionTime": each} for each in clock])) == pytest.approx((0.0, 1.5, 3.0))
    assert values(tmp_path, 3) == [[1], [2], [3]]


def test_frames_of_positron_emission_have_their_reference_times(tmp_path: Path) -> None:
    frames = [{"FrameReferenceTime": each, "Modality": "PT"} for each in ("30000", "90000", "300000")]
    assert times(series(tmp_path, frames)) == pytest.approx((30.0, 90.0, 300.0))


def test_phases_of_one_slice_after_the_other_are_in_order_and_have_no_times(tmp_path: Path) -> None:
    phases = [{"AcquisitionTime": lambda z, k=k: f"1200{10 * z + k:02d}"} for k in range(3)]
    assert times(series(tmp_path, phases)) is None
    assert values(tmp_path, 3) == [[1], [2], [3]]


def test_enhanced_images_say_their_time_points(tmp_path: Path) -> None:
    assert times(enhanced(tmp_path / "a.dcm", lambda k: {"FrameAcquisitionDateTime": f"20260101120{k}00.5+0100"})) == (
        pytest.approx((0.0, 60.0))
    )
    assert times(enhanced(tmp_path / "b.dcm", lambda k: {"TemporalPositionTimeOffset": 0.25 * k})) == (0.0, 0.25)


def enhanced(path: Path, content: Callable[[int], dict[str, Any]]) -> Path:
    """Write two time points of three slices as one file, with `content` of each time point."""
    data = image(np.zeros((4, 3), np.uint16))
    del data.ImagePositionPatient
    data.SOPClassUID, data.NumberOfFrames, data.PixelData = ENHANCED_MR, 6, bytes(6 * 4 * 3 * 2)
    data.PerFrameFunctionalGroupsSequence = Sequence()
    for k in range(6):
        position, frame = Dataset(), Dataset()
        position.ImagePositionPatient = ["0", "0", str(2 * (k % 3))]
        own = Dataset()
        for keyword, value in {"TemporalPositionIndex": k // 3 + 1, **content(k // 3)}.items():
            setattr(own, keyword, value)
        frame.PlanePositionSequence, frame.FrameContentSequence = Sequence([position]), Sequence([own])
        data.PerFrameFunctionalGroupsSequence.append(frame)
    return save(data, path)


@pytest.mark.parametrize(
    ("images", "what"),
    [
        ([{"EchoTime": "10"}, {"EchoTime": "20"}], "EchoTime"),
        ([{"DiffusionBValue": 0.0}, {"DiffusionBValue": 1000.0}], "DiffusionBValue"),
        ([{"InversionTime": "100"}, {"InversionTime": "200"}], "InversionTime"),
        ([{"AcquisitionNumber": k, "ImageType": ["ORIGINAL", "PRIMARY", "DIFFUSION"]} for k in (1, 2)], "diffusion"),
        ([{"EchoTime": e, "TriggerTime": t} for e in ("10", "20") for t in ("0", "50")], "EchoTime and TriggerTime"),
    ],
)
def test_volumes_that_are_no_time_points_are_refused_by_the_name_of_what_differs(
    images: list[dict[str, Any]], what: str, tmp_path: Path
) -> None:
    with pytest.raises(VolprepError, match=f"VP1340 .*{what}"):
        times(series(tmp_path, images))


def test_a_missing_image_is_named_with_its_time_point(tmp_path: Path) -> None:
    folder = series(tmp_path, [{"TemporalPositionIdentifier": str(k + 1)} for k in range(3)])
    # Written from the last to the first: the seventh file is an image of the second time point.
    sorted(folder.iterdir())[6].unlink()
    with pytest.raises(VolprepError, match=r"VP1343 .*each of 3 time points has 5 images, but number 2 has 4"):
        times(folder)


def test_volumes_that_nothing_tells_apart_are_time_points_on_request(tmp_path: Path) -> None:
    folder = series(tmp_path, [{"InstanceNumber": lambda z, k=k: k * PLACES + z + 1} for k in range(2)])
    with pytest.raises(VolprepError, match=r"VP1343 .*tells the 2 images of a place apart"):
        times(folder)
    assert times(folder, volumes_by="number") is None
    assert values(folder, 2, volumes_by="number") == [[1], [2]]


def test_one_volume_is_a_series_of_one_frame(tmp_path: Path) -> None:
    assert time_axis_of(SourceSpec(path=str(series(tmp_path, [{}])), frames="all"), Path("/")).count == 1
