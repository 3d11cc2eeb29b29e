"""Segments on the grid of a scan: overlaps, other grids, contours, and what belongs to another scan."""

import numpy as np
import pytest
from scipy import ndimage
from segment_files import FRAME, seg, structure_set

from volprep.kernels import _native
from volprep.parts.segments.level_labels import coarse_labels
from volprep.parts.segments.looks import segments_of
from volprep.scan.segments.contours import plane_coverage
from volprep.scan.segments.fitted import fitted_segments
from volprep.scan.segments.onto_grid import onto_grid
from volprep.scan.segments.record import FoundSegment, FoundSegments, VoxelBox, found_segments, holding_segments
from volprep.scan.segments.smoothing import smoothed_labels
from volprep.scene.segments import SegmentsSettings
from volprep.truth.box import frequent_level
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.parts.segments.texels import flagged, label_texels, labels_of_texels
from volprep_formats.progress import Silent
from volprep_formats.segmentations.records import ScanFrame


def test_a_style_of_segments_without_a_voxel_names_no_function():
    boxes = (VoxelBox(start_zyx=(0, 0, 0), stop_zyx=(1, 1, 1)),)
    segment = FoundSegment(number=1, name="", code=None, colour=None, volume_ml=0.0)
    found = FoundSegments(segments=(segment,), members=((),), boxes=boxes, voxels=(1,), blocks="00", sha256="0" * 64)
    record, _ = segments_of(found, SegmentsSettings(source="s"), ["veil", "inside"], "scene")
    assert record.transfers == ("veil",)
    assert [each.transfer for each in record.segments] == ["veil"]


def test_names_of_segments_keep_letters_with_marks():
    texts = ("Wirbelsäule", "Leber (groß)", "Rückenmark – hinten", "肝臓")
    segments = tuple(
        FoundSegment(number=number, name=text, code=None, colour=None, volume_ml=0.0)
        for number, text in enumerate(texts, 1)
    )
    found = FoundSegments(segments=segments, members=((),), boxes=(None,), voxels=(1,), blocks="00", sha256="0" * 64)
    record, _ = segments_of(found, SegmentsSettings(source="s", names="free"), ["veil"], "scene")
    assert [each.name for each in record.segments] == ["wirbelsaule", "leber-gross", "ruckenmark-hinten", "segment-4"]
    assert [each.title for each in record.segments] == list(texts)


def test_free_names_of_segments_have_no_character_that_steers_a_terminal_or_turns_text():
    text = "Liver\x1b[31m\nvolprep:\tall is\u202e well\u2066\u200f\x9b2J\udcff\x00 "
    segment = FoundSegment(number=1, name=text, code=None, colour=None, volume_ml=0.0)
    found = FoundSegments(segments=(segment,), members=((),), boxes=(None,), voxels=(1,), blocks="00", sha256="0" * 64)
    record, _ = segments_of(found, SegmentsSettings(source="s", names="free"), ["veil"], "scene")
    assert [each.title for each in record.segments] == ["Liver[31m volprep: all is well2J"]
    assert record.segments[0].name.isascii()


def test_a_segment_around_another_one_holds_it(fit):
    planes = {1: PLANE, 2: PLANE * (np.arange(9) < 3), 3: PLANE * (np.arange(9) < 4), 5: PLANE}
    frames = [(number, (1, 2, z), plane) for number, plane in planes.items() for z in (3, 5)]
    frames.append((3, (1, 2, 7), planes[3]))
    found = found_segments(fit(lambda path: seg(path, frames, numbers=(1, 2, 3, 4, 5))), "0" * 64)
    # Segment 2 lies in 1, 3 and 5; 3 lies in none, as a third of it does not, and 1 and 5 are the same voxels.
    assert holding_segments(found) == (1, 3, 5)
    assert sum(found.voxels) == 5 * 8 * 9


def slow_coverage(src, shape, matrix, samples):
    """The label of most points of each voxel, the smallest of equals."""
    result = np.zeros(shape, np.uint16)
    offsets = (np.arange(samples) + 0.5) / samples - 0.5
    for z, y, x in np.ndindex(*shape):
        found = []
        for dz, dy, dx in np.ndindex(samples, samples, samples):
            place = matrix @ [x + offsets[dx], y + offsets[dy], z + offsets[dz], 1.0]
            i, j, k = np.floor(place + 0.5).astype(int)
            inside = 0 <= i < src.shape[2] and 0 <= j < src.shape[1] and 0 <= k < src.shape[0]
            found.append(src[k, j, i] if inside else 0)
        result[z, y, x] = np.argmax(np.bincount(found))
    return result


