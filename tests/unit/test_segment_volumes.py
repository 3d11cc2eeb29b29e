"""Volumes of segments in millilitres: structure sets and segmentations that are written in odd ways."""

import resource
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from time import process_time

import numpy as np
import pydicom
import pytest
from pydicom.dataset import Dataset
from segment_files import FRAME, item, seg, structure_set

from volprep.scan.segments.fitted import Fitted, _of_contours, fitted_segments
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.progress import Silent
from volprep_formats.segmentations.overlaps import Overlaps
from volprep_formats.segmentations.records import ScanFrame
from volprep_formats.segmentations.rtstruct import read_rtstruct

SCAN = Grid.of((40, 16, 16), (2.0, 0.5, 0.25), (0.0, 0.0, 0.0))
ONE_ML = 1.0 * 3.0 * 2.0 / 1000
"""Volume of the square of `ring` in one slice."""


def ring(z: float, x: float = 1.0) -> list[tuple[float, float, float]]:
    return [(x, 2.0, z), (x + 1.0, 2.0, z), (x + 1.0, 5.0, z), (x, 5.0, z)]


def fit(path: Path, frame: str = FRAME, images: tuple[str, ...] = (), grid: Grid = SCAN) -> Fitted:
    return fitted_segments(path, grid, ScanFrame(frame, frozenset(images)), Silent())


def structures(path: Path, rings: list, edit: Callable[[Dataset], None] = lambda _: None, images: tuple = ()) -> Path:
    structure_set(path, rings, images)
    data = pydicom.dcmread(path)
    edit(data)
    data.save_as(path)
    return path


def refusal(path: Path, **told: object) -> VolprepError:
    with pytest.raises(VolprepError) as raised:
        fit(path, **told)
    return raised.value


def in_two_items(data: Dataset) -> None:
    (one,) = data.ROIContourSequence
    data.ROIContourSequence.append(item(ReferencedROINumber=1, ContourSequence=list(one.ContourSequence[:1])))
    del one.ContourSequence[0]


def offset(data: Dataset) -> None:
    for contour in data.ROIContourSequence[0].ContourSequence:
        contour.ContourOffsetVector = ["0", "0", "-100"]


@pytest.mark.parametrize(
    ("rings", "edit", "slices"),
    [
        ([ring(z) for z in (10, 12, 14)], in_two_items, [5, 6, 7]),
        ([ring(10), ring(12), ring(12), ring(14)], None, [5, 6, 7]),
        ([ring(10), ring(12), [*ring(12)[1:], ring(12)[0]], ring(12)[::-1]], None, [5, 6]),
        ([ring(10), ring(18)], None, [5, 9]),
        ([ring(z) for z in (10, 12, 14, 16, 60)], None, [5, 6, 7, 8, 30]),
        ([ring(10), ring(60)], None, [5, 30]),
        ([ring(z) for z in (10, 14, 18)], None, [4, 5, 6, 7, 8, 9, 10]),
        ([ring(z + 100) for z in (10, 12, 14)], offset, [5, 6, 7]),
    ],
    ids=["two items", "twice", "turned", "two planes", "stray", "two far", "every other slice", "offset"],
)
def test_contours_have_the_volume_of_their_planes(tmp_path, rings, edit, slices):
    found = fit(structures(tmp_path / "s.dcm", [rings], edit or (lambda _: None)))
    filled = np.flatnonzero((found.labels == 1).any(axis=(1, 2))).tolist()
    assert filled == slices
    # Planes on every other slice cover half of the slices beside the first and the last one.
    expected = len(slices) if len(slices) < 7 else 6
    assert found.volumes_ml == pytest.approx([expected * ONE_ML])


def test_a_structure_of_two_planes_has_the_thickness_of_the_others(tmp_path):
    thick = [ring(z) for z in (10, 14, 18, 22)]
    found = fit(structures(tmp_path / "s.dcm", [thick, [ring(30, 2.5), ring(34, 2.5)]]))
    assert found.volumes_ml == pytest.approx([8 * ONE_ML, 4 * ONE_ML])
    assert found.remarks == ("contours reach half-way to the next plane, and 2 mm beyond the first and the last one",)


def test_gaps_that_are_not_filled_are_told(tmp_path):
    found = fit(structures(tmp_path / "s.dcm", [[ring(10)], [ring(10), ring(18)]]))
    assert "1 mm beyond the first and the last one, and gaps that are not filled: segments 2" in found.remarks[0]


