"""Volumes of one DICOM series: told apart, counted, and said to be missing."""

from pathlib import Path

import numpy as np
import pytest
from dicom_files import image, save_all

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceInfo, SourceSpec

PLACES = 5


def series(folder: Path, **attributes: list[object]) -> Path:
    """Write images at five places, several at each: the k-th has the k-th value of each attribute, pixels of k + 1."""
    count = len(next(iter(attributes.values())))
    images = []
    for k in range(count):
        for z in range(PLACES):
            own = {name: values[k] for name, values in attributes.items()}
            number = {"InstanceNumber": k * PLACES + z + 1} | own
            images.append(image(np.full((4, 3), k + 1, np.uint16), (0.0, 0.0, 2.0 * z), **number))
    save_all(images, folder)
    return folder


def read(path: Path, **told: object) -> tuple[np.ndarray, SourceInfo]:
    with open_source(SourceSpec(path=str(path), **told), Path("/"), Silent()) as source:
        voxels = source.read_slab(0, source.info.grid.shape_zyx[0])
        return np.asarray(voxels), source.info


def refusal(path: Path, **told: object) -> VolprepError:
    with pytest.raises(VolprepError) as caught:
        read(path, **told)
    return caught.value


def test_magnitude_and_phase_of_each_echo_are_volumes_of_their_own(tmp_path: Path) -> None:
    parts = [["ORIGINAL", "PRIMARY", each] for each in ("M_FFE", "PHASE MAP")]
    folder = series(tmp_path, EchoTime=["10", "10", "20", "20"], ImageType=[*parts, *parts])
    values = [read(folder, volume=volume)[0] for volume in (1, 2, 3, 4)]
    assert [int(each.max()) for each in values] == [1, 2, 3, 4]
    assert all(np.ptp(each) == 0 for each in values)
    assert "EchoTime and ImageType" in " ".join(read(folder, volume=2)[1].remarks)


def test_volumes_that_nothing_tells_apart_follow_each_other_by_number_on_request(tmp_path: Path) -> None:
    folder = series(tmp_path, SliceThickness=["2", "2", "2"])
    error = refusal(folder)
    assert error.code == "VP2006"
    assert "--volumes-by number" in error.remedy
    assert refusal(folder, volume=2).code == "VP2006", "not without a request"
    voxels, info = read(folder, volume=2, volumes_by="number")
    assert np.unique(voxels).tolist() == [2]
    assert "nothing but InstanceNumber" in " ".join(info.remarks)


def test_a_volume_is_only_offered_where_it_can_be_chosen(tmp_path: Path) -> None:
    told_apart = refusal(series(tmp_path / "a", EchoTime=["10", "20"]))
    assert "--volume, or source.volume" in told_apart.remedy
    assert "--volumes-by" not in told_apart.remedy
    copies = refusal(series(tmp_path / "b", InstanceNumber=["", ""]))
    assert "--volume" not in copies.remedy


def test_images_that_the_header_counts_and_that_are_not_here_are_remarked(tmp_path: Path) -> None:
    few, many = (series(tmp_path / name, ImagesInAcquisition=[count]) for name, count in (("few", "9"), ("all", "5")))
    assert any("9 images" in remark and "5 are here" in remark for remark in read(few)[1].remarks)
    assert not any("ImagesInAcquisition" in remark for remark in read(many)[1].remarks)


def test_a_concatenation_without_its_second_part_is_remarked(tmp_path: Path) -> None:
    folder = series(tmp_path, InConcatenationNumber=[1], InConcatenationTotalNumber=[2])
    assert any("part 1 of 2 of a concatenation" in remark for remark in read(folder)[1].remarks)


@pytest.mark.parametrize(("signed", "beyond"), [(False, 5000), (True, 5000), (True, -5)])
def test_values_above_the_stored_bits_are_remarked_when_they_have_been_read(
    tmp_path: Path, signed: bool, beyond: int
) -> None:
    for name, value in (("sound", 100), ("beyond", beyond)):
        pixels = np.full((4, 3), 7, np.int16 if signed else np.uint16)
        pixels[1, 2] = value
        images = [image(pixels if z == 3 else pixels * 0, (0, 0, 2.0 * z), BitsStored=12, HighBit=11) for z in range(5)]
        save_all(images, tmp_path / name)
    assert not read(tmp_path / "sound")[1].remarks
    with open_source(SourceSpec(path=str(tmp_path / "beyond")), Path("/"), Silent()) as source:
        source.read_slab(0, 5)
        remarked = any("above BitsStored" in remark for remark in source.info.remarks)
    assert remarked == (beyond != -5), "a sign that is carried on is no value above"
