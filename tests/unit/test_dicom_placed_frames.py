"""Frames without groups of their own, or in a volume: doses, reconstructions of nuclear medicine, ultrasound."""

from pathlib import Path

import numpy as np
import pytest
from dicom_files import ds, image, save
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from segment_files import item

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceInfo, SourceSpec

FRAMES = np.arange(3 * 4 * 5, dtype=np.uint16).reshape(3, 4, 5)
DOSE = "1.2.840.10008.5.1.4.1.1.481.2"
NM = "1.2.840.10008.5.1.4.1.1.20"
ULTRASOUND = "1.2.840.10008.5.1.4.1.1.6.2"


def read(path: Path, **told: object) -> tuple[np.ndarray, SourceInfo]:
    with open_source(SourceSpec(path=str(path), **told), Path("/"), Silent()) as source:
        return np.asarray(source.read_slab(0, source.info.grid.shape_zyx[0])), source.info


def refusal(path: Path) -> VolprepError:
    with pytest.raises(VolprepError) as caught:
        read(path)
    return caught.value


def multi(sop_class: str, frames: np.ndarray = FRAMES, **attributes: object) -> Dataset:
    data = image(frames[0], (1.0, 2.0, -30.0), **attributes)
    data.SOPClassUID = sop_class
    data.NumberOfFrames = len(frames)
    data.PixelData = frames.tobytes()
    return data


def dose(first: str = "0", **attributes: object) -> Dataset:
    attributes = {"Modality": "RTDOSE", "DoseUnits": "GY", "DoseGridScaling": "0.01"} | attributes
    data = multi(DOSE, **{key: value for key, value in attributes.items() if value is not None})
    data.GridFrameOffsetVector = [str(float(first) + 2.5 * k) for k in range(3)]
    return data


@pytest.mark.parametrize("first", ["0", "-30"])
def test_a_dose_has_frames_at_its_offsets_and_values_in_gray(tmp_path, first) -> None:
    voxels, info = read(save(dose(first), tmp_path / "dose.dcm"))
    np.testing.assert_array_equal(voxels, FRAMES)
    assert info.grid.spacing_mm_zyx == (2.5, 1.0, 1.0)
    assert info.grid.origin_mm_xyz == (1.0, 2.0, -30.0)
    assert (info.slope, info.intercept, info.unit) == (0.01, 0.0, "Gy")


@pytest.mark.parametrize("frames", [1, 3])
@pytest.mark.parametrize(
    ("change", "photometry"),
    [
        ({"DoseGridScaling": None}, (1.0, 0.0, "")),
        ({"RescaleSlope": "7", "RescaleIntercept": "100"}, (0.01, 0.0, "Gy")),
        ({"DoseUnits": "RELATIVE"}, (0.01, 0.0, "")),
    ],
)
def test_the_scaling_of_a_dose_alone_gives_its_values(tmp_path, frames, change, photometry) -> None:
    data = dose(**change)
    if frames == 1:
        data.NumberOfFrames, data.PixelData, data.SliceThickness = 1, FRAMES[0].tobytes(), "2.5"
        del data.GridFrameOffsetVector
    info = read(save(data, tmp_path / "dose.dcm"))[1]
    assert (info.slope, info.intercept, info.unit) == photometry
    assert any("not in gray" in remark for remark in info.remarks) == (info.unit == "")


def test_a_dose_with_a_scaling_of_zero_is_refused(tmp_path) -> None:
    error = refusal(save(dose(DoseGridScaling="0"), tmp_path / "dose.dcm"))
    assert error.code == "VP1037"
    assert "DoseGridScaling" in str(error)


