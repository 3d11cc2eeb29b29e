"""Finding the series that is meant among everything else that lies in a folder tree."""

import gzip
import shutil
from pathlib import Path

import numpy as np
import pytest
from dicom_files import image, save, save_all, stack
from pydicom.uid import DeflatedExplicitVRLittleEndian, ExplicitVRLittleEndian

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.dicom.scan import scan
from volprep_formats.source import SourceInfo, SourceSpec


def read_info(folder: Path, series: str | None = None) -> SourceInfo:
    with open_source(SourceSpec(path=".", series=series), folder, Silent()) as source:
        return source.info


def other_series(uid: str, count: int, **attributes) -> list:
    images = stack(count)
    for data in images:
        data.SeriesInstanceUID = uid
        for keyword, value in attributes.items():
            setattr(data, keyword, value)
    return images


def test_slices_are_found_below_folders_and_beside_junk(tmp_path) -> None:
    for k, data in enumerate(stack(4)):
        save(data, tmp_path / f"deep/{k % 2}/{k}")
    (tmp_path / "notes.txt").write_text("no image")
    (tmp_path / "empty").touch()
    (tmp_path / "._0.dcm").write_bytes(b"left by another system")
    (tmp_path / "like_a_bare_one").write_bytes(b"\x08\0\x05\0" + bytes(range(256)))
    info = read_info(tmp_path)
    assert info.grid.shape_zyx == (4, 3, 4)
    assert "other files in the folder were left out: 4" in info.remarks


def test_a_data_set_without_prefix_is_read(tmp_path) -> None:
    for k, data in enumerate(stack(3)):
        file = save(data, tmp_path / f"I{k}")
        file.write_bytes(file.read_bytes()[132:])
    assert read_info(tmp_path).grid.shape_zyx == (3, 3, 4)


def test_a_report_without_an_image_is_left_out(tmp_path) -> None:
    save_all(stack(4), tmp_path)
    report = image(np.zeros((1, 1), np.int16), Rows=None, Columns=None, PixelData=None)
    report.SOPClassUID = "1.2.840.10008.5.1.4.1.1.88.11"
    save(report, tmp_path / "report")
    assert read_info(tmp_path).grid.shape_zyx == (4, 3, 4)


@pytest.mark.parametrize("names", ["{}.dcm", "IM{}", "1.2.{}"])
def test_a_link_to_a_missing_file_among_slices_is_refused_by_name(tmp_path, names) -> None:
    for k, data in enumerate(stack(4)):
        save(data, tmp_path / names.format(k))
    (tmp_path / "notes.txt").symlink_to(tmp_path / "gone")
    (tmp_path / ".lock.dcm").symlink_to(tmp_path / "gone")
    assert read_info(tmp_path).grid.shape_zyx == (4, 3, 4)
    (tmp_path / names.format(4)).symlink_to(tmp_path / "gone")
    with pytest.raises(VolprepError) as caught:
        read_info(tmp_path)
    assert caught.value.code == "VP1003"
    assert names.format(4) in caught.value.summary


def test_the_only_series_is_taken_however_short_it_is(tmp_path) -> None:
    save_all(stack(2), tmp_path)
    assert read_info(tmp_path).grid.shape_zyx[0] == 2


