"""DICOM segmentations: binary, fractional and label map; many segments in one file, frames in any order or missing.

Source: DICOM PS3.3, A.51 (Segmentation), C.8.20 (Segmentation Image, Segmentation Fractional and Label Map), C.7.6.16
(multi-frame functional groups), PS3.5, 8.1.1 (pixels of one bit). Geometry comes from the functional groups of each
frame alone. A fraction counts as inside from one half of the largest value on.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import LONGEST_AXIS, Grid
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.segmentations.cielab import srgb_of_cielab
from volprep_formats.segmentations.dicom_file import Item, code_of, first_item, images_in, parsed
from volprep_formats.segmentations.overlaps import Overlaps, check_size
from volprep_formats.segmentations.records import MOST_SEGMENTS, LabelVolume, ScanFrame, SourceSegment

SOP_CLASSES = frozenset(("1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7"))
"""Segmentation Storage, and Label Map Segmentation Storage."""
_RLE = "1.2.840.10008.1.2.5"
_MOST_FRAMES = 2**20
_SAME_COSINE = 1e-4
_OFF_PLACE = 0.02
"""How far a frame may lie from its even place, in distances of frames, and beside the others, in pixels."""


def read_dicom_seg(path: Path, scan: Grid | None = None, frame: ScanFrame | None = None) -> LabelVolume:
    """Read a segmentation of the scan with the grid `scan` and the images of `frame`.

    Raises VP1310, VP1400 to VP1405, VP1413, VP3290, VP2020 and VP2021.
    """
    with parsed(path) as data:
        segments = _segments(path, data)
        frames = _Frames(path, data, scan)
        is_of_other_images = frame is not None and _is_of_other_images(data, frame)
        grid, places, remarks = _grid(path, frames, scan, is_of_other_images=is_of_other_images)
        overlaps = Overlaps(path, grid.shape_zyx, len(segments), scan)
        more = _add_frames(overlaps, frames, places, segments)
        labels, members = overlaps.combined()
        return LabelVolume(
            segments=segments,
            grid=grid,
            labels=labels,
            members=members,
            frame_of_reference=str(data.get("FrameOfReferenceUID", "") or ""),
            remarks=(*remarks, *more),
        )


def _is_of_other_images(data: Item, frame: ScanFrame) -> bool:
    """Return whether the images that a segmentation says it is of are known, and none of them is of the scan."""
    named = images_in(data, "SourceImageSequence")
    for series in data.get("ReferencedSeriesSequence") or ():
        named |= images_in(series, "ReferencedInstanceSequence")
    return bool(named and frame.images) and not named & frame.images


def _segments(path: Path, data: Item) -> tuple[SourceSegment, ...]:
    """Return the segments in the order of their numbers, without the background of a label map."""
    items = data.get("SegmentSequence") or ()
    if not 0 < len(items) <= MOST_SEGMENTS:
        raise VolprepError("VP1401", path=path, count=len(items), most=MOST_SEGMENTS)
    found = {int(item.SegmentNumber): item for item in items}
    if len(found) != len(items) or min(found) < 0:
        raise VolprepError("VP1400", path=path, problem="two segments have the same number, or one is below 0")
    return tuple(
        SourceSegment(
            number=number,
            name=str(item.get("SegmentLabel", "") or ""),
            code=code_of(
                item, "SegmentedPropertyTypeCodeSequence", modifiers="SegmentedPropertyTypeModifierCodeSequence"
            ),
            colour=srgb_of_cielab([int(part) for part in item.get("RecommendedDisplayCIELabValue") or ()]),
        )
        for number, item in sorted(found.items())
        if number > 0
    )


class _Frames:
    """The frames of a segmentation: their pixels and functional groups."""

    def __init__(self, path: Path, data: Item, scan: Grid | None) -> None:
        self.path = path
        self.data = data
        self.kind = str(data.get("SegmentationType", ""))
        if self.kind not in {"BINARY", "FRACTIONAL", "LABELMAP"}:
            raise VolprepError("VP1400", path=path, problem=f"its SegmentationType is {self.kind[:20]!r}")
        self.rows, self.columns = int(data.Rows), int(data.Columns)
        self.count = int(data.get("NumberOfFrames", 1) or 1)
        self.bits = int(data.BitsAllocated)
        self.groups = data.get("PerFrameFunctionalGroupsSequence") or ()
        shared = data.get("SharedFunctionalGroupsSequence") or ()
        self.shared: Item = next(iter(shared), None)
        if not (0 < self.count <= _MOST_FRAMES and self.rows > 0 and self.columns > 0):
            size = f"{self.columns}×{self.rows} pixels in {self.count} frames"
            raise VolprepError("VP1400", path=path, problem=f"it has {size}")
        if len(self.groups) != self.count:
            raise VolprepError(
                "VP1400", path=path, problem=f"{self.count} frames, but places of {len(self.groups)} of them"
            )
        if self.bits not in {1, 8, 16} or (self.bits == 1) > (self.kind == "BINARY"):
            raise VolprepError("VP1400", path=path, problem=f"{self.bits} bits for a pixel of type {self.kind}")
        self._pixels = self._raw(scan)

    def group(self, frame: int, *keywords: str) -> Item | None:
        """Return an item of the functional groups of a frame, or else of the shared functional groups."""
        own = first_item(self.groups[frame], *keywords)
        return own if own is not None or self.shared is None else first_item(self.shared, *keywords)

    def pixels(self, frame: int) -> NDArray[np.unsignedinteger]:
        """Return the stored values of a frame [y, x]."""
        count = self.rows * self.columns
        if self.bits > 1:
            return self._pixels[frame * count : (frame + 1) * count].reshape(self.rows, self.columns)
        first, last = frame * count, (frame + 1) * count
        octets = self._pixels[first // 8 : -(-last // 8)]
        bits = np.unpackbits(octets, bitorder="little")[first % 8 : first % 8 + count]
        return bits.reshape(self.rows, self.columns)

    def _raw(self, scan: Grid | None) -> NDArray[np.unsignedinteger]:
        """Return all pixels; a byte holds eight of one bit. The declared size is checked first."""
        bits = self.rows * self.columns * self.count * self.bits
        octets = self.data.PixelData
        if str(self.data.file_meta.get("TransferSyntaxUID", "")) == _RLE:
            check_size(self.path, (self.count, self.rows, self.columns), 1, scan)
            array = np.ascontiguousarray(self.data.pixel_array).reshape(-1)
            if self.bits == 1:
                return np.packbits(array, bitorder="little")
            return array
        if len(octets) < -(-bits // 8):
            raise VolprepError("VP1404", path=self.path, expected=-(-bits // 8), actual=len(octets))
        order = ">" if self.data.file_meta.get("TransferSyntaxUID", "") == "1.2.840.10008.1.2.2" else "<"
        return np.frombuffer(octets, f"{order}u2" if self.bits == 16 else "u1", -(-bits // 8) // max(1, self.bits // 8))


def _grid(
    path: Path, frames: _Frames, scan: Grid | None, *, is_of_other_images: bool
) -> tuple[Grid, list[int], list[str]]:
    """Return the grid of all frames, the slice z of each, and remarks. Raises VP1405 if they form no grid."""
    orientations = np.array([_numbers(frames, i, "PlaneOrientationSequence", "ImageOrientationPatient", 6)
                             for i in range(frames.count)])  # fmt: skip
    positions = np.array([_numbers(frames, i, "PlanePositionSequence", "ImagePositionPatient", 3)
                          for i in range(frames.count)])  # fmt: skip
    spacings = np.array([_numbers(frames, i, "PixelMeasuresSequence", "PixelSpacing", 2)
                         for i in range(frames.count)])  # fmt: skip
    if np.ptp(orientations, axis=0).max() > _SAME_COSINE or (np.ptp(spacings, axis=0) > 1e-4 * spacings[0]).any():
        raise VolprepError("VP1405", path=path, problem="its frames differ in orientation or pixel spacing")
    row, column = orientations[0, :3], orientations[0, 3:]
    normal = np.cross(row, column)
    relative = positions - positions[0]
    beside = np.abs(np.stack([relative @ row, relative @ column])).max()
    if not beside <= _OFF_PLACE * spacings[0].min():
        problem = f"its frames lie up to {beside:.4g} mm beside each other"
        raise VolprepError("VP1405", path=path, problem=problem)
    of_scan_mm = 0.0 if scan is None else _pitch_of_scan(scan, row, column, spacings[0])
    pitch_mm, places, remarks = _places(path, frames, relative @ normal, of_scan_mm, scan_first=not is_of_other_images)
    first = int(np.argmin(places))
    columns = np.stack([row * spacings[0, 1], column * spacings[0, 0], normal * pitch_mm], axis=1)
    shape = (max(places) + 1, frames.rows, frames.columns)
    return grid_from_affine(path, "functional groups", shape, columns, positions[first]), places, remarks


def _pitch_of_scan(scan: Grid, row: Float64Array, column: Float64Array, spacing_mm: Float64Array) -> float:
    """Return the distance of the slices of a scan whose pixels have the size of the frames' pixels; else 0."""
    z, *of_scan = scan.spacing_mm_zyx
    same_normal = abs(float(np.cross(row, column) @ np.array(scan.direction)[:, 2])) > 1 - _SAME_COSINE**2
    return z if same_normal and np.allclose(sorted(of_scan), sorted(spacing_mm), rtol=1e-3) else 0.0


