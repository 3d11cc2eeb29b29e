"""Standardised uptake values of PET in DICOM: by body weight, with the decay that the header asks for."""

from dataclasses import replace
from pathlib import Path

import pytest
from dicom_files import read_slices
from pet_ct import write_ct, write_pet
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence

from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.dicom.uptake import uptake_of
from volprep_formats.source import SourceInfo, SourceSpec

HALF_LIFE_S = 6586.2
ABOUT = {
    "CorrectedImage": ["DECY", "ATTN", "SCAT"],
    "DecayCorrection": "START",
    "PatientWeight": "70",
    "SeriesDate": "20240301",
    "SeriesTime": "100000",
    "AcquisitionDate": "20240301",
    "AcquisitionTime": "100100",
}


def injection(**changes: str | None) -> Sequence:
    item = Dataset()
    item.RadionuclideTotalDose = "350000000"
    item.RadionuclideHalfLife = str(HALF_LIFE_S)
    item.RadiopharmaceuticalStartTime = "090000.50"
    for keyword, value in changes.items():
        setattr(item, keyword, value)
    return Sequence([item])


def read(folder: Path, *, suv: bool = True, **changes: object) -> SourceInfo:
    about = {**ABOUT, "RadiopharmaceuticalInformationSequence": injection()} | changes
    write_pet(folder / "pet", **{key: value for key, value in about.items() if value is not None})
    with open_source(SourceSpec(path=str(folder / "pet"), suv=suv), Path("/"), Silent()) as source:
        return source.info


def factor(elapsed_s: float) -> float:
    return 70.0 * 1000.0 / (350e6 * 2.0 ** (-elapsed_s / HALF_LIFE_S))


def test_the_dose_decays_until_the_start_of_the_series(tmp_path) -> None:
    info = read(tmp_path)
    assert info.unit == "g/ml"
    assert info.slope == pytest.approx(factor(3600.0))
    assert "the values are SUV by body weight, in g/ml" in info.remarks


def test_a_series_that_was_processed_later_counts_from_its_first_acquisition(tmp_path) -> None:
    assert read(tmp_path, SeriesTime="173000").slope == pytest.approx(factor(3660.0))


def test_images_that_are_corrected_to_the_injection_take_the_dose_as_it_was(tmp_path) -> None:
    assert read(tmp_path, DecayCorrection="ADMIN").slope == pytest.approx(factor(0.0))


def test_an_injection_before_midnight_has_a_date(tmp_path) -> None:
    told = injection(RadiopharmaceuticalStartDateTime="20240229230000.000000")
    info = read(tmp_path, SeriesTime="010000", AcquisitionTime="010000", RadiopharmaceuticalInformationSequence=told)
    assert info.slope == pytest.approx(factor(7200.0))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"PatientWeight": None}, "PatientWeight is missing or not above 0"),
        ({"PatientWeight": "0"}, "PatientWeight is missing or not above 0"),
        ({"CorrectedImage": ["DECY"]}, "CorrectedImage does not say ATTN"),
        ({"DecayCorrection": "NONE"}, "neither START nor ADMIN"),
        ({"RadiopharmaceuticalInformationSequence": None}, "RadiopharmaceuticalInformationSequence is missing"),
        ({"SeriesTime": "080000", "AcquisitionTime": "080000"}, "not within two days before the series"),
        ({"SeriesTime": None}, "SeriesDate and SeriesTime is missing or no time"),
    ],
)
def test_what_the_header_lacks_is_named_and_the_values_stay(tmp_path, changes, says) -> None:
    info = read(tmp_path, **changes)
    assert (info.slope, info.unit) == (1.0, "Bq/ml")
    assert any(remark.startswith("the values are not SUV: ") and says in remark for remark in info.remarks)


def test_values_stay_unless_the_scene_asks(tmp_path) -> None:
    info = read(tmp_path, suv=False)
    assert (info.slope, info.unit) == (1.0, "Bq/ml")
    assert not any("SUV" in remark for remark in info.remarks)


def test_nobody_expects_uptake_of_a_dose(tmp_path) -> None:
    first = read_slices(min(write_ct(tmp_path / "ct", (3, 8, 8)).iterdir()))[0]
    assert uptake_of([replace(first, modality="RTDOSE", unit="Gy")]).remark == ""


def test_another_series_has_no_uptake(tmp_path) -> None:
    write_ct(tmp_path / "ct", (3, 8, 8))
    with open_source(SourceSpec(path=str(tmp_path / "ct"), suv=True), Path("/"), Silent()) as source:
        assert source.info.unit == "HU"
        assert "the values are not SUV: it is no PET series in Bq/ml" in source.info.remarks