@pytest.mark.parametrize("samples", [1, 3])
def test_the_label_that_covers_most_of_a_voxel_is_what_its_slow_twin_finds(samples):
    rng = np.random.default_rng(8)
    src = rng.integers(0, 4, (3, 4, 5)).astype(np.uint16)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    matrix = np.hstack([turn * [0.7, 1.3, 0.9], rng.uniform(0, 2, (3, 1))])
    found = [np.zeros((4, 3, 5), np.uint16) for _ in range(2)]
    for threads, dst in enumerate(found, 1):
        _native.label_coverage(src, dst, matrix, samples, threads=threads)
    assert np.array_equal(found[0], slow_coverage(src, (4, 3, 5), matrix, samples))
    assert np.array_equal(*found)
    assert found[0].any()


def test_labels_on_turned_and_cropped_axes_are_copied_voxel_by_voxel():
    target = Grid.of((4, 5, 6), (2.0, 1.0, 0.5), (10.0, 20.0, 30.0))
    labels = np.random.default_rng(8).integers(1, 9, (4, 5, 6)).astype(np.uint16)
    # Axes x, y, z of the segmentation run along -y, z and x of the scan, without the first voxel along z.
    turned = np.transpose(labels, (2, 0, 1))[:, 1:, ::-1]
    direction = np.array([[0, 0, 1], [-1, 0, 0], [0, 1, 0]], float)
    origin = (10.0, 20.0 + 4 * 1.0, 30.0 + 2.0)
    grid = Grid.of(turned.shape, (0.5, 2.0, 1.0), origin, direction)
    found = onto_grid(np.ascontiguousarray(turned), grid, target)
    assert np.array_equal(found[1:], labels[1:])
    assert not found[0].any()


@pytest.mark.parametrize(
    ("rings", "area"),
    [
        ([[(0.5, 0.5), (3.5, 0.5), (3.5, 4.5), (0.5, 4.5)]], 12.0),
        ([[(0.3, 0.2), (3.1, 1.7), (1.2, 4.4)]], 5.205),
        ([[(0, 0), (6, 0), (6, 6), (0, 6)], [(2, 2), (4, 2), (4, 4), (2, 4)]], 32.0),
        ([[(0, 0), (6, 0), (6, 6), (0, 6), (0, 0), (2, 2), (2, 4), (4, 4), (4, 2), (2, 2)]], 32.0),
        ([[(-5, 1), (20, 1), (20, 2), (-5, 2)]], 8.0),
    ],
    ids=["square", "triangle", "hole", "keyhole", "beyond the picture"],
)
def test_contours_cover_their_area(rings, area):
    covered = plane_coverage([[np.array(ring, float) for ring in rings]], (7, 8))
    assert covered.sum() == pytest.approx(area, rel=0.01)
    assert covered.min() >= -1e-12
    assert covered.max() <= 1 + 1e-12


def test_a_pixel_that_is_half_covered_counts_by_its_area_not_by_its_centre():
    # The centres of the pixels of column 2 lie inside, but 40 % of them do.
    covered = plane_coverage([[np.array([(0.5, -0.5), (1.9, -0.5), (1.9, 2.5), (0.5, 2.5)])]], (3, 4))
    assert covered[1] == pytest.approx([0, 1, 0.4, 0])


def test_items_are_united_where_they_overlap_and_touch_and_keep_their_own_holes():
    def square(low, high):
        return np.array([(low, low), (high, low), (high, high), (low, high)], float)

    one, hole = square(0, 6), square(1, 3)
    two, beside = square(2, 8), np.array([(6, 0), (8, 0), (8, 2), (6, 2)], float)
    covered = plane_coverage([[one, hole], [two], [two[::-1]], [beside]], (10, 10))
    # The hole is filled where the second square lies in it.
    assert covered.sum() == pytest.approx(36 + 36 - 16 - 4 + 1 + 4)
    assert covered.max() == pytest.approx(1.0)


SCAN = Grid.of((5, 8, 9), (2.0, 0.5, 0.25), (1.0, 2.0, 3.0))


def ring_at(z, low=(1.25, 2.5), high=(2.5, 4.5)):
    (x0, y0), (x1, y1) = low, high
    return [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]


@pytest.fixture
def fit(tmp_path):
    def call(make, grid=SCAN, frame=FRAME, images=()):
        return fitted_segments(make(tmp_path / "s.dcm"), grid, ScanFrame(frame, frozenset(images)), Silent())

    return call


def test_contours_fill_the_slices_half_way_to_the_next_ones(fit):
    found = fit(lambda path: structure_set(path, [[ring_at(1.0), ring_at(5.0), ring_at(9.0)]]))
    filled = found.labels.any(axis=(1, 2)).tolist()
    # Planes 4 mm apart stand for 4 mm each: half of the slice beside each, all of the slice between them.
    assert filled == [True, True, True, True, True]
    assert found.volumes_ml[0] == pytest.approx(1.25 * 2.0 * 9.0 / 1000)
    # Three rows of six pixels, and two of which half is covered: their corners are covered by a quarter.
    assert found.labels[1].sum() == 3 * 6 + 2 * 4


