"""Product and witness read the same segments from every kind of source, each with code of its own."""

from collections.abc import Callable
from pathlib import Path

import nibabel
import numpy as np
import pytest
from segment_files import seg, seg_nrrd, structure_set

from volprep.scan.segments.fitted import fitted_segments
from volprep.validation.witness.independent.scan import CannotWitnessError
from volprep.validation.witness.independent.segmentations import read_segments
from volprep.validation.witness.independent.segments import labels_on
from volprep_formats.grid import Grid
from volprep_formats.progress import Silent
from volprep_formats.segmentations import open_segmentation
from volprep_formats.segmentations.records import LabelVolume, ScanFrame

SHAPE_ZYX = (5, 6, 7)
LABELS = np.random.default_rng(5).integers(0, 3, SHAPE_ZYX).astype(np.uint8)


def of_dicom(folder: Path, kind: str = "BINARY") -> Path:
    """Write frames in no order, of which one is missing: it has no voxel."""
    labels = LABELS.copy()
    labels[2] = np.where(labels[2] == 1, 0, labels[2])
    places = [(number, z) for z in (3, 0, 4, 1, 2) for number in (2, 1) if (labels[z] == number).any()]
    inside = 1 if kind == "BINARY" else 200
    frames = [(number, (1.0, 2.0, 3.0 + 2.0 * z), inside * (labels[z] == number)) for number, z in places]
    return seg(folder / "seg.dcm", frames, kind=kind)


def of_label_map(folder: Path) -> Path:
    frames = [(1, (1.0, 2.0, 3.0 + 2.0 * z), plane) for z, plane in enumerate(LABELS)]
    return seg(folder / "seg.dcm", frames, kind="LABELMAP")


def of_slicer(folder: Path) -> Path:
    layers = np.stack([np.where(LABELS == 1, 7, 0), np.where(LABELS == 2, 3, 0)]).astype(np.uint8)
    fields = ["Segment0_Layer:=0", "Segment0_LabelValue:=7", "Segment1_Layer:=1", "Segment1_LabelValue:=3"]
    return seg_nrrd(folder / "organs.seg.nrrd", layers, fields)


def of_masks(folder: Path) -> Path:
    (folder / "masks").mkdir()
    for name, number in (("a", 1), ("b", 2)):
        image = nibabel.Nifti1Image((number == LABELS).astype(np.uint8).T, np.diag([-0.5, -0.8, 2.0, 1.0]))
        nibabel.save(image, folder / "masks" / f"{name}.nii.gz")
    return folder / "masks"


SOURCES: dict[str, Callable[[Path], Path]] = {
    "DICOM": of_dicom,
    "DICOM, fractions": lambda folder: of_dicom(folder, "FRACTIONAL"),
    "DICOM, a label map": of_label_map,
    "3D Slicer": of_slicer,
    "masks": of_masks,
}


@pytest.mark.parametrize("kind", SOURCES)
def test_product_and_witness_read_the_same_segments(kind: str, tmp_path: Path) -> None:
    path = SOURCES[kind](tmp_path)
    read, witnessed = open_segmentation(path, Silent()), read_segments({"source": path.name}, tmp_path, {})

    assert isinstance(read, LabelVolume)
    numbers = np.array([0, *(each.number for each in read.segments)])
    held = labels_on(witnessed.labels, read.grid.model_dump(mode="json"))
    assert np.array_equal(held, numbers[read.labels])
    voxel_ml = np.prod(read.grid.spacing_mm_zyx) / 1000.0
    for number in numbers[1:].tolist():
        assert witnessed.volume_ml(number) == pytest.approx((held == number).sum() * voxel_ml)


def test_overlapping_segments_keep_their_volumes(tmp_path: Path) -> None:
    layers = np.stack([LABELS > 0, LABELS > 1]).astype(np.uint8)
    fields = ["Segment0_Layer:=0", "Segment0_LabelValue:=1", "Segment1_Layer:=1", "Segment1_LabelValue:=1"]
    seg_nrrd(tmp_path / "organs.seg.nrrd", layers, fields)

    found = read_segments({"source": "organs.seg.nrrd"}, tmp_path, {})

    assert np.array_equal(np.isnan(found.labels.stored), LABELS > 1)
    assert found.voxels == {1: (LABELS > 0).sum(), 2: (LABELS > 1).sum()}


