"""Segments and colours that leave a package, read back by our readers, nibabel and pynrrd."""

from pathlib import Path

import nibabel
import nrrd
import numpy as np
import pytest
from colour_scene import ball, write_colour_scene
from command_line import volprep
from every_kind import write_segments
from scene_builds import built

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.label_tables.nifti import table_text
from volprep_formats.label_tables.parse import parse_table
from volprep_formats.package.parts.segments.record import SegmentCode
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.segmentations.dicom_seg import read_dicom_seg
from volprep_formats.segmentations.records import LabelVolume
from volprep_formats.segmentations.seg_nrrd import read_seg_nrrd
from volprep_formats.source import SourceInfo, SourceSpec
from volprep_formats.writers import dicom, dicom_seg, seg_nrrd
from volprep_formats.writers.label_image import LabelImage, WrittenLabel, WrittenSegment, layers

DIRECTION = ((0.0, 0.6, -0.8), (1.0, 0.0, 0.0), (0.0, -0.8, -0.6))
GRID = Grid.of((5, 6, 7), (2.5, 0.7, 0.3), (-11.5, 33.25, 7.0), DIRECTION)
VALUES = np.random.default_rng(5).integers(0, 4, GRID.shape_zyx).astype(np.uint16)
LIVER = SegmentCode(scheme="SCT", value="10200004", meaning="Liver")
IMAGE = LabelImage(
    "segments",
    (),
    [
        WrittenLabel(1, "a", (255, 0, 0, 255), (0,)),
        WrittenLabel(2, "b", (0, 64, 255, 255), (1,)),
        WrittenLabel(3, "a + b", (128, 32, 128, 255), (0, 1)),
    ],
    [WrittenSegment("left; a", (255, 0, 0), LIVER), WrittenSegment("b", (0, 64, 255))],
)


class Array:
    """Voxels in memory as a source."""

    def __init__(self, values: np.ndarray, grid: Grid = GRID) -> None:
        self._values = values
        self.info = SourceInfo(format="volpkg", grid=grid, stored_type=str(values.dtype))

    def read_slab(self, z0: int, z1: int) -> np.ndarray:
        return self._values[z0:z1]


def masks(volume: LabelVolume) -> list[np.ndarray]:
    return [
        np.isin(volume.labels, [label for label, members in enumerate(volume.members) if index in members])
        for index in range(len(volume.segments))
    ]


def check(volume: LabelVolume) -> None:
    np.testing.assert_array_equal(masks(volume), [np.isin(VALUES, [1, 3]), np.isin(VALUES, [2, 3])])
    np.testing.assert_allclose(volume.grid.world_from_index, GRID.world_from_index, rtol=0, atol=1e-6)
    assert volume.segments[0].code is not None
    assert volume.segments[0].code.meaning == "Liver"
    colours = [segment.colour for segment in volume.segments]
    np.testing.assert_allclose(colours, [(1, 0, 0), (0, 64 / 255, 1)], rtol=0, atol=1 / 255)


def test_segments_that_overlap_lie_in_different_layers_of_a_seg_nrrd(tmp_path: Path) -> None:
    seg_nrrd.write(IMAGE, Array(VALUES), tmp_path / "a.seg.nrrd", Silent())
    assert layers(IMAGE) == [[0], [1]]
    check(read_seg_nrrd(tmp_path / "a.seg.nrrd", None))
    data, header = nrrd.read(str(tmp_path / "a.seg.nrrd"))
    assert data.shape == (2, 7, 6, 5)
    assert header["Segment0_Name"] == "left; a"


def test_a_dicom_segmentation_is_of_its_series_and_has_the_same_bytes_again(tmp_path: Path) -> None:
    pytest.importorskip("highdicom", reason="highdicom is not installed")
    dicom.write(Array(np.ones(GRID.shape_zyx, np.int16)), tmp_path / "series", Silent())
    for name in "ab":
        dicom_seg.write(IMAGE, Array(VALUES), tmp_path / f"{name}.dcm", Silent(), series=tmp_path / "series")
    assert (tmp_path / "a.dcm").read_bytes() == (tmp_path / "b.dcm").read_bytes()
    check(read_dicom_seg(tmp_path / "a.dcm"))
    part = Grid.of((2, 3, 4), GRID.spacing_mm_zyx, (GRID.world_from_index @ [2, 1, 3, 1])[:3], DIRECTION)
    dicom_seg.write(IMAGE, Array(VALUES[3:, 1:4, 2:6], part), tmp_path / "c.dcm", Silent(), series=tmp_path / "series")
    np.testing.assert_array_equal(masks(read_dicom_seg(tmp_path / "c.dcm"))[1].sum(), (VALUES[3:, 1:4, 2:6] > 1).sum())