def test_contours_of_another_slice_direction_are_voxelised_along_it(fit):
    turned = [(1.5, 2.5, 4.0), (1.5, 4.5, 4.0), (1.5, 4.5, 8.0), (1.5, 2.5, 8.0)]
    found = fit(lambda path: structure_set(path, [[turned]]))
    assert np.flatnonzero(found.labels.any(axis=(0, 1))).tolist() == [2]
    # Rows 1 and 5 are covered by one half, which is enough.
    assert found.labels.sum() == 2 * 5


PLANE = np.ones((8, 9), np.uint8)


@pytest.mark.parametrize(
    ("make", "frame", "code", "says"),
    [
        (lambda path: seg(path, [(1, (1, 2, 3), PLANE)]), "1.2.3", "VP1410", "another frame"),
        (lambda path: seg(path, [(1, (100, 2, 3), PLANE)]), FRAME, "VP1411", "96.75 mm apart"),
        (lambda path: seg(path, [(1, (1.1, 2, 3), PLANE)]), "", "VP1411", "no common frame"),
        (lambda path: seg(path, [(1, (-3, -5.5, z), PLANE) for z in (3, 5, 7, 9, 11)]), "", "VP1411", "x and y turned"),
        (lambda path: structure_set(path, [[[(0, 0, 3), (2, 0, 4), (2, 2, 5)]]]), FRAME, "VP1412", "turned by"),
        (lambda path: seg(path, [(1, (1, 2, z), PLANE * (z > 12)) for z in (11, 13)]), FRAME, "VP1411", "100.00% of"),
        (lambda path: structure_set(path, [[ring_at(500.0)], []]), FRAME, "VP1411", "mm apart"),
        (lambda path: structure_set(path, [[], []]), FRAME, "VP1400", "none of its structures has a closed contour"),
    ],
)
def test_segments_of_another_place_are_refused_with_numbers(fit, make, frame, code, says):
    with pytest.raises(VolprepError) as raised:
        fit(make, frame=frame)
    assert raised.value.code == code
    assert says in str(raised.value)


def test_contours_that_are_drawn_on_images_of_the_scan_lie_in_its_frame_whatever_they_state(fit):
    found = fit(lambda path: structure_set(path, [[ring_at(5.0)]], ["1.2.9"]), frame="1.2.3", images=["1.2.8", "1.2.9"])
    assert found.labels.any()
    assert "are drawn on its images" in found.remarks[0]
    with pytest.raises(VolprepError, match="another frame"):
        fit(lambda path: structure_set(path, [[ring_at(5.0)]], ["1.2.9"]), frame="1.2.3", images=["1.2.8"])


def test_what_lies_beyond_the_scan_is_told(fit):
    # Slices of the scan reach from 2 to 12 mm.
    found = fit(lambda path: structure_set(path, [[ring_at(11.0)], [ring_at(13.0), ring_at(15.0)]]))
    assert found.remarks[1:] == (
        "2 of 3 contours reach beyond the scan, by up to 3 mm; the part beyond it is left out",
    )
    found = fit(lambda path: seg(path, [(1, (1, 2, z), PLANE) for z in (9, 11, 13, 15)]))
    assert found.remarks == ("50.00% of the voxels of segments lie beyond the scan, up to 3 mm; they are left out",)
    assert len(fit(lambda path: structure_set(path, [[ring_at(11.0)]])).remarks) == 1
    assert fit(lambda path: seg(path, [(1, (1, 2, 11), PLANE)])).remarks == ()


@pytest.mark.parametrize("beside", [((101, 2.5), (102, 4.5)), ((1.25, 52), (2.5, 54)), ((-3, -4), (0, 1))])
def test_a_structure_beside_the_scan_is_empty(fit, beside):
    found = fit(lambda path: structure_set(path, [[ring_at(5.0)], [ring_at(5.0, *beside), ring_at(7.0, *beside)]]))
    assert found.labels.max() == 1
    assert found.volumes_ml == (pytest.approx(1.25 * 2.0 * 2.0 / 1000), 0.0)


def test_the_flag_tells_cells_with_several_labels():
    labels = np.random.default_rng(8).choice([3, 3, 3, 3, 3, 200], (4, 5, 6)).astype(np.uint16)
    padded = np.pad(labels, [(0, 1)] * 3, "edge")
    cells = [padded[dz : dz + 4, dy : dy + 5, dx : dx + 6] for dz, dy, dx in np.ndindex(2, 2, 2)]
    several = np.ptp(np.stack(cells), axis=0) > 0
    in_slabs = np.concatenate([flagged(labels[:3], labels[3]), flagged(labels[3:], None)])
    assert np.array_equal(in_slabs, several)
    assert 0 < several.sum() < several.size
    texels = label_texels(labels, several, wide=True)
    assert np.array_equal(labels_of_texels(texels), labels)
    assert np.array_equal(texels[..., 1] >= 128, several)