def test_labels_are_put_onto_a_grid_that_is_turned_and_larger(tmp_path: Path) -> None:
    found = read_segments({"source": of_slicer(tmp_path).name}, tmp_path, {})
    grid = {
        "shape_zyx": [7, 7, 6],
        "spacing_mm_zyx": [2.0, 0.25, 0.5],
        "origin_mm_xyz": [1.0, 4.5, 1.0],
        "direction": [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    }

    held = labels_on(found.labels, grid)

    wanted = np.zeros((7, 7, 6))
    wanted[1:6] = LABELS[:, ::-1].transpose(0, 2, 1)
    assert np.array_equal(held, wanted)


@pytest.mark.parametrize(("moved_mm", "reason"), [(0.1, "another grid"), (0.001, None)])
def test_labels_between_the_voxels_are_not_witnessed(moved_mm: float, reason: str | None, tmp_path: Path) -> None:
    found = read_segments({"source": of_slicer(tmp_path).name}, tmp_path, {})
    grid = {
        "shape_zyx": list(SHAPE_ZYX),
        "spacing_mm_zyx": [2.0, 0.5, 0.25],
        "origin_mm_xyz": [1.0 + moved_mm, 2.0, 3.0],
        "direction": np.eye(3).tolist(),
    }
    if reason is None:
        assert np.array_equal(labels_on(found.labels, grid), LABELS)
    else:
        with pytest.raises(CannotWitnessError, match=reason):
            labels_on(found.labels, grid)


def ring(centre: tuple[float, float], radius: float, z_mm: float, points: int = 24) -> np.ndarray:
    angles = np.linspace(0.0, 2.0 * np.pi, points, endpoint=False)
    x, y = centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles)
    return np.column_stack([x, y, np.full(points, z_mm)])


def of_contours(folder: Path) -> Path:
    """Write a tube with a hole, and a ball whose third plane is missing, between slices of 2 mm."""
    planes = (2.0, 4.0, 6.0, 8.0, 14.0)
    tube = [each for z in planes for each in (ring((6.1, 8.3), 4.2, z), ring((6.4, 8.1), 1.9, z))]
    return structure_set(folder / "rings.dcm", [tube, [ring((14.2, 7.7), 2.1 + 0.1 * z, z + 0.3) for z in planes]])


SCAN = Grid(
    shape_zyx=(9, 24, 40),
    spacing_mm_zyx=(2.0, 0.8, 0.5),
    origin_mm_xyz=(0.2, -1.0, 0.0),
    direction=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    extent_mm_zyx=(18.0, 19.2, 20.0),
)


def test_product_and_witness_fill_the_same_voxels_of_contours(tmp_path: Path) -> None:
    path = of_contours(tmp_path)

    filled = fitted_segments(path, SCAN, ScanFrame(), Silent())
    found = read_segments({"source": path.name}, tmp_path, SCAN.model_dump(mode="json"))

    certain = ~np.isnan(found.labels.stored)
    numbers = np.array([0, *(each.number for each in filled.segments)])
    assert certain.mean() > 0.97
    assert np.array_equal(numbers[filled.labels][certain], found.labels.stored[certain])
    for number, volume_ml in zip(numbers[1:].tolist(), filled.volumes_ml, strict=True):
        assert found.volume_ml(number) == pytest.approx(volume_ml, rel=found.off_share)


def test_contours_across_slices_are_named_as_not_witnessed(tmp_path: Path) -> None:
    structure_set(tmp_path / "rings.dcm", [[[(0, 0, 0), (4, 0, 2), (4, 4, 4)]]])

    with pytest.raises(CannotWitnessError, match="slices"):
        read_segments({"source": "rings.dcm"}, tmp_path, SCAN.model_dump(mode="json"))
