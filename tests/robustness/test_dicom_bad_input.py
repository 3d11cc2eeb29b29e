"""Bad DICOM input: each kind gives one coded message that names the file, the numbers and what to do."""

import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest
from dicom_files import compressed, image, save, save_all, stack
from header_files import refusal_at_open
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    JPEG2000Lossless,
    JPEGLSLossless,
    RLELossless,
)
from write_anew import write_anew

from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.dicom.clocks import _of_day
from volprep_formats.readers.dicom.fields import TAGS
from volprep_formats.source import SourceSpec

pytestmark = pytest.mark.usefixtures("kept_workers")

NATIVE = (ExplicitVRLittleEndian, ImplicitVRLittleEndian, ExplicitVRBigEndian, DeflatedExplicitVRLittleEndian)
COMPRESSED = (RLELossless, JPEGLSLossless, JPEG2000Lossless)


def read(path: Path) -> np.ndarray:
    with open_source(SourceSpec(path=str(path)), Path(), Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0])


def refusal(path: Path) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        read(path)
    return error.value


def save_stack(folder: Path, third=None, syntax=ExplicitVRLittleEndian, **third_attributes) -> Path:
    """Five slices, the third of which is `third`, or has `third_attributes`. Gives the third file."""
    images = stack(5)
    images[2] = third or images[2]
    for keyword, value in third_attributes.items():
        if value is None:
            del images[2][keyword]
        else:
            setattr(images[2], keyword, value)
    save_all(images, folder, syntax)
    return folder / "I002"


def test_an_empty_folder_is_refused(tmp_path) -> None:
    error = refusal(tmp_path)
    assert (error.code, error.status) == ("VP1030", ExitStatus.SOURCE)


def test_a_folder_without_images_is_refused_with_the_number_of_its_files(tmp_path) -> None:
    (tmp_path / "a.txt").write_text("text")
    (tmp_path / "b.bin").write_bytes(bytes(300))
    error = refusal(tmp_path)
    assert error.code == "VP1030"
    assert "other files: 2" in str(error)


@pytest.mark.parametrize("head", [b"GIF89a", b"RIFF\0\0\0\0WEBPVP8 "])
def test_a_folder_of_pictures_that_no_reader_reads_is_refused_as_what_it_is(tmp_path, head) -> None:
    for name in ("a", "b"):
        (tmp_path / name).write_bytes(head + bytes(300))
    error = refusal(tmp_path)
    assert (error.code, error.status) == ("VP1309", ExitStatus.SOURCE)
    assert "each of the 2 files is a GIF or WebP picture" in str(error)
    assert "Save the slices as PNG or TIFF." in str(error)
    (tmp_path / "c").write_text("text")
    assert refusal(tmp_path).code == "VP1030"


@pytest.mark.parametrize("missing_bytes", [1, 10, 24])
def test_a_file_whose_pixel_data_is_cut_off_is_refused_by_name(tmp_path, missing_bytes) -> None:
    file = save_stack(tmp_path)
    file.write_bytes(file.read_bytes()[:-missing_bytes])
    error = refusal_at_open(tmp_path)
    assert error.code == "VP1031"
    assert str(file) in str(error)
    assert f"only {24 - missing_bytes} bytes" in str(error)


def test_a_file_that_became_shorter_after_it_was_opened_is_refused(tmp_path) -> None:
    file = save_stack(tmp_path)
    with open_source(SourceSpec(path="."), tmp_path, Silent()) as source:
        file.write_bytes(file.read_bytes()[:-2])
        with pytest.raises(VolprepError, match="VP1031"):
            source.read_slab(0, 5)
        assert source.read_slab(3, 5)[0, 0, 0] == 300


def test_a_file_that_vanished_after_it_was_opened_is_refused(tmp_path) -> None:
    file = save_stack(tmp_path)
    with open_source(SourceSpec(path="."), tmp_path, Silent()) as source:
        file.unlink()
        with pytest.raises(VolprepError) as error:
            source.read_slab(2, 3)
    assert error.value.code == "VP1003"


