"""Readers of segmentations: what they give for real files and for odd ones, and what they refuse."""

from pathlib import Path

import nibabel
import numpy as np
import pytest
from segment_files import FRAME, seg, seg_nrrd, structure_set

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.segmentations import open_segmentation
from volprep_formats.segmentations.cielab import srgb_of_cielab
from volprep_formats.source import SourceSpec

DCMQI = "segments/dcmqi/data/segmentations"
RNG = np.random.default_rng(5)


def opened(path: Path):
    return open_segmentation(path, Silent())


def voxels(path: Path) -> np.ndarray:
    with open_source(SourceSpec(path=str(path)), Path(), Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0])


def masks(found) -> list[np.ndarray]:
    """The mask of each segment, in the order of the segments."""
    return [np.any([layer == place for layer in found.layers], axis=0) for place in range(1, 1 + len(found.segments))]


def code_of(call) -> str:
    with pytest.raises(VolprepError) as raised:
        call()
    return raised.value.code


@pytest.mark.parametrize(
    ("name", "references"),
    [
        ("liver.dcm", {1: "liver_seg.nrrd"}),
        (
            "partial_overlaps.dcm",
            {n: f"partial_overlaps-{file}.nrrd" for n, file in {1: 1, 2: 2, 3: 3, 4: 1, 5: 1}.items()},
        ),
        ("sparse-labelmap-ppv5.dcm", {1: "sparse_labelmap_ppv5_seg.nrrd"}),
        ("sparse-labelmap-noppv.dcm", {1: "sparse_labelmap_noppv_seg.nrrd"}),
        ("23x38x3/seg/label.seg", {1: "23x38x3/nrrd/label.nrrd"}),
    ],
)
def test_a_dicom_segmentation_gives_the_label_volume_that_belongs_to_it(scans, name, references):
    folder = scans / DCMQI
    found = opened(folder / name)
    assert [segment.number for segment in found.segments] == list(references)
    for segment, mask in zip(found.segments, masks(found), strict=True):
        assert np.array_equal(mask, voxels(folder / references[segment.number]) == segment.number)
        assert mask.any()


def test_a_real_file_gives_names_codes_and_colours(scans):
    (liver,) = opened(scans / DCMQI / "liver.dcm").segments
    assert (liver.name, liver.code.scheme, liver.code.value) == ("Liver", "SRT", "T-62000")
    assert np.round(np.array(liver.colour) * 255).tolist() == [221, 130, 101]


def test_white_and_black_survive_cielab():
    assert srgb_of_cielab([65535, 32896, 32896]) == pytest.approx((1, 1, 1), abs=2e-3)
    assert srgb_of_cielab([0, 32896, 32896]) == pytest.approx((0, 0, 0), abs=1e-6)
    assert srgb_of_cielab([70000, 0, 0]) is None


def test_frames_in_any_order_with_gaps_and_an_oblique_plane_find_their_slices(tmp_path):
    row, column = np.array([0.0, 0.6, 0.8]), np.array([1.0, 0.0, 0.0])
    normal = np.cross(row, column)
    planes = RNG.integers(0, 2, (4, 3, 5)).astype(np.uint8)
    origin = np.array([5.0, -3.0, 7.0])
    slices = [4, 0, 2, 4]
    frames = [
        (number, origin + 2.0 * z * normal, plane)
        for number, z, plane in zip((1, 1, 1, 2), slices, planes, strict=True)
    ]
    found = opened(seg(tmp_path / "a.dcm", frames, orientation=[*row, *column]))
    assert found.grid.shape_zyx == (5, 3, 5)
    assert found.grid.spacing_mm_zyx == pytest.approx((2.0, 0.5, 0.25))
    assert found.grid.origin_mm_xyz == pytest.approx(tuple(origin))
    assert np.array(found.grid.direction)[:, 2] == pytest.approx(normal)
    one, two = masks(found)
    for z in range(5):
        expected = planes[slices.index(z)] if z in slices else np.zeros((3, 5))
        assert np.array_equal(one[z], expected)
    assert np.array_equal(two[4], planes[3])
    assert found.frame_of_reference == FRAME


def test_a_fraction_of_one_half_is_inside(tmp_path):
    plane = np.array([[0, 49, 50, 100]], np.uint8)
    path = seg(tmp_path / "f.dcm", [(1, (0, 0, 0), plane)], kind="FRACTIONAL", MaximumFractionalValue=100, numbers=(1,))
    found = opened(path)
    assert masks(found)[0].ravel().tolist() == [False, False, True, True]
    assert "one half" in found.remarks[0]


def test_layers_of_slicer_overlap_and_keep_their_names(tmp_path):
    layers = np.zeros((2, 2, 3, 4), np.uint8)
    layers[0, 0, 1] = (0, 1, 1, 2)
    layers[1, 0, 1] = (3, 3, 0, 0)
    fields = [
        "Segment0_Name:=Left: lung",
        "Segment0_Layer:=0",
        "Segment0_LabelValue:=1",
        "Segment0_Color:=0.5 0.25 1",
        "Segment1_LabelValue:=2",
        "Segment1_Layer:=0",
        "Segment2_LabelValue:=3",
        "Segment2_Layer:=1",
        "Segment2_Tags:=TerminologyEntry:x~SCT^1^Tissue~SCT^2^Kidney~SCT^3^Right~Anatomic~^^~^^|",
    ]
    found = opened(seg_nrrd(tmp_path / "s.seg.nrrd", layers, fields))
    assert [mask[0, 1].astype(int).tolist() for mask in masks(found)] == [[0, 1, 1, 0], [0, 0, 0, 1], [1, 1, 0, 0]]
    assert (found.segments[0].name, found.segments[0].colour) == ("Left: lung", (0.5, 0.25, 1.0))
    assert (found.segments[2].code.value, found.segments[2].code.meaning) == ("2+3", "Kidney, Right")
    assert found.grid.spacing_mm_zyx == (2.0, 0.5, 0.25)