def _places(
    path: Path, frames: _Frames, along_mm: Float64Array, of_scan_mm: float, *, scan_first: bool
) -> tuple[float, list[int], list[str]]:
    """Return the distance of slices, the slice of each frame, and remarks.

    The first distance that explains all places counts, since missing frames make gaps of several slices. That of the
    scan comes before what the file states, if the segmentation is of its images; slices may be thinner than their
    distance, so that it comes before their thickness in any case. Raises VP1405 if the gaps are not multiples of one.
    """
    along_mm = along_mm - along_mm.min()
    measures = frames.group(0, "PixelMeasuresSequence") or {}
    stated, thickness = (float(measures.get(key, 0) or 0) for key in ("SpacingBetweenSlices", "SliceThickness"))
    distinct = np.unique(along_mm)
    gaps = np.diff(distinct)
    gaps = gaps[gaps > 1e-3 * (stated or thickness or 1.0)]
    pitch = float(gaps.min()) if len(gaps) else stated or of_scan_mm or thickness
    first = (of_scan_mm, stated) if scan_first else (stated, of_scan_mm)
    for guess in (*first, thickness, pitch):
        if guess > 0:
            steps = np.rint(along_mm / guess)
            if np.abs(along_mm - steps * guess).max() <= _OFF_PLACE * guess and steps.max() < LONGEST_AXIS:
                largest = steps.max()
                exact = float(along_mm.max() / largest) if largest else guess
                differs = stated > 0 and abs(exact - stated) > _OFF_PLACE * stated
                remark = (
                    f"the segmentation states slices {stated:.6g} mm apart (SpacingBetweenSlices), but "
                    f"{'those of the scan' if guess == of_scan_mm else 'its frames'} are {exact:.6g} mm apart, "
                    "which is used"
                )
                return exact, steps.astype(int).tolist(), [remark] if differs else []
    problem = f"the places of its frames are no multiples of one distance; the smallest gap is {pitch:.4g} mm"
    raise VolprepError("VP1405", path=path, problem=problem)


