"""Enhanced multi-frame images: each frame lies where its functional groups say, whatever the order of the frames."""

from pathlib import Path

import numpy as np
import pytest
from dicom_files import ds, encoded, image, save, save_all, stack
from pydicom.dataset import Dataset
from pydicom.encaps import encapsulate
from pydicom.sequence import Sequence
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    ExplicitVRBigEndian,
    ExplicitVRLittleEndian,
    ImplicitVRLittleEndian,
    JPEGLSLossless,
    RLELossless,
)
from write_anew import write_anew

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceInfo, SourceSpec

ENHANCED_MR = "1.2.840.10008.5.1.4.1.1.4.1"
ROW, COLUMN = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, -1.0])
NORMAL = np.cross(ROW, COLUMN)
ORIGIN = np.array([-31.0, 14.25, 9.5])
ORDER = [3, 0, 4, 1, 2]
PITCH = 2.25
SPACING_YX = (1.5, 1.25)


def item(**attributes) -> Dataset:
    data = Dataset()
    for keyword, value in attributes.items():
        setattr(data, keyword, value)
    return data


def groups(**sequences: Dataset) -> Dataset:
    return item(**{keyword: Sequence([one]) for keyword, one in sequences.items()})


def enhanced(order=ORDER, dtype="<i2", **attributes) -> Dataset:
    """Five frames in a shuffled order; the voxels of slice z are 100·z + 10·y + x."""
    y, x = np.indices((9, 8))
    frames = np.array([100 * z + 10 * y + x for z in order]).astype(dtype)
    data = image(frames[0])
    for keyword in ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"):
        del data[keyword]
    data.SOPClassUID = ENHANCED_MR
    data.NumberOfFrames = len(order)
    data.PixelData = frames.tobytes()
    data.SharedFunctionalGroupsSequence = Sequence(
        [
            groups(
                PlaneOrientationSequence=item(ImageOrientationPatient=ds([*ROW, *COLUMN])),
                PixelMeasuresSequence=item(PixelSpacing=ds(SPACING_YX), SliceThickness="9"),
                PixelValueTransformationSequence=item(RescaleSlope="2", RescaleIntercept="-5", RescaleType="US"),
            )
        ]
    )
    data.PerFrameFunctionalGroupsSequence = Sequence(
        [
            groups(
                PlanePositionSequence=item(ImagePositionPatient=ds(ORIGIN + NORMAL * PITCH * z)),
                FrameContentSequence=item(TemporalPositionIndex=1),
            )
            for z in order
        ]
    )
    for keyword, value in attributes.items():
        setattr(data, keyword, value)
    return data


def read(path: Path, **told: object) -> tuple[np.ndarray, SourceInfo]:
    with open_source(SourceSpec(path=str(path), **told), Path(), Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0]), source.info


def refusal(data: Dataset, folder: Path) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        read(save(data, folder / "e"))
    return error.value


def expected() -> np.ndarray:
    z, y, x = np.indices((5, 9, 8))
    return 100 * z + 10 * y + x


@pytest.mark.parametrize(
    "syntax", [ExplicitVRLittleEndian, ImplicitVRLittleEndian, ExplicitVRBigEndian, DeflatedExplicitVRLittleEndian]
)
def test_frames_are_sorted_by_where_they_lie(tmp_path, syntax) -> None:
    voxels, info = read(save(enhanced(), tmp_path / "e", syntax))
    assert np.array_equal(voxels, expected())
    assert (info.slope, info.intercept, info.modality) == (2.0, -5.0, "MR")
    assert info.grid.spacing_mm_zyx == pytest.approx((PITCH, *SPACING_YX))
    np.testing.assert_allclose(info.grid.origin_mm_xyz, ORIGIN, atol=1e-9)
    np.testing.assert_allclose(info.grid.direction, np.column_stack((ROW, COLUMN, NORMAL)), atol=1e-9)


