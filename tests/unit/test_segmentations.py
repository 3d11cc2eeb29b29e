"""Readers of segmentations: what they give for real files and for odd ones, and what they refuse."""

from contextlib import nullcontext
from pathlib import Path

import nibabel
import numpy as np
import pydicom
import pytest
from segment_files import FRAME, item, seg, seg_nrrd, structure_set
from zarr_stores import multiscales, write_store

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
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
    return [
        np.isin(found.labels, [label for label, members in enumerate(found.members) if place in members])
        for place in range(len(found.segments))
    ]


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


def test_the_slices_of_the_scan_settle_how_far_frames_are_apart_that_say_their_thickness_alone(tmp_path):
    def thin(path: Path, pitch_mm: float, **attributes: object) -> Path:
        frames = [(1, (0, 0, pitch_mm * z), np.ones((4, 4), np.uint8)) for z in (1, 2, 5)]
        measures = item(PixelSpacing=["0.5", "0.25"], SliceThickness="1", **attributes)
        plane = item(ImageOrientationPatient=["1", "0", "0", "0", "1", "0"])
        groups = [item(PlaneOrientationSequence=[plane], PixelMeasuresSequence=[measures])]
        return seg(path, frames, numbers=(1,), SharedFunctionalGroupsSequence=groups)

    scan = Grid.of((9, 4, 4), (2.0, 0.5, 0.25), (0.0, 0.0, 0.0))
    path = thin(tmp_path / "thin.dcm", 2.0)
    found = open_segmentation(path, Silent(), scan)
    assert found.grid.spacing_mm_zyx[0] == 2.0
    assert masks(found)[0].any(axis=(1, 2)).tolist() == [True, True, False, False, True]
    other = Grid.of((9, 4, 4), (2.0, 0.7, 0.7), (0.0, 0.0, 0.0))
    assert open_segmentation(path, Silent(), other).grid.spacing_mm_zyx[0] == 1.0


def test_a_fraction_of_one_half_is_inside(tmp_path):
    plane = np.array([[0, 49, 50, 100]], np.uint8)
    path = seg(tmp_path / "f.dcm", [(1, (0, 0, 0), plane)], kind="FRACTIONAL", MaximumFractionalValue=100, numbers=(1,))
    found = opened(path)
    assert masks(found)[0].ravel().tolist() == [False, False, True, True]
    assert "one half" in found.remarks[0]


def test_a_deflated_file_is_read_and_one_that_swells_is_refused(tmp_path, monkeypatch):
    path = seg(tmp_path / "s.dcm", [(1, (0, 0, 0), np.eye(4, dtype=np.uint8))], numbers=(1,))
    data = pydicom.dcmread(path)
    data.file_meta.TransferSyntaxUID = "1.2.840.10008.1.2.1.99"
    data.save_as(tmp_path / "deflated.dcm")
    found = opened(tmp_path / "deflated.dcm")
    assert np.array_equal(masks(found)[0][0], np.eye(4))
    monkeypatch.setattr("volprep_formats.readers.dicom.inflate._MAX_INFLATED_BYTES", 100)
    assert code_of(lambda: opened(tmp_path / "deflated.dcm")) == "VP1400"


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