def test_a_folder_has_a_segment_for_each_mask(tmp_path):
    mask = np.zeros((5, 4, 3), np.uint8)
    for name, x in (("kidney_left", 1), ("spleen", 3)):
        own = mask.copy()
        own[x] = 1
        nibabel.save(nibabel.Nifti1Image(own, np.eye(4)), tmp_path / f"{name}.nii.gz")
    found = opened(tmp_path)
    assert [segment.name for segment in found.segments] == ["kidney_left", "spleen"]
    assert [mask.sum() for mask in masks(found)] == [12, 12]
    assert len(found.layers) == 1
    assert found.remarks == ()
    (tmp_path / ".hidden").touch()
    (tmp_path / "statistics.json").touch()
    (tmp_path / "preview.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    assert [remark.split(" (")[0] for remark in opened(tmp_path).remarks] == [
        "2 other entries of the folder are no masks"
    ]
    nibabel.save(nibabel.Nifti1Image(mask, np.diag([1, 1, 2, 1])), tmp_path / "tumor.nii.gz")
    assert code_of(lambda: opened(tmp_path)) == "VP1408"


def test_data_files_of_headers_are_not_told_as_other_entries(tmp_path):
    header = "NDims = 3\nDimSize = 3 2 2\nElementType = MET_UCHAR\nElementDataFile = {}.raw\n"
    for name, x in (("liver", 0), ("spleen", 2)):
        mask = np.zeros((2, 2, 3), np.uint8)
        mask[:, :, x] = 1
        (tmp_path / f"{name}.mhd").write_text(header.format(name))
        (tmp_path / f"{name}.raw").write_bytes(mask.tobytes())
    found = opened(tmp_path)
    assert [segment.name for segment in found.segments] == ["liver", "spleen"]
    assert [mask[0, 0].astype(int).tolist() for mask in masks(found)] == [[1, 0, 0], [0, 0, 1]]
    assert found.remarks == ()
    (tmp_path / "other.raw").touch()
    assert [remark[:1] for remark in opened(tmp_path).remarks] == ["1"]
    nibabel.save(nibabel.Nifti1Image(np.ones((3, 2, 2), np.uint8), np.diag([-1, -1, 1, 1])), tmp_path / "veil.nii")
    (tmp_path / "veil.raw").touch()
    assert [remark[:1] for remark in opened(tmp_path).remarks] == ["2"]


def test_contours_keep_their_points_and_colours(tmp_path):
    ring = [(0, 0, 1), (2, 0, 1), (2, 2, 1)]
    found = opened(structure_set(tmp_path / "r.dcm", [[ring], []]))
    assert np.array_equal(found.rings[0][0], ring)
    assert found.rings[1] == ()
    assert found.segments[0].colour == (1.0, 0.0, 0.2)
    assert found.frame_of_reference == FRAME


PLANE = np.ones((2, 3), np.uint8)


@pytest.mark.parametrize(
    ("make", "code"),
    [
        (lambda path: seg(path, [(7, (0, 0, 0), PLANE)]), "VP1400"),
        (lambda path: seg(path, [(1, (0, 0, 0), PLANE)], NumberOfFrames=9), "VP1400"),
        (lambda path: seg(path, [(1, (0, 0, 0), PLANE)], Rows=400), "VP1404"),
        (lambda path: seg(path, [(1, (0, 0, 0), PLANE)], Rows=65535, Columns=65535), "VP1404"),
        (lambda path: seg(path, [(1, (0, 0, z), PLANE) for z in (0, 1e6)], pitch_mm=1e-3), "VP1402"),
        (lambda path: seg(path, [(1, (0, 0, z), PLANE) for z in (0, 2, 5)]), "VP1405"),
        (lambda path: seg(path, [(1, (x, 0, 2 * x), PLANE) for x in (0, 1)]), "VP1405"),
        (lambda path: seg(path, [(1, (0, 0, 0), PLANE)], SegmentSequence=[]), "VP1401"),
        (lambda path: seg(path, [(1, (0, 0, 0), PLANE)], SegmentationType="ODD"), "VP1400"),
        (lambda path: structure_set(path, []), "VP1401"),
        (lambda path: structure_set(path, [[[(0, 0, 0), (1, 0, 0), (0, 1e9, 0)]]]), "VP1400"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_cannot_be_a_segmentation_is_refused(tmp_path, make, code):
    path = make(tmp_path / "bad.dcm")
    assert code_of(lambda: opened(path)) == code


def test_values_that_are_no_labels_are_refused(tmp_path):
    nibabel.save(nibabel.Nifti1Image(np.full((3, 3, 3), 1.5, np.float32), np.eye(4)), tmp_path / "scan.nii")
    assert code_of(lambda: opened(tmp_path / "scan.nii")) == "VP1407"
    assert code_of(lambda: opened(tmp_path / "none.nii")) == "VP1001"