def test_what_a_frame_says_wins_over_what_all_share(tmp_path) -> None:
    data = enhanced()
    for k, own in enumerate(data.PerFrameFunctionalGroupsSequence):
        values = item(RescaleSlope=str(k + 1), RescaleIntercept="0", RescaleType="US")
        own.PixelValueTransformationSequence = Sequence([values])
    voxels, info = read(save(data, tmp_path / "e"))
    assert info.stored_type == "float32"
    assert np.array_equal(voxels, expected() * (np.argsort(ORDER) + 1)[:, None, None])


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("syntax", [RLELossless, JPEGLSLossless])
@pytest.mark.parametrize("parts", [1, 2])
@pytest.mark.parametrize("has_table", [True, False])
def test_compressed_frames_are_found_in_their_fragments(tmp_path, syntax, parts, has_table) -> None:
    data = enhanced(dtype="<u2")
    singles = [encoded(frame, syntax, 16) for frame in np.frombuffer(data.PixelData, "<u2").reshape(5, 9, 8)]
    data.PixelData = encapsulate(singles, fragments_per_frame=parts, has_bot=has_table)
    data["PixelData"].is_undefined_length = True
    file = save(data, tmp_path / "e", syntax)
    if parts > 1 and not has_table:
        with pytest.raises(VolprepError, match="VP1045"):
            read(file)
    else:
        assert np.array_equal(read(file)[0], expected())


def test_several_time_points_are_refused_with_their_numbers(tmp_path) -> None:
    data = enhanced([*ORDER, *ORDER])
    for k, own in enumerate(data.PerFrameFunctionalGroupsSequence):
        own.FrameContentSequence[0].TemporalPositionIndex = 1 + k // 5
    error = refusal(data, tmp_path)
    assert error.code == "VP2006"
    assert "2 images at each of 5 places" in str(error)
    assert "differ in TemporalPositionIdentifier" in str(error)
    assert "e frame 2 and e frame 7" in str(error)
    assert "source.volume" in str(error)