@pytest.mark.parametrize("moved", [(0.15, 0.0, 0.0), (0.0, 0.0, 1.0)])
def test_segments_of_other_voxels_than_the_series_has_are_refused(tmp_path: Path, moved: tuple[float, ...]) -> None:
    pytest.importorskip("highdicom", reason="highdicom is not installed")
    dicom.write(Array(np.ones(GRID.shape_zyx, np.int16)), tmp_path / "series", Silent())
    other = Grid.of(GRID.shape_zyx, GRID.spacing_mm_zyx, np.array(GRID.origin_mm_xyz) + moved, DIRECTION)
    with pytest.raises(VolprepError) as error:
        dicom_seg.write(IMAGE, Array(VALUES, other), tmp_path / "a.dcm", Silent(), series=tmp_path / "series")
    assert error.value.code == "VP1332"
    with pytest.raises(VolprepError) as error:
        dicom_seg.write(IMAGE, Array(VALUES), tmp_path / "a.dcm", Silent(), series=tmp_path)
    assert error.value.code == "VP1331"


@pytest.fixture(scope="module")
def segmented(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("segmented")
    return built(write_segments(folder), folder / "p.volpkg").path


def test_a_seg_nrrd_of_a_package_has_its_segments_and_not_its_values(segmented: Path, tmp_path: Path) -> None:
    done = volprep("export", segmented, tmp_path / "a.seg.nrrd")
    assert done.returncode == 0, done.stderr
    expected = nibabel.load(segmented.parent / "labels.nii").get_fdata().T
    found = masks(read_seg_nrrd(tmp_path / "a.seg.nrrd", None))
    np.testing.assert_array_equal(found, [expected == 1, expected == 2])


def test_labels_as_nifti_have_their_table_and_the_intent_of_labels(segmented: Path, tmp_path: Path) -> None:
    done = volprep("export", segmented, tmp_path / "a.nii.gz", "--labels")
    assert done.returncode == 0, done.stderr
    image = nibabel.load(tmp_path / "a.nii.gz")
    source = nibabel.load(segmented.parent / "labels.nii")
    np.testing.assert_array_equal(np.asarray(image.dataobj), np.asarray(source.dataobj))
    np.testing.assert_allclose(image.affine, source.affine, rtol=0, atol=1e-6)
    assert image.header["intent_code"] == 1002
    entries = parse_table(table_text(tmp_path / "a.nii.gz"))
    assert [(each.number, each.name, each.colour) for each in entries] == [
        (1, "segment-1", "#fa3e1f"),
        (2, "segment-2", "#1fbcfa"),
    ]


def test_a_package_without_segments_has_none_to_write(tmp_path: Path, tmp_path_factory) -> None:
    made = built(write_colour_scene(tmp_path)).path
    done = volprep("export", made, tmp_path / "a.seg.nrrd")
    assert "VP1330" in done.stderr
    for wrong in (["a.nrrd", "--labels"], ["a.dcm"]):
        assert "VP1252" in volprep("export", made, tmp_path / wrong[0], *wrong[1:]).stderr


def test_colours_leave_as_srgb_bytes(tmp_path: Path) -> None:
    zarr = pytest.importorskip("zarr", reason="zarr is not installed")
    made = built(write_colour_scene(tmp_path)).path
    pixels = ball()
    seen = pixels[..., 3] > 128
    for name in ("a.nii.gz", "a.ome.zarr"):
        done = volprep("export", made, tmp_path / name)
        assert done.returncode == 0, done.stderr
    voxels = np.asarray(nibabel.load(tmp_path / "a.nii.gz").dataobj).T
    rgb = np.stack([voxels[part] for part in "RGB"], axis=-1).astype(int)
    assert np.abs(rgb - pixels[..., :3])[seen].max() <= 1
    group = zarr.open_group(tmp_path / "a.ome.zarr", mode="r")
    written = np.moveaxis(group["0"][...], 0, -1).astype(int)
    assert np.abs(written - pixels)[seen].max() <= 1
    channels = group.attrs["ome"]["omero"]["channels"]
    assert [each["active"] for each in channels] == [True, True, True, False]
    assert {(each["window"]["start"], each["window"]["end"]) for each in channels} == {(0.0, 255.0)}
    spec = SourceSpec(path=str(tmp_path / "a.ome.zarr"), channel="green")
    with open_source(spec, tmp_path, Silent()) as source:
        np.testing.assert_array_equal(source.read_slab(0, len(written)), written[..., 1])