def test_a_name_that_says_dicom_on_a_file_that_is_none_is_refused(tmp_path) -> None:
    save_stack(tmp_path)
    (tmp_path / "slice.DCM").touch()
    assert refusal(tmp_path).code == "VP1031"


def save_one(folder: Path, syntax: str) -> Path:
    """One slice, large enough for every encoder."""
    data = stack(1, shape_yx=(40, 36))[0]
    data.SliceThickness = "1"
    return save(compressed(data, syntax) if syntax in COMPRESSED else data, folder / "slice", syntax)


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("syntax", [*NATIVE, *COMPRESSED])
def test_every_prefix_of_a_file_is_refused(tmp_path, syntax) -> None:
    file = save_one(tmp_path, syntax)
    whole = file.read_bytes()
    original = read(file)
    header_bytes = 700
    step = 7 if syntax in COMPRESSED else 1  # their headers are like the others
    sizes = [*range(0, min(header_bytes, len(whole)), step), *range(header_bytes, len(whole), 41), len(whole) - 1]
    for size in sizes:
        write_anew(file, whole[:size])
        if size == len(whole) - 1 and syntax == DeflatedExplicitVRLittleEndian:
            assert np.array_equal(read(file), original), "only the byte that makes the length even is missing"
        else:
            # Without the whole prefix it is not known as DICOM.
            assert refusal_at_open(file).code in ({"VP1002"} if size < 132 else {"VP1031", "VP1032"}), size


def test_every_tenth_prefix_of_a_slice_within_a_series_is_refused(tmp_path) -> None:
    file = save_stack(tmp_path)
    whole = file.read_bytes()
    for size in range(0, len(whole), 10):
        write_anew(file, whole[:size])
        assert refusal_at_open(tmp_path).code in ({"VP2014"} if size < 132 else {"VP1031", "VP1032"}), size


GEOMETRY = ("ImageOrientationPatient", "ImagePositionPatient", "PixelSpacing", "Rows", "Columns")


@pytest.mark.parametrize("keyword", [*GEOMETRY, "BitsStored", "PixelRepresentation", "SamplesPerPixel"])
def test_a_missing_essential_attribute_is_named(tmp_path, keyword) -> None:
    file = save_stack(tmp_path, **{keyword: None})
    error = refusal(tmp_path)
    assert error.code == "VP1036"
    assert f"{file}: the attribute {keyword} is missing" in str(error)


@pytest.mark.parametrize(
    ("keyword", "value"),
    [
        ("PixelSpacing", ["0", "1"]),
        ("PixelSpacing", ["-1", "1"]),
        ("PixelSpacing", ["1"]),
        ("ImagePositionPatient", ["1", "2"]),
        ("ImagePositionPatient", ["1e300", "2", "3"]),
        ("ImageOrientationPatient", ["1", "0", "0"]),
        ("RescaleSlope", "0"),
        ("BitsStored", 17),
        ("HighBit", 16),
        ("HighBit", 14),
        ("PixelRepresentation", 2),
        ("PhotometricInterpretation", "GREYISH"),
        ("Rows", 0),
    ],
)
def test_a_wrong_value_is_named(tmp_path, keyword, value) -> None:
    file = save_stack(tmp_path, **{keyword: value})
    error = refusal(tmp_path)
    assert error.code == "VP1037"
    assert f"{file}: the value of {keyword} is not" in str(error)


@pytest.mark.parametrize("text", [b"abc", b"nan", b"inf", b"1\\\\2", b"\xff\xfe"])
def test_numbers_that_are_none_are_refused(tmp_path, text) -> None:
    file = save_stack(tmp_path, PixelSpacing=["1.25", "1.5"])
    file.write_bytes(file.read_bytes().replace(b"1.25\\1.5", text.ljust(8)))
    assert refusal(tmp_path).code == "VP1037"


def test_a_colour_image_is_refused(tmp_path) -> None:
    colour = image(
        np.zeros((3, 12), np.uint8), (0, 0, 5), Columns=4, SamplesPerPixel=3, PhotometricInterpretation="RGB"
    )
    save_stack(tmp_path, colour)
    error = refusal(tmp_path)
    assert error.code == "VP1035"
    assert "RGB" in str(error)