@pytest.mark.parametrize("volume", [1, 2])
def test_one_of_several_time_points_is_read_on_request(tmp_path, volume) -> None:
    data = enhanced([*ORDER, *ORDER])
    data.PixelData = (
        (np.frombuffer(data.PixelData, "<i2").reshape(10, -1) + np.arange(10)[:, None] // 5 * 1000)
        .astype("<i2")
        .tobytes()
    )
    for k, own in enumerate(data.PerFrameFunctionalGroupsSequence):
        own.FrameContentSequence[0].TemporalPositionIndex = 300 - k // 5
    file = save(data, tmp_path / "e")
    with open_source(SourceSpec(path=str(file), volume=volume), Path(), Silent()) as source:
        assert np.array_equal(source.read_slab(0, 5), expected() + 1000 * (2 - volume))
        assert any(
            f"volume {volume} of 2, which differ in TemporalPositionIdentifier" in remark
            for remark in source.info.remarks
        )


def stacked(*stacks: dict[str, object], numbered: bool = True) -> Dataset:
    """Stacks of five frames of 9×8 voxels: `at` mm along the normal, turned if `turned`, with a StackID and a time."""
    data = enhanced(ORDER * len(stacks))
    frames = np.frombuffer(data.PixelData, "<i2").reshape(len(stacks), 5, -1)
    data.PixelData = (frames + 1000 * np.arange(len(stacks))[:, None, None]).astype("<i2").tobytes()
    for k, own in enumerate(data.PerFrameFunctionalGroupsSequence):
        stack, z = stacks[k // 5], ORDER[k % 5]
        row, column = (COLUMN, ROW) if stack.get("turned") else (ROW, COLUMN)
        place = ORIGIN + np.cross(row, column) * (PITCH * z + stack.get("at", 0.0))
        own.PlanePositionSequence[0].ImagePositionPatient = ds(place)
        own.PlaneOrientationSequence = Sequence([item(ImageOrientationPatient=ds([*row, *column]))])
        content = own.FrameContentSequence[0]
        content.TemporalPositionIndex = stack.get("time", 1)
        if numbered:
            content.InStackPositionNumber = 1 + (4 - z if stack.get("falls") else z)
        if "stack" in stack:
            content.StackID = stack["stack"]
    return data


END = 5 * PITCH


@pytest.mark.parametrize(
    ("stacks", "differ"),
    [
        (({"stack": "1"}, {"stack": "2", "at": END}), "StackID"),
        (({"stack": "1"}, {"stack": "1", "at": END}), "InStackPositionNumber"),
        (({}, {"at": END, "falls": True}), "InStackPositionNumber"),
    ],
)
def test_stacks_end_to_end_are_one_volume_with_a_remark_and_each_can_be_read_alone(tmp_path, stacks, differ) -> None:
    file = save(stacked(*stacks), tmp_path / "e")
    voxels, info = read(file)
    assert voxels.shape[0] == 10
    assert any(f"2 stacks, which differ in {differ} and lie end to end" in remark for remark in info.remarks)
    for volume in (1, 2):
        voxels, info = read(file, volume=volume)
        assert np.array_equal(voxels, expected() + 1000 * (volume - 1))
        assert any(f"differ in {differ}; number {volume} of them was read" in remark for remark in info.remarks)


@pytest.mark.parametrize(
    ("stacks", "cause"),
    [
        (({"stack": "1"}, {"stack": "2", "at": 2 * END}), "VP2014"),
        (({"stack": "1"}, {"stack": "2"}), "VP2006"),
        (({"stack": "2"}, {"stack": "10", "turned": True}), "VP2003"),
    ],
)
def test_stacks_that_are_not_one_grid_are_refused_and_can_be_chosen(tmp_path, stacks, cause) -> None:
    file = save(stacked(*stacks), tmp_path / "e")
    for told in ({}, {"repair": ("gaps",)}):
        with pytest.raises(VolprepError) as error:
            read(file, **told)
        assert error.value.code == "VP2022"
        assert cause in str(error.value)
        assert "from 1 to 2" in error.value.remedy
    for volume in (1, 2):
        assert np.array_equal(read(file, volume=volume)[0], expected() + 1000 * (volume - 1))
    with pytest.raises(VolprepError) as error:
        read(file, volume=3)
    assert error.value.code == "VP2017"


def test_volumes_of_several_stacks_are_numbered_stack_by_stack(tmp_path) -> None:
    turned = {"stack": "2", "turned": True}
    file = save(stacked({"stack": "1", "time": 2}, turned, {"stack": "1"}, turned | {"time": 2}), tmp_path / "e")
    for volume, part in enumerate((2, 0, 1, 3), 1):
        assert np.array_equal(read(file, volume=volume)[0], expected() + 1000 * part)
    told_by_nothing = stacked({"stack": "1"}, turned, turned)
    told_by_nothing.InstanceNumber = 1
    with pytest.raises(VolprepError) as error:
        read(save(told_by_nothing, tmp_path / "f"), volume=3)
    assert (error.value.code, "from 2 to 3" in error.value.remedy) == ("VP2006", True)


def test_numbers_that_count_no_slices_divide_nothing(tmp_path) -> None:
    data = stacked({"stack": "1"}, {"stack": "1", "at": END})
    plain = read(save(stacked({}, {"at": END}, numbered=False), tmp_path / "f"))[1].remarks
    interleaved, same, unlike = [1, 1, 2, 2, 3, 3, 4, 4, 5, 5], [7] * 10, [4, 1, 2, 9, 5, 3, 8, 6, 7, 10]
    for numbers in (interleaved, same, unlike):
        for k, own in enumerate(data.PerFrameFunctionalGroupsSequence):
            own.FrameContentSequence[0].InStackPositionNumber = numbers[ORDER[k % 5] + k // 5 * 5]
        voxels, info = read(save(data, tmp_path / "e"))
        assert (voxels.shape[0], info.remarks) == (10, plain)


def test_frames_of_one_place_are_told_apart_by_their_type_and_inversion_time(tmp_path) -> None:
    for group, values in (
        ("MRImageFrameTypeSequence", [item(FrameType=["DERIVED", "PRIMARY", "DIXON", w]) for w in ("FAT", "WATER")]),
        ("MRModifierSequence", [item(InversionTimes=time) for time in (20.0, 300.0)]),
    ):
        data = stacked({}, {})
        for k, own in enumerate(data.PerFrameFunctionalGroupsSequence):
            setattr(own, group, Sequence([values[k // 5]]))
        file = save(data, tmp_path / group)
        assert np.array_equal(read(file, volume=2)[0], expected() + 1000)


def test_a_volume_beyond_those_that_are_there_is_refused(tmp_path) -> None:
    file = save(enhanced(), tmp_path / "e")
    with pytest.raises(VolprepError, match="VP2017"):
        open_source(SourceSpec(path=str(file), volume=2), Path(), Silent())


def test_echoes_of_single_images_are_chosen_by_their_time(tmp_path) -> None:
    for echo, time in enumerate(("10.5", "9", "100")):
        images = stack(4)
        for data in images:
            data.EchoTime = time
            data.PixelData = (np.frombuffer(data.PixelData, "<i2") + 1000 * echo).astype("<i2").tobytes()
        save_all(images, tmp_path / time)
    for volume, echo in ((1, 1), (2, 0), (3, 2)):
        with open_source(SourceSpec(path=".", volume=volume), tmp_path, Silent()) as source:
            assert source.read_slab(1, 2)[0, 0, 0] == 1000 * echo + 100


def test_volumes_that_nothing_tells_apart_are_refused_with_or_without_a_choice(tmp_path) -> None:
    save_all(stack(4), tmp_path / "a")
    others = stack(4)
    for k, data in enumerate(others):
        data.SOPInstanceUID = f"1.2.9.{k}"
        data.PixelData = data.PixelData[::-1]
    save_all(others, tmp_path / "b")
    with pytest.raises(VolprepError, match="VP2006"):
        open_source(SourceSpec(path=".", volume=1), tmp_path, Silent())


def test_a_missing_frame_is_refused_with_its_gap(tmp_path) -> None:
    error = refusal(enhanced([3, 0, 4, 1]), tmp_path)
    assert (error.code, error.fields["missing"]) == ("VP2014", 1)


def test_single_images_and_frames_of_one_series_make_one_volume(tmp_path) -> None:
    upright = enhanced([1, 2])
    shared = upright.SharedFunctionalGroupsSequence[0]
    shared.PlaneOrientationSequence[0].ImageOrientationPatient = ds([1, 0, 0, 0, 1, 0])
    shared.PixelMeasuresSequence[0].PixelSpacing = ds([1, 1])
    shared.PixelValueTransformationSequence[0].RescaleSlope = "1"
    shared.PixelValueTransformationSequence[0].RescaleIntercept = "0"
    for z, own in zip((5, 6), upright.PerFrameFunctionalGroupsSequence, strict=True):
        own.PlanePositionSequence[0].ImagePositionPatient = ds([0, 0, z * 2.5])
    save_all(stack(5, shape_yx=(9, 8)), tmp_path)
    save(upright, tmp_path / "more")
    assert read(tmp_path)[0][:, 0, 0].tolist() == [0, 100, 200, 300, 400, 100, 200]


@pytest.mark.parametrize(
    ("change", "code", "said"),
    [
        ({"NumberOfFrames": 6}, "VP1041", "the file holds 6 frames, and places for 5 frames"),
        ({"NumberOfFrames": -1}, "VP1041", "unsound number of frames"),
        ({"NumberOfFrames": 2**30}, "VP1041", "unsound number of frames"),
        ({"PerFrameFunctionalGroupsSequence": Sequence([])}, "VP1041", "no places"),
        ({"SharedFunctionalGroupsSequence": Sequence([])}, "VP1036", "ImageOrientationPatient"),
        ({"PixelData": bytes(5 * 144 - 2)}, "VP1045", "720 bytes, but the pixel data have 718 bytes"),
        ({"PixelData": bytes(6 * 144 + 2)}, "VP1045", "720 bytes, but the pixel data have 866 bytes"),
    ],
)
def test_frames_without_a_certain_place_or_without_pixels_are_refused(tmp_path, change, code, said) -> None:
    error = refusal(enhanced(**change), tmp_path)
    assert error.code == code
    assert said in str(error)


@pytest.mark.parametrize("keyword", ["RescaleSlope", "PixelSpacing", "ImagePositionPatient"])
def test_an_unsound_number_in_a_group_is_named(tmp_path, keyword) -> None:
    file = save(enhanced(), tmp_path / "e")
    data = file.read_bytes()
    marks = {"RescaleSlope": (b"\x02\x002 ", b"\x02\x000 "), "PixelSpacing": (b"1.5\\1.25", b"1.5\\-1.2")}
    old, new = marks.get(keyword, (b"-31.0\\", b"-3e.0\\"))
    assert old in data
    file.write_bytes(data.replace(old, new))
    with pytest.raises(VolprepError) as error:
        read(file)
    assert error.value.code == "VP1037"
    assert keyword in str(error.value)


@pytest.mark.long
def test_every_prefix_and_many_mutations_of_a_multi_frame_file_end_in_a_coded_error_or_a_volume(tmp_path) -> None:
    file = save(enhanced(), tmp_path / "e")
    whole = np.frombuffer(file.read_bytes(), np.uint8)
    for size in range(132, len(whole) - 1, 13):
        write_anew(file, whole[:size].tobytes())
        with pytest.raises(VolprepError):
            read(file)
    chance = np.random.default_rng(8)
    refused = 0
    for _ in range(400):
        mutated = whole.copy()
        at = chance.integers(132, len(whole) - 720, chance.integers(1, 6))
        mutated[at] = chance.integers(0, 256, len(at))
        write_anew(file, mutated.tobytes())
        try:
            read(file)
        except VolprepError:
            refused += 1
    assert refused > 100


def test_a_mapping_to_real_world_values_in_the_groups_is_remarked(tmp_path) -> None:
    data = enhanced()
    data.SharedFunctionalGroupsSequence[0].RealWorldValueMappingSequence = Sequence([item(LUTLabel="x")])
    _, info = read(save(data, tmp_path / "e"))
    assert any("RealWorldValueMappingSequence" in remark for remark in info.remarks)


def test_a_table_of_values_beside_the_rescale_of_the_groups_is_refused(tmp_path) -> None:
    table = item(ModalityLUTType="US", LUTData=bytes(8))
    table.add_new("LUTDescriptor", "US", [4, 0, 16])
    assert refusal(enhanced(ModalityLUTSequence=Sequence([table])), tmp_path).code == "VP1050"


@pytest.mark.parametrize("lie", [{"NumberOfFrames": 4}, {"Rows": 8}, {"Rows": 10}, {"Columns": 4}])
def test_frames_that_do_not_fill_the_pixel_data_exactly_are_refused(tmp_path, lie) -> None:
    data = enhanced(**lie)
    if "NumberOfFrames" in lie:
        del data.PerFrameFunctionalGroupsSequence[-1]
    assert refusal(data, tmp_path).code == "VP1045"


def test_frames_that_another_file_repeats_are_counted_where_it_has_others_too(tmp_path) -> None:
    for name, order in (("a", [0, 1, 2]), ("b", [0, 1, 3])):
        save(enhanced(order=order), tmp_path / name)
    voxels, info = read(tmp_path)
    assert voxels[:, 0, 0].tolist() == [0, 100, 200, 300]
    assert "images that are copies of others of the series were left out: 2" in info.remarks