def test_the_one_volume_is_taken_from_among_localisers_and_pictures(tmp_path) -> None:
    save_all(stack(5), tmp_path / "volume")
    save_all(other_series("1.2.1", 9, ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"]), tmp_path / "localiser")
    save_all(other_series("1.2.2", 3), tmp_path / "key_images")
    colour = other_series("1.2.3", 6, SamplesPerPixel=3, PhotometricInterpretation="RGB")
    save_all(colour, tmp_path / "colour")
    info = read_info(tmp_path)
    assert info.grid.shape_zyx[0] == 5
    assert "other series in the folder were left out: 3, with 18 images" in info.remarks


def test_two_volumes_are_refused_and_listed(tmp_path) -> None:
    save_all(stack(5), tmp_path / "a")
    save_all(other_series("1.2.77", 6, Modality="CT"), tmp_path / "b")
    with pytest.raises(VolprepError) as error:
        read_info(tmp_path)
    assert error.value.code == "VP1033"
    assert "1.2.77 (CT, 6 images of 4×3)" in str(error.value)
    assert "5 images of 4×3" in str(error.value)


def test_two_series_mixed_in_one_folder_can_be_told_apart(tmp_path) -> None:
    mixed = [data for pair in zip(stack(5), other_series("1.2.77", 5), strict=True) for data in pair]
    save_all(mixed, tmp_path)
    assert read_info(tmp_path, "2.77").grid.shape_zyx[0] == 5


def test_a_whole_uid_wins_over_a_longer_one_with_the_same_end(tmp_path) -> None:
    save_all(other_series("7.1", 4), tmp_path / "a")
    save_all(other_series("1.7.1", 5), tmp_path / "b")
    assert read_info(tmp_path, "7.1").grid.shape_zyx[0] == 4


@pytest.mark.parametrize(("wanted", "fits"), [("9999", "no series"), ("7", "2 series")])
def test_an_ending_that_fits_none_or_several_is_refused(tmp_path, wanted, fits) -> None:
    save_all(other_series("1.2.7", 4), tmp_path / "a")
    save_all(other_series("1.3.7", 4), tmp_path / "b")
    with pytest.raises(VolprepError) as error:
        read_info(tmp_path, wanted)
    assert error.value.code == "VP1034"
    assert fits in str(error.value)
    assert "1.3.7" in str(error.value)


def test_damage_in_another_series_does_not_matter(tmp_path) -> None:
    save_all(stack(5), tmp_path / "a")
    save_all(other_series("1.2.2", 6), tmp_path / "b")
    file = tmp_path / "b" / "I003"
    file.write_bytes(file.read_bytes()[:-4])
    assert read_info(tmp_path, "43.9.1").grid.shape_zyx[0] == 5


def test_a_scan_counts_its_progress_in_files(tmp_path) -> None:
    class Counting:
        total = done = 0

        def start(self, task: str, total: int) -> None:
            self.total = total

        def advance(self, units: int = 1) -> None:
            self.done += units

    save_all(stack(3), tmp_path)
    (tmp_path / "junk").touch()
    progress = Counting()
    scan(tmp_path, progress)
    assert progress.total == progress.done == 4


def test_one_file_is_a_volume_of_one_slice(tmp_path) -> None:
    save(image(np.ones((2, 3), np.int16), SliceThickness="3.5"), tmp_path / "one")
    save(image(np.ones((2, 3), np.int16), (0, 0, 1)), tmp_path / "two")
    with open_source(SourceSpec(path="one"), tmp_path, Silent()) as source:
        assert source.info.grid.shape_zyx == (1, 2, 3)
        assert source.info.grid.spacing_mm_zyx[0] == 3.5
        assert any("SliceThickness" in remark for remark in source.info.remarks)


def test_slices_of_several_frames_of_reference_are_refused_with_one_of_each(tmp_path) -> None:
    images = stack(6)
    for k, data in enumerate(images):
        data.FrameOfReferenceUID = f"1.2.3.{k // 3}"
    save_all(images, tmp_path / "s")
    with pytest.raises(VolprepError) as error:
        read_info(tmp_path)
    assert error.value.code == "VP1051"
    assert "2 frames of reference (FrameOfReferenceUID), as I000 and I003 do" in str(error.value)


def test_slices_of_one_frame_of_reference_or_of_none_are_one_volume(tmp_path) -> None:
    images = stack(6)
    for data in images[:4]:
        data.FrameOfReferenceUID = "1.2.3.0"
    assert read_info(save_all(images, tmp_path / "s")).grid.shape_zyx[0] == 6


@pytest.mark.parametrize("uid", ["1.2.x", "1.2 3", "1.2\\1.3", "1." * 33])
def test_a_series_whose_uid_is_none_is_refused(tmp_path, uid) -> None:
    images = other_series("1.2.3", 4)
    for k, data in enumerate(images):
        file = save(data, tmp_path / f"{k}")
        tag = b"\x20\0\x0e\0UI"
        value = uid.encode() + b"\0" * (len(uid) % 2)
        whole = file.read_bytes()
        at = whole.index(tag) + len(tag)
        file.write_bytes(whole[:at] + len(value).to_bytes(2, "little") + value + whole[at + 2 + whole[at] :])
    with pytest.raises(VolprepError, match="VP1052"):
        read_info(tmp_path)


@pytest.mark.parametrize("syntax", [ExplicitVRLittleEndian, DeflatedExplicitVRLittleEndian])
def test_copies_of_images_are_left_out_and_said(tmp_path, syntax) -> None:
    save_all(stack(5), tmp_path / "one", syntax)
    shutil.copytree(tmp_path / "one", tmp_path / "two")
    shutil.copy(tmp_path / "one/I003", tmp_path / "I003 (1)")
    info = read_info(tmp_path)
    assert info.grid.shape_zyx == (5, 3, 4)
    assert info.remarks == ("images that are copies of others of the series were left out: 6",)


def test_images_that_share_a_uid_and_differ_are_no_copies(tmp_path) -> None:
    images = stack(4)
    for data in images:
        data.SOPInstanceUID = "1.2.3"
    save_all(images, tmp_path)
    assert read_info(tmp_path).grid.shape_zyx == (4, 3, 4)


@pytest.mark.parametrize("again", [(2,), (0, 1, 2, 3, 4)])
def test_copies_with_a_uid_and_a_number_of_their_own_are_left_out_and_said(tmp_path, again) -> None:
    save_all(stack(5), tmp_path)
    for z in again:
        copy = stack(5)[z]
        copy.SOPInstanceUID, copy.InstanceNumber, copy.ContentTime = f"1.2.4.{z}", 100 + z, f"10150{z}"
        save(copy, tmp_path / f"again{z}")
    info = read_info(tmp_path)
    assert info.grid.shape_zyx == (5, 3, 4)
    assert info.remarks == (f"images that are copies of others of the series were left out: {len(again)}",)


def test_another_image_at_the_place_of_a_slice_is_refused_though_copies_are_left_out(tmp_path) -> None:
    images = [*stack(5), stack(5)[1], stack(5)[3]]
    images[6].PixelData = images[0].PixelData
    save_all(images, tmp_path)
    with pytest.raises(VolprepError, match=r"VP2005 .* I003 and I006, both at") as caught:
        read_info(tmp_path)
    assert caught.value.fields["several"] == 1


@pytest.mark.parametrize(("blank", "read"), [((1,), 2), ((0, 1, 2, 3), 1)])
def test_slices_that_two_volumes_share_are_no_copies_unless_all_are(tmp_path, blank, read) -> None:
    volumes = [stack(4), stack(4)]
    for k, data in enumerate([*volumes[0], *volumes[1]]):
        value = 0 if k % 4 in blank else 1 + k // 4
        data.PixelData, data.InstanceNumber = np.full(12, value, np.int16).tobytes(), k
        save(data, tmp_path / f"I{k}")
    if read == 1:
        assert read_info(tmp_path).grid.shape_zyx == (4, 3, 4)
        return
    with pytest.raises(VolprepError, match=r"VP2006 .* 2 images at each of 4 places"):
        read_info(tmp_path)


@pytest.mark.parametrize("attribute", ["EchoTime", "AcquisitionTime"])
def test_images_that_echoes_or_time_points_share_are_no_copies(tmp_path, attribute) -> None:
    for k, data in enumerate([*stack(4), *stack(4)]):
        setattr(data, attribute, str(101500 + k // 4))
        save(data, tmp_path / f"I{k}")
    with pytest.raises(VolprepError, match="VP2006"):
        read_info(tmp_path)


def directory(path: Path, *, damaged: bool) -> None:
    """Write the directory of a medium without records; a damaged one ends in an element without an end."""
    data = image(np.zeros((2, 2), np.uint8))
    for keyword in ("Rows", "Columns", "PixelData"):
        del data[keyword]
    data.SOPClassUID = "1.2.840.10008.1.3.10"
    save(data, path)
    if damaged:
        path.write_bytes(path.read_bytes() + b"\x08\0\x05\0CS\xff\xff")


@pytest.mark.parametrize("damaged", [False, True])
def test_the_directory_of_a_medium_is_no_slice_however_damaged(tmp_path, damaged) -> None:
    save_all(stack(4), tmp_path / "scan")
    directory(tmp_path / "scan/DICOMDIR", damaged=damaged)
    assert read_info(tmp_path / "scan").remarks == ("other files in the folder were left out: 1",)
    (tmp_path / "alone").mkdir()
    shutil.copy(tmp_path / "scan/DICOMDIR", tmp_path / "alone")
    with pytest.raises(VolprepError, match=r"VP1309 .* a DICOMDIR or a report\. Name the folder that holds the images"):
        read_info(tmp_path / "alone")


def test_a_folder_of_packed_images_is_named(tmp_path) -> None:
    for k, data in enumerate(stack(4)):
        file = save(data, tmp_path / f"I{k}.dcm")
        (tmp_path / f"I{k}.dcm.gz").write_bytes(gzip.compress(file.read_bytes()))
        file.unlink()
    with pytest.raises(VolprepError, match=r"VP1309 .* 4 files is a DICOM file packed by gzip\. Unpack it with gunzip"):
        read_info(tmp_path)