def test_a_palette_image_is_refused(tmp_path) -> None:
    save_stack(tmp_path, PhotometricInterpretation="PALETTE COLOR")
    assert refusal(tmp_path).code == "VP1035"


def test_a_multi_frame_image_is_refused_with_its_frames(tmp_path) -> None:
    save_stack(tmp_path, NumberOfFrames="7")
    error = refusal(tmp_path)
    assert error.code == "VP1041"
    assert "7 frames" in str(error)


def test_a_mosaic_is_refused(tmp_path) -> None:
    save_stack(tmp_path, ImageType=["ORIGINAL", "PRIMARY", "M", "MOSAIC"])
    assert refusal(tmp_path).code == "VP1042"


@pytest.mark.parametrize("bits", [1, 24, 64])
def test_pixels_of_other_widths_are_refused(tmp_path, bits) -> None:
    save_stack(tmp_path, BitsAllocated=bits, BitsStored=1, HighBit=0)
    error = refusal(tmp_path)
    assert error.code == "VP1043"
    assert f"{bits}-bit pixels" in str(error)


def test_a_segmentation_is_told_to_be_given_with_its_scan(tmp_path) -> None:
    save_stack(tmp_path, Modality="SEG", BitsAllocated=1, BitsStored=1, HighBit=0)
    error = refusal(tmp_path)
    assert (error.code, "--segments" in str(error)) == ("VP1053", True)


@pytest.mark.parametrize("lie", [{"Rows": 6}, {"Rows": 4}, {"Rows": 3}, {"Rows": 1}, {"Columns": 3}, {"Columns": 4}])
@pytest.mark.parametrize("syntax", [ImplicitVRLittleEndian, DeflatedExplicitVRLittleEndian])
def test_pixel_data_that_are_not_exactly_as_long_as_the_header_says_are_refused(tmp_path, lie, syntax) -> None:
    images = stack(3, shape_yx=(5, 5))
    for data in images:
        data.update(lie)
    save_all(images, tmp_path, syntax)
    assert refusal(tmp_path).code == "VP1040"


def test_half_the_bits_of_each_value_are_not_taken_for_the_values(tmp_path) -> None:
    save_stack(tmp_path, BitsAllocated=8, BitsStored=8, HighBit=7)
    assert refusal(tmp_path).code == "VP1040"


def test_the_pad_byte_of_an_odd_length_is_no_pixel(tmp_path) -> None:
    pixels = np.arange(15, dtype=np.uint8).reshape(3, 5)
    save_all([image(pixels + z, (0, 0, z)) for z in range(3)], tmp_path)
    assert read(tmp_path)[2].tolist() == (pixels + 2).tolist()


def test_a_huge_declared_slice_is_refused_before_anything_is_allocated(tmp_path) -> None:
    save_stack(tmp_path, Rows=65535, Columns=65535)
    error = refusal(tmp_path)
    assert error.code == "VP1044"
    assert "65535×65535" in str(error)


def test_a_deflated_file_that_unpacks_without_end_is_refused(tmp_path, monkeypatch) -> None:
    from volprep_formats.readers.dicom import inflate as dicom_inflate

    monkeypatch.setattr(dicom_inflate, "_MAX_INFLATED_BYTES", 10_000)
    file = save_stack(tmp_path, syntax=DeflatedExplicitVRLittleEndian)
    data = file.read_bytes()
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    meta_bytes = 144 + int.from_bytes(data[140:144], "little")
    file.write_bytes(data[:meta_bytes] + packer.compress(bytes(10**6)) + packer.flush())
    assert refusal(tmp_path).code == "VP1032"


