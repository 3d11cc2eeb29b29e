"""Light of labels: what each gives alone, what coarse labels keep of it, and what a verdict says of a lost segment."""

import numpy as np
import pytest

from volprep.parts.segments.level_labels import LevelLight, coarse_labels
from volprep.parts.segments.level_light import level_kept
from volprep.truth.box import box_levels
from volprep.truth.kept_parts import LabelledField, kept_parts, label_boxes
from volprep.truth.labelled_light import light_of_labels
from volprep.validation.results.seen import KeptStyle, OtherDrawing, OtherView
from volprep.validation.subjects.labelled import kept_styles
from volprep_formats.package.parts.segments.record import Segment, SegmentLabel, Segments
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint

RNG = np.random.default_rng(27)


def ramp(name: str, largest_per_mm: float) -> TransferFunction:
    ends = ((0.0, 0.0), (100.0, largest_per_mm))
    points = tuple(TransferPoint(value=v, colour=(1.0, 1.0, 1.0), extinction_per_mm=e) for v, e in ends)
    return TransferFunction(name=name, points=points)


def test_the_light_of_a_label_is_the_extinction_of_its_voxels() -> None:
    stored, labels = RNG.integers(0, 200, (5, 4, 7)), RNG.integers(0, 3, (5, 4, 7)).astype(np.uint16)
    functions = [ramp("veil", 0.2), ramp("inside", 3.0), ramp("inside", 3.0)]
    expected = np.zeros(4)
    for value, label in zip(stored.ravel(), labels.ravel(), strict=True):
        expected[label] += 1.5 * (0.2, 3.0, 3.0)[label] * min(0.5 * value + 3.0, 100.0) / 100.0
    found = light_of_labels(stored, 0.5, 3.0, labels, [*functions, functions[1]], 1.5)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("factor", [2, 3])
def test_a_thin_bright_label_keeps_half_of_its_light_in_coarse_labels(factor) -> None:
    labels = np.zeros((240, 12, 12), np.uint16)
    labels[:, 4, 7] = 1
    values = np.where(labels == 1, 200, 90).astype(np.uint8)
    extinctions = np.stack([np.full(256, 0.01), np.maximum(np.arange(256) - 60.0, 0.0) / 256])
    codes = np.rint(next(box_levels(values, [(factor,) * 3]))).astype(np.uint8)
    wanted = np.bincount(labels.ravel(), extinctions[labels, values].ravel()) / factor**3
    light = LevelLight(wanted, extinctions, np.arange(2), codes)

    def kept(found: np.ndarray) -> float:
        return float(extinctions[1, codes[found == 1]].sum() / wanted[1])

    assert kept(coarse_labels(labels, (factor,) * 3)) < 0.5
    assert 0.5 <= kept(coarse_labels(labels, (factor,) * 3, light)) < 0.7


def test_a_label_that_can_keep_no_light_does_not_grow() -> None:
    labels = np.zeros((240, 12, 12), np.uint16)
    labels[:, 4, 7] = 1
    codes = np.zeros((120, 6, 6), np.uint8)
    light = LevelLight(np.array([1.0, 60.0]), np.stack([np.ones(256), np.arange(256.0)]), np.arange(2), codes)
    np.testing.assert_array_equal(coarse_labels(labels, (2, 2, 2), light), coarse_labels(labels, (2, 2, 2)))


def segments() -> Segments:
    def segment(name: str, transfer: str, *, visible: bool = True) -> Segment:
        return Segment(name=name, number=1, transfer=transfer, visible=visible, volume_ml=1.0)

    return Segments(
        transfers=("veil", "inside"),
        segments=(segment("liver", "inside"), segment("vein", "inside"), segment("skin", "inside", visible=False)),
        labels=(
            SegmentLabel(transfer="veil"),
            SegmentLabel(segments=("liver",), transfer="inside"),
            SegmentLabel(segments=("vein",), transfer="inside"),
            SegmentLabel(segments=("liver", "vein"), transfer="inside"),
            SegmentLabel(segments=("skin",), transfer="inside"),
        ),
        sha256="0" * 64,
    )


def test_styles_name_the_visible_segment_that_keeps_the_least() -> None:
    scan, level = np.array([5.0, 80.0, 4.0, 4.0, 9.0]), np.array([4.0, 84.0, 0.0, 2.0, 0.0])

    def kept(sizes: float | np.ndarray) -> tuple[KeptStyle, ...]:
        return kept_styles(segments(), scan, level, sizes * np.ones(5), 0.5, lambda *_: np.array([1.0, 0.2, 0.1]))

    veil, inside = kept(1.0)
    assert (veil.transfer, veil.least, veil.kept_light, veil.lost, veil.segments) == ("veil", None, 0.8, (), 0)
    # All of it together has nearly all its light.
    assert inside.kept_light == pytest.approx(86 / 88)
    assert (inside.least, inside.least_kept_light, inside.lost) == ("vein", 0.25, ("vein",))
    assert (inside.segments, inside.too_small, inside.lost_parts) == (2, (), ("liver (2 of 3 parts)",))
    (_, tiny) = kept(0.2)
    assert (tiny.least, tiny.lost, tiny.too_small) == ("vein", (), ("vein",))


def test_an_organ_does_not_hide_a_lost_node_of_the_same_segment() -> None:
    labels = np.zeros((24, 20, 16), np.uint16)
    labels[2:14, 2:14, 2:14], labels[18:22, 16:19, 12:15], labels[8:12, 16:20, 4:8] = 1, 1, 2
    coarse = labels[1::4, 1::4, 1::4].copy()
    coarse[4:] = 0
    values = np.full(labels.shape, 50.0)
    fields = [
        LabelledField(stored[: len(which)], 1.0, 0.0, which, voxel_mm3)
        for stored, which, voxel_mm3 in ((values, labels, 1.0), (values[::4, ::4, ::4], coarse, 64.0))
    ]
    boxes = label_boxes(labels)
    organ, node = kept_parts(*fields, [1], boxes[1], ramp("inside", 1.0))
    assert organ == pytest.approx(1.0)
    assert node == 0.0
    assert len(kept_parts(*fields, [2], boxes[2], ramp("inside", 1.0))) == 0


def test_a_build_says_how_many_segments_keep_less_than_half() -> None:
    labels = np.array([[[0, 1, 1, 1, 2]]], np.uint16)
    # Each voxel of the level gives one; the label of two segments and the hidden one have vanished.
    light = LevelLight(
        np.array([1.0, 3.0, 4.0, 4.0, 9.0]), np.ones((2, 1)), np.array([0, 1, 1, 1, 1]), np.zeros(5, int)
    )
    found = level_kept(segments(), 2, light, labels, np.ones(5, np.bool_))
    assert (found.least, found.share, found.lost, found.segments) == ("vein", 0.125, 2, 2)
    found = level_kept(segments(), 2, light, labels, np.array([True, True, False, False, True]))
    assert (found.least, found.share, found.lost, found.segments) == ("liver", 1.0, 0, 1)


def test_a_level_that_loses_a_segment_is_beyond_whatever_box_means_are() -> None:
    views = (OtherView.model_construct(view="left", passed=True),)
    style = KeptStyle(transfer="inside", kept_light=0.9, segments=2, least="vein", least_kept_light=0.1)
    whole = OtherDrawing.model_construct(
        item="level 1", program="p", level=1, excused=True, pixels=8, views=views, styles=(style,)
    )
    lost = whole.model_copy(update={"styles": (style.model_copy(update={"lost": ("vein",)}),)})
    assert (whole.passed, whole.loses_segments) == (True, False)
    assert (lost.passed, lost.loses_segments) == (False, True)