def renumbered(*numbers: int) -> Callable[[Dataset], None]:
    def edit(data: Dataset) -> None:
        for own, number in zip(data.StructureSetROISequence, numbers, strict=True):
            own.ROINumber = number

    return edit


@pytest.mark.parametrize(
    ("numbers", "says"), [((1, 1), "two structures have the number 1"), ((1, -3), "a structure has number -3")]
)
def test_structures_whose_numbers_name_none_are_refused(tmp_path, numbers, says):
    error = refusal(structures(tmp_path / "s.dcm", [[ring(10)], [ring(20)]], renumbered(*numbers)))
    assert error.code == "VP1400"
    assert says in str(error)


@pytest.mark.filterwarnings("ignore:The value for the data element")
def test_a_contour_of_more_than_64_kilobytes_is_read_in_explicit_vr(tmp_path):
    angles = np.linspace(0, 2 * np.pi, 5000, endpoint=False)
    circle = np.stack([2 + np.cos(angles), 4 + np.sin(angles), np.full(5000, 10.0)], axis=1)
    path = structures(tmp_path / "s.dcm", [[circle]])
    assert pydicom.dcmread(path).ROIContourSequence[0].ContourSequence[0].get_item("ContourData").VR == "UN"
    assert fit(path).volumes_ml == pytest.approx([np.pi * 2.0 / 1000], rel=5e-3)


def listing(*images: str, frame: str) -> Callable[[Dataset], None]:
    def edit(data: Dataset) -> None:
        series = item(ContourImageSequence=[item(ReferencedSOPInstanceUID=uid) for uid in images])
        study = item(RTReferencedSeriesSequence=[series])
        data.ReferencedFrameOfReferenceSequence = [item(FrameOfReferenceUID=frame, RTReferencedStudySequence=[study])]

    return edit


@pytest.mark.parametrize(
    ("edit", "drawn", "fits"),
    [
        (listing("1.2.9", frame=FRAME), (), True),
        (listing("1.2.9", frame="1.2.3"), (), False),
        (listing("1.2.9", frame=FRAME), ("1.2.77",), False),
        (listing("1.2.9", frame=FRAME), ("1.2.9", "1.2.77"), False),
        (listing("1.2.9", frame="1.2.3"), ("1.2.9",), True),
    ],
)
def test_contours_of_another_frame_fit_only_if_all_of_them_are_drawn_on_the_scan(tmp_path, edit, drawn, fits):
    path = structures(tmp_path / "s.dcm", [[ring(10)]], edit, drawn)
    if fits:
        found = fit(path, frame="1.2.3", images=("1.2.8", "1.2.9"))
        assert "are drawn on its images" in found.remarks[0]
    else:
        assert refusal(path, frame="1.2.3", images=("1.2.8", "1.2.9")).code == "VP1410"


PLANE = np.ones((16, 16), np.uint8)
PLANE_ML = 16 * 16 * 0.5 * 0.25 * 2.0 / 1000


def images_of(*uids: str) -> dict[str, object]:
    return {"SourceImageSequence": [item(ReferencedSOPInstanceUID=uid) for uid in uids]}


@pytest.mark.parametrize(
    ("z", "stated_mm", "named", "slices"),
    [
        ([10], 6.0, {}, 1),
        ([10, 16, 22], 6.0, {}, 3),
        ([10, 12, 16], 1.0, {}, 3),
        ([10, 16, 22], 6.0, images_of("1.2.8"), 3),
        ([10, 16, 22], 6.0, images_of("1.2.77"), 9),
    ],
)
def test_the_distance_of_the_scan_comes_before_a_stated_one(tmp_path, z, stated_mm, named, slices):
    frames = [(1, (0, 0, each), PLANE) for each in z]
    path = seg(tmp_path / "s.dcm", frames, pitch_mm=stated_mm, numbers=(1,), **named)
    found = fit(path, images=("1.2.8",))
    assert found.volumes_ml == pytest.approx([slices * PLANE_ML])
    assert any("SpacingBetweenSlices" in remark for remark in found.remarks) == (slices == 3 or len(z) == 1)


def test_two_frames_of_a_label_map_at_one_place_are_refused(tmp_path):
    frames = [(1, (0, 0, z), PLANE * label) for z, label in ((10, 1), (12, 1), (10, 2))]
    error = refusal(seg(tmp_path / "s.dcm", frames, kind="LABELMAP"))
    assert error.code == "VP1405"
    assert "frames 1 and 3" in str(error)