def test_a_coarse_label_is_the_most_frequent_one_where_none_vanishes():
    regions = np.indices((9, 12, 15)).sum(axis=0) // 9
    rng = np.random.default_rng(8)
    labels = np.where(rng.random(regions.shape) < 0.3, rng.integers(0, 4, regions.shape), regions).astype(np.uint16)
    for found in (coarse_labels(labels, (2, 2, 4)), frequent_level(labels, (2, 2, 4))):
        for z, y, x in np.ndindex(5, 6, 4):
            own = labels[2 * z : 2 * z + 2, 2 * y : 2 * y + 2, 4 * x : 4 * x + 4]
            assert found[z, y, x] == np.argmax(np.bincount(own.ravel()))


@pytest.mark.parametrize("factor", [2, 4])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_thin_structure_keeps_its_volume_in_coarse_labels(factor, axis):
    shape, place = [24, 23, 22], [5, 13, 9]
    shape[axis] = 320
    labels = np.zeros(shape, np.uint16)
    labels[tuple(slice(None) if each == axis else place[each] for each in range(3))] = 1
    kept = (coarse_labels(labels, (factor,) * 3) == 1).sum() * factor**3 / labels.sum()
    # Votes grow in steps, which win a few blocks at once: 0.6 to 1.4 of the volume where 5 or 40 voxels are wanted.
    assert 0.5 <= kept <= 1.5
    assert not frequent_level(labels, (factor,) * 3).any()


def test_a_label_of_less_than_half_a_coarse_voxel_takes_no_block():
    labels = np.ones((8, 8, 8), np.uint16)
    labels[3, 3, 3] = 2
    assert (coarse_labels(labels, (4, 4, 4)) == 1).all()


def test_labels_that_share_every_block_have_some_blocks_each():
    labels = np.broadcast_to(np.arange(3, dtype=np.uint16)[:, None, None], (3, 6, 6)).copy()
    found = coarse_labels(labels, (3, 3, 3))
    assert found.shape == (1, 2, 2)
    assert set(found.ravel()) == {0, 1, 2}


@pytest.mark.parametrize("smoothing_mm", [1.5, 2.5])
def test_smoothed_labels_have_the_greatest_filtered_mask_as_scipy_finds_it(smoothing_mm):
    labels = np.kron(np.random.default_rng(8).integers(0, 4, (4, 3, 5)), np.ones((3, 4, 2))).astype(np.uint16)
    spacing_mm_zyx = (2.0, 1.0, 0.8)
    deviations = [smoothing_mm / spacing_mm for spacing_mm in spacing_mm_zyx]
    reach = [int(np.ceil(3 * each - 1e-9)) for each in deviations]
    masks = [(labels == label).astype(float) for label in range(4)]
    shares = np.array([ndimage.gaussian_filter(mask, deviations, mode="nearest", radius=reach) for mask in masks])
    found = smoothed_labels(labels, spacing_mm_zyx, smoothing_mm)
    ahead = np.sort(shares, axis=0)
    is_clear = ahead[-1] - ahead[-2] > 1e-12
    assert is_clear.mean() > 0.8
    assert np.array_equal(found[is_clear], shares.argmax(axis=0)[is_clear])
    assert (found != labels).any()


def test_smoothing_slab_by_slab_is_smoothing_at_once(monkeypatch):
    labels = np.kron(np.random.default_rng(8).integers(0, 3, (8, 2, 2)), np.ones((3, 4, 4))).astype(np.uint16)
    whole = smoothed_labels(labels, (1.0, 1.0, 1.0), 1.0)
    monkeypatch.setattr("volprep.scan.segments.smoothing.slab_ranges", lambda depth, *_, **__: ((0, 7), (7, depth)))
    assert np.array_equal(smoothed_labels(labels, (1.0, 1.0, 1.0), 1.0), whole)


def test_a_flat_border_stays_where_it_is_and_flips_with_the_volume():
    labels = np.zeros((6, 7, 9), np.uint16)
    labels[:, 3:] = 5
    assert np.array_equal(smoothed_labels(labels, (1.5, 1.0, 1.0), 1.2), labels)
    ragged = np.random.default_rng(8).integers(0, 2, (6, 7, 9)).astype(np.uint16)
    turned = smoothed_labels(np.ascontiguousarray(ragged[::-1, :, ::-1]), (1.0, 1.0, 1.0), 1.0)
    assert np.array_equal(turned[::-1, :, ::-1], smoothed_labels(ragged, (1.0, 1.0, 1.0), 1.0))