def test_layers_of_a_segmentation_may_lie_along_the_last_axis(tmp_path):
    layers = np.zeros((1, 3, 2, 4), np.uint8)
    layers[0, 1, 0, 1:3] = 1
    path = seg_nrrd(tmp_path / "s.seg.nrrd", layers, ["Segment0_Layer:=0", "Segment0_LabelValue:=1"])
    text = path.read_bytes()
    for old, new in (
        (b"sizes: 1 4 2 3", b"sizes: 4 2 3 1"),
        (b"none (0.25,0,0) (0,0.5,0) (0,0,2)", b"(0.25,0,0) (0,0.5,0) (0,0,2) none"),
        (b"list domain domain domain", b"domain domain domain list"),
    ):
        assert old in text
        text = text.replace(old, new)
    path.write_bytes(text)
    found = opened(path)
    assert np.array_equal(found.labels, layers[0])
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
    assert found.remarks == ()
    (tmp_path / ".hidden").touch()
    (tmp_path / "statistics.json").touch()
    (tmp_path / "preview.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    assert [remark.split(" (")[0] for remark in opened(tmp_path).remarks] == [
        "2 other entries of the folder are no masks"
    ]
    nibabel.save(nibabel.Nifti1Image(mask, np.diag([1, 1, 2, 1])), tmp_path / "tumor.nii.gz")
    assert code_of(lambda: opened(tmp_path)) == "VP1408"


def _save(path: Path, values, affine=None) -> None:
    nibabel.save(nibabel.Nifti1Image(values, np.eye(4) if affine is None else affine), path)


def test_a_mask_of_fractions_is_inside_from_one_half_on(tmp_path):
    for name, column in (("a", (0.004, 0.49, 0.5, 1)), ("b", (0, 0, 255, 255)), ("c", (0, 1, 3, 2))):
        dtype = np.float32 if name == "a" else np.uint8
        _save(tmp_path / f"{name}.nii", np.array(column, dtype).reshape(1, 1, 4))
    found = opened(tmp_path)
    inside = [mask.ravel().astype(int).tolist() for mask in masks(found)]
    assert inside == [[0, 0, 1, 1], [0, 0, 1, 1], [0, 1, 1, 1]]
    assert [remark.split(";")[0] for remark in found.remarks] == [
        "masks with fractions: 1",
        "masks with several numbers above 0: 3",
    ]


@pytest.mark.parametrize(("values", "says"), [((0, 1, -5), "-5"), ((0, 0.5, 40), "40")])
def test_a_scan_among_masks_is_refused_with_its_value(tmp_path, values, says):
    _save(tmp_path / "ct.nii", np.array(values, np.float32).reshape(1, 1, 3))
    with pytest.raises(VolprepError, match=f"VP1415 .* slice 2 has the value {says};"):
        opened(tmp_path)


def test_a_file_of_several_volumes_offers_no_option_of_the_scan(tmp_path):
    _save(tmp_path / "four.nii", np.ones((2, 3, 4, 5), np.uint8))
    with pytest.raises(VolprepError, match=r"VP1414 .* 2×3×4×5 .* a file of its own"):
        opened(tmp_path / "four.nii")


def test_label_numbers_of_an_atlas_may_be_large(tmp_path):
    numbers = np.array([0, 997, 2**24, 2**24 + 1, 614454277, 182305689, 997, 0], np.uint32)
    _save(tmp_path / "atlas.nii", numbers.reshape(2, 2, 2))
    found = opened(tmp_path / "atlas.nii")
    assert [each.number for each in found.segments] == [997, 2**24, 2**24 + 1, 182305689, 614454277]
    assert [mask.sum() for mask in masks(found)] == [2, 1, 1, 1, 1]


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
        (lambda path: seg(path, [(1, (0, 0, z), PLANE) for z in (0, 1e6)], pitch_mm=1e-3), "VP1310"),
        (lambda path: seg(path, [(1, (0, 0, z), PLANE) for z in (0, 1, 8e6)], pitch_mm=1.0), "VP1310"),
        (lambda path: seg(path, [(1, (0, 0, z), np.ones((512, 512), np.uint8)) for z in (0, 4e4)]), "VP1402"),
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


def test_labels_that_are_very_much_finer_than_the_scan_are_refused_before_they_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr("volprep_formats.segmentations.overlaps._ALLOWED", 100)
    scan = Grid.of((2, 2, 2), (8.0, 8.0, 8.0))
    for side, code in ((8, None), (9, "VP1402")):
        fields = ["Segment0_LabelValue:=1"]
        files = [seg_nrrd(tmp_path / "s.seg.nrrd", np.ones((1, side, side, side), np.uint8), fields)]
        files.append(seg(tmp_path / "s.dcm", [(1, (0, 0, z), np.ones((side, side), np.uint8)) for z in range(side)]))
        _save(tmp_path / "s.nii", np.ones((side, side, side), np.uint8))
        folder = tmp_path / f"masks{side}"
        folder.mkdir()
        _save(folder / "a.nii", np.ones((side, side, side), np.uint8))
        for path in (*files, tmp_path / "s.nii", folder):
            with nullcontext() if code is None else pytest.raises(VolprepError, match=code):
                assert open_segmentation(path, Silent(), scan).labels.all()


def test_values_that_are_no_labels_are_refused(tmp_path):
    nibabel.save(nibabel.Nifti1Image(np.full((3, 3, 3), 1.5, np.float32), np.eye(4)), tmp_path / "scan.nii")
    assert code_of(lambda: opened(tmp_path / "scan.nii")) == "VP1407"
    _save(tmp_path / "below.nii", np.full((3, 3, 3), -1, np.int16))
    assert code_of(lambda: opened(tmp_path / "below.nii")) == "VP1407"
    assert code_of(lambda: opened(tmp_path / "none.nii")) == "VP1001"


def test_the_label_image_of_an_ome_zarr_store_is_found_and_several_are_listed(tmp_path):
    store = tmp_path / "s.ome.zarr"
    write_store(store, [np.full((2, 3, 4), 9, np.uint8)], multiscales("zyx"), 2)
    (store / "labels").mkdir()
    (store / "labels/.zgroup").write_text('{"zarr_format": 2}')
    labels = np.array([0, 1, 0, 5] * 6, np.uint8).reshape(2, 3, 4)
    write_store(store / "labels/cells", [labels], multiscales("zyx"), 2)
    for path in (store, store / "labels", store / "labels/cells"):
        assert [each.number for each in opened(path).segments] == [1, 5]
    write_store(store / "labels/nuclei", [labels], multiscales("zyx"), 2)
    with pytest.raises(VolprepError, match=r"VP1416 .* 2 label images, and one is needed: cells, nuclei"):
        opened(store)
    assert len(opened(store / "labels/nuclei").segments) == 2


def test_a_mask_that_is_nan_somewhere_is_outside_there_and_remarked(tmp_path):
    _save(tmp_path / "a.nii", np.array((np.nan, 0, 1, 1), np.float32).reshape(1, 1, 4))
    found = opened(tmp_path)
    assert [mask.ravel().astype(int).tolist() for mask in masks(found)] == [[0, 0, 1, 1]]
    assert [remark.split(";")[0] for remark in found.remarks] == ["masks with NaN: 1"]