def peak_bytes(call: Callable[[], object]) -> int:
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


LARGE = Grid.of((64, 256, 256), (2.0, 0.5, 0.5), (0.0, 0.0, 0.0))
LABEL_BYTES = 2 * 64 * 256 * 256


def test_zigzags_of_a_small_file_take_no_more_memory_than_the_labels_of_the_scan(tmp_path):
    x = np.linspace(1, 120, 1000)
    zigzag = np.stack([x, np.where(np.arange(1000) % 2, 1.0, 120.0), np.full(1000, 10.0)], axis=1).round(2)
    path = structures(tmp_path / "s.dcm", [[zigzag]])
    assert peak_bytes(lambda: fit(path, grid=LARGE)) < 3 * LABEL_BYTES


def test_a_contour_off_all_slices_is_refused_in_the_memory_of_its_points(tmp_path):
    rng = np.random.default_rng(3)
    path = structures(tmp_path / "s.dcm", [[rng.uniform(1, 100, (4000, 3)).round(1)]])
    assert peak_bytes(lambda: refusal(path, grid=LARGE)) < LABEL_BYTES
    assert refusal(path, grid=LARGE).code == "VP1412"


def test_contours_that_take_too_long_are_refused_before_they_are_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr("volprep.scan.segments.fitted._MOST_STEPS", 1000)
    assert refusal(structures(tmp_path / "s.dcm", [[ring(10)]])).code == "VP3291"


def test_time_grows_with_the_area_of_contours_not_with_that_of_slices(tmp_path):
    grid = Grid.of((20, 400, 400), (2.0, 1.0, 1.0), (0.0, 0.0, 0.0))

    def seconds(side: float) -> float:
        square = [(2.0, 2.0), (side, 2.0), (side, side), (2.0, side)]
        rings = [[[(*point, 2.0 * z) for point in square] for z in range(20)]] * 4
        contours = read_rtstruct(structure_set(tmp_path / "s.dcm", rings))
        start = process_time()
        _of_contours(tmp_path, contours, grid)
        return process_time() - start

    assert seconds(60.0) < 0.4 * seconds(390.0)


def test_slices_to_which_nothing_is_added_take_no_memory():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    overlaps = Overlaps(Path("x"), (2000, 400, 400), 2)
    for segment in (1, 2):
        overlaps.add(1999, np.full((400, 400), segment, np.uint16))
    assert overlaps.combined()[0][-1].all()
    # The labels have 640 MB, and ru_maxrss is in KB.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000


def test_overlaps_get_labels_of_their_own_that_know_their_segments():
    overlaps = Overlaps(Path("x"), (1, 1, 4), 3)
    overlaps.add(0, np.array([[1, 1, 0, 3]], np.uint16))
    overlaps.add(0, np.array([[0, 2, 2, 0]], np.uint16))
    labels, members = overlaps.combined()
    assert members == ((), (0,), (1,), (2,), (0, 1))
    assert labels.ravel().tolist() == [1, 4, 2, 3]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_combined_segments_are_what_their_slow_twin_says_also_when_labels_run_out(monkeypatch, axis):
    monkeypatch.setattr("volprep_formats.segmentations.overlaps._MOST_NUMBERS", 100)
    rng = np.random.default_rng(3)
    masks = rng.random((20, 3, 4, 5)) < 0.2
    overlaps = Overlaps(Path("x"), (3, 4, 5), len(masks))
    for segment, mask in enumerate(masks):
        for place, plane in enumerate(np.moveaxis(mask, axis, 0)):
            overlaps.add(place, plane * np.uint16(segment + 1), axis)
    labels, members = overlaps.combined()
    for place in np.ndindex(3, 4, 5):
        assert members[labels[place]] == tuple(np.flatnonzero(masks[:, *place]).tolist())
    assert list(members) == sorted(set(members), key=lambda each: (len(each), each))


def test_more_than_64_segments_in_one_voxel_are_refused():
    overlaps = Overlaps(Path("x"), (1, 2, 2), 65)
    for segment in range(64):
        overlaps.add(0, np.full((2, 2), segment + 1, np.uint16))
    with pytest.raises(VolprepError, match="VP3290"):
        overlaps.add(0, np.full((2, 2), 65, np.uint16))