def spect(step_mm: float | None = 4.4, frames: np.ndarray = FRAMES, **attributes: object) -> Dataset:
    kind = ["ORIGINAL", "PRIMARY", "RECON TOMO", "EMISSION"]
    data = multi(NM, frames, **{"Modality": "NM", "ImageType": kind, "SliceThickness": "9"} | attributes)
    if step_mm is not None:
        data.SpacingBetweenSlices = str(step_mm)
    place = item(ImagePositionPatient=ds([-100.5, -90.25, 50]), ImageOrientationPatient=ds([1, 0, 0, 0, 1, 0]))
    data.DetectorInformationSequence = Sequence([place])
    del data.ImagePositionPatient, data.ImageOrientationPatient
    return data


@pytest.mark.parametrize("vector", [[1, 2, 3], [3, 1, 2], None])
@pytest.mark.parametrize("step_mm", [4.4, -4.4])
def test_slices_of_nuclear_medicine_follow_each_other_by_a_signed_step(tmp_path, step_mm, vector) -> None:
    data = spect(step_mm)
    if vector is not None:
        data.SliceVector = vector
    voxels, info = read(save(data, tmp_path / "nm.dcm"))
    in_order = FRAMES[np.argsort(vector or [1, 2, 3])]
    assert np.array_equal(voxels, in_order if step_mm > 0 else in_order[::-1])
    assert info.grid.spacing_mm_zyx == pytest.approx((4.4, 1.0, 1.0))
    assert info.grid.origin_mm_xyz == pytest.approx((-100.5, -90.25, 50.0 + min(0.0, 2 * step_mm)))


def test_gates_of_one_slice_are_volumes_in_the_order_of_the_frames(tmp_path) -> None:
    gated = spect(frames=np.concatenate([FRAMES, FRAMES + 100]))
    gated.SliceVector = [1, 2, 3, 1, 2, 3]
    gated.ImageType = ["ORIGINAL", "PRIMARY", "RECON GATED TOMO", "EMISSION"]
    file = save(gated, tmp_path / "nm.dcm")
    assert refusal(file).code == "VP2006"
    assert np.array_equal(read(file, volume=2)[0], FRAMES + 100)


@pytest.mark.parametrize(
    ("change", "code", "says"),
    [
        ({"ImageType": ["ORIGINAL", "PRIMARY", "TOMO", "EMISSION"]}, "VP1041", "projections"),
        ({"step_mm": None}, "VP1036", "SpacingBetweenSlices"),
        ({"SliceVector": [1, 2]}, "VP1037", "SliceVector"),
    ],
)
def test_nuclear_medicine_without_places_is_refused_by_name(tmp_path, change, code, says) -> None:
    error = refusal(save(spect(**change), tmp_path / "nm.dcm"))
    assert error.code == code
    assert says in str(error)


def test_detectors_that_disagree_are_refused(tmp_path) -> None:
    data = spect()
    other = item(ImagePositionPatient=ds([0, 0, 0]), ImageOrientationPatient=ds([0, 1, 0, 0, 0, 1]))
    data.DetectorInformationSequence.append(other)
    assert "2 places" in str(refusal(save(data, tmp_path / "nm.dcm")))


def test_ultrasound_lies_in_a_volume_of_its_own(tmp_path) -> None:
    data = multi(ULTRASOUND, Modality="US")
    del data.ImagePositionPatient, data.ImageOrientationPatient, data.PixelSpacing
    orientation = item(ImageOrientationVolume=[0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    shared = item(
        PlaneOrientationVolumeSequence=[orientation], PixelMeasuresSequence=[item(PixelSpacing=ds([0.5, 0.25]))]
    )
    data.SharedFunctionalGroupsSequence = [shared]
    data.PerFrameFunctionalGroupsSequence = [
        item(PlanePositionVolumeSequence=[item(ImagePositionVolume=[1.5 * z, 10.0, 20.0])]) for z in (2, 0, 1)
    ]
    voxels, info = read(save(data, tmp_path / "us.dcm"))
    assert np.array_equal(voxels, FRAMES[[1, 2, 0]])
    assert info.grid.spacing_mm_zyx == pytest.approx((1.5, 0.5, 0.25))
    assert info.grid.origin_mm_xyz == (0.0, 10.0, 20.0)
    assert any("not known" in remark for remark in info.remarks)