def test_a_deflated_file_takes_little_memory_however_large_it_unpacks(tmp_path) -> None:
    from volprep_formats.readers.dicom.inflate import inflate_into, inflated_data_set

    file = save_stack(tmp_path, syntax=DeflatedExplicitVRLittleEndian)
    data = file.read_bytes()
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    meta_bytes = 144 + int.from_bytes(data[140:144], "little")
    file.write_bytes(data[:meta_bytes] + packer.compress(bytes(10**8) + b"end") + packer.flush())
    tracemalloc.start()
    with inflated_data_set(file) as unpacked:
        size = unpacked.seek(0, 2)
    part = bytearray(9)
    count = inflate_into(file, 10**8 - 2, memoryview(part))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert (size, part[:count]) == (10**8 + 3, b"\0\0end")
    assert peak < 10**7


def test_a_deflated_slice_is_held_once(tmp_path) -> None:
    pixels = np.zeros((2048, 2048), np.uint16)
    pixels[7, 9] = 300
    save_all([image(pixels, (0, 0, z)) for z in range(2)], tmp_path, DeflatedExplicitVRLittleEndian)
    with open_source(SourceSpec(path=str(tmp_path)), Path(), Silent()) as source:
        tracemalloc.start()
        slab = source.read_slab(0, 1)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert slab[0, 7, 9] == 300
    assert peak < 1.75 * pixels.nbytes


@pytest.mark.parametrize("syntax", ["1.2.840.10008.1.2.4.106", "1.2.3.4"])
def test_a_syntax_without_a_decoder_is_refused(tmp_path, syntax) -> None:
    images = [compressed(data, RLELossless) for data in stack(3)]
    save_all(images, tmp_path, syntax)
    error = refusal(tmp_path)
    assert (error.code, error.status) == ("VP1038", ExitStatus.MACHINE)


def test_compressed_data_that_cannot_be_decoded_is_refused_without_noise(tmp_path, capfd) -> None:
    images = [compressed(data, JPEGLSLossless) for data in stack(5, shape_yx=(40, 36))]
    save_all(images, tmp_path, JPEGLSLossless)
    file = tmp_path / "I001"
    data = file.read_bytes()
    start = data.index(b"\xff\xd8")
    file.write_bytes(data[: start + 20] + b"\xff\xd9" * ((len(data) - start - 28) // 2) + data[-8:])
    error = refusal(tmp_path)
    assert error.code == "VP1039"
    assert "JPEG-LS" in str(error)
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="no file here that opens and cannot be read")
def test_an_unreadable_file_is_refused(tmp_path) -> None:
    file = save_stack(tmp_path)
    file.unlink()
    file.symlink_to("/proc/self/mem")
    error = refusal(tmp_path)
    assert error.code == "VP1003"
    assert "Input/output error" in str(error)


def test_no_text_of_the_header_comes_through(tmp_path) -> None:
    canary = "CANARY JANE"
    images = stack(6)
    for k, data in enumerate(images):
        for keyword in ("PatientName", "PatientID", "SeriesDescription", "InstitutionName", "StudyID", "Modality"):
            setattr(data, keyword, canary)
        data.RescaleIntercept, data.RescaleSlope, data.RescaleType, data.Units = "0", "1", canary, canary
        data.ImageType = [canary, canary]
        data.BurnedInAnnotation = canary
        data.EchoTime = str(k)
    save_all(images, tmp_path)
    with open_source(SourceSpec(path="."), tmp_path, Silent()) as source:
        assert canary not in source.info.model_dump_json()
        assert (source.info.modality, source.info.unit) == ("", "")
    images[3].PhotometricInterpretation = canary
    images[4].ImagePositionPatient = images[5].ImagePositionPatient
    save_all(images, tmp_path)
    assert canary not in str(refusal(tmp_path))
    images[3].PhotometricInterpretation = "MONOCHROME2"
    save_all(images, tmp_path)
    assert canary not in str(refusal(tmp_path))


def test_only_attributes_of_geometry_and_pixels_are_read() -> None:
    assert not [keyword for keyword in TAGS if "Patient" in keyword and not keyword.startswith("Image")]
    named = {keyword for keyword in TAGS if any(word in keyword for word in ("Name", "Date", "Description"))}
    # A frame of an enhanced image has no time without its date, which is dropped.
    assert named == {"FrameAcquisitionDateTime"}
    assert _of_day("20260101101500.5") == _of_day("101500.5") == 36_900.5