def _numbers(frames: _Frames, frame: int, sequence: str, keyword: str, count: int) -> list[float]:
    item = frames.group(frame, sequence)
    numbers = [] if item is None else [float(number) for number in item.get(keyword) or ()]
    if len(numbers) != count or not np.isfinite(numbers).all():
        raise VolprepError("VP1405", path=frames.path, problem=f"frame {frame + 1} has no usable {keyword}")
    return numbers


def _add_frames(
    overlaps: Overlaps, frames: _Frames, places: Sequence[int], segments: Sequence[SourceSegment]
) -> list[str]:
    """Add all frames; return remarks."""
    index = {segment.number: i + 1 for i, segment in enumerate(segments)}
    if frames.kind == "LABELMAP":
        _require_one_each(frames.path, places)
        for z, plane in _label_planes(frames, places, index):
            overlaps.add(z, plane)
        return []
    threshold = 1.0
    remarks = []
    if frames.kind == "FRACTIONAL":
        most = int(frames.data.get("MaximumFractionalValue", 255) or 255)
        threshold = most / 2
        remarks.append("the segmentation holds fractions; a voxel counts as inside from one half on")
    for frame in range(frames.count):
        item = frames.group(frame, "SegmentIdentificationSequence")
        number = -1 if item is None else int(item.get("ReferencedSegmentNumber", -1))
        if number not in index:
            problem = f"frame {frame + 1} belongs to segment {number}, which the file does not describe"
            raise VolprepError("VP1400", path=frames.path, problem=problem)
        overlaps.add(places[frame], (frames.pixels(frame) >= threshold) * np.uint16(index[number]))
    return remarks


def _require_one_each(path: Path, places: Sequence[int]) -> None:
    """Raise VP1405 for two frames of a label map at one place: a voxel has one label."""
    firsts: dict[int, int] = {}
    for frame, place in enumerate(places):
        if place in firsts:
            problem = f"frames {firsts[place] + 1} and {frame + 1} of its label map lie at one place"
            raise VolprepError("VP1405", path=path, problem=problem)
        firsts[place] = frame


def _label_planes(
    frames: _Frames, places: Sequence[int], index: dict[int, int]
) -> Iterator[tuple[int, NDArray[np.uint16]]]:
    """Give each frame of a label map as indices of segments. Padding and background are no segment."""
    outside = {0, int(frames.data.get("PixelPaddingValue", 0) or 0)}
    table = np.full(2**frames.bits, -1, np.int32)
    for number in sorted(outside):
        table[number] = 0
    for number, place in index.items():
        if number < len(table):
            table[number] = place
    for frame in range(frames.count):
        stored = frames.pixels(frame)
        plane = table[stored]
        if plane.min() < 0:
            number = int(stored[plane < 0][0])
            problem = f"frame {frame + 1} holds label {number}, which the file does not describe"
            raise VolprepError("VP1400", path=frames.path, problem=problem)
        yield places[frame], plane.astype(np.uint16)
