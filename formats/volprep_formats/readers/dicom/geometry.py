"""The grid of a DICOM series, from nothing but orientation and projected position; refused when it is not a grid.

Slices are ordered along the normal (row × column) by the projection of ImagePositionPatient on it, so that the grid
is right-handed. SliceThickness and SpacingBetweenSlices are never used where two positions say more. Source: DICOM
PS3.3, C.7.6.2.1.1; PixelSpacing is the distance between rows first (y), then between columns (x): 10.7.1.3.
"""

import math
import os
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.readers.dicom.fields import VARIANTS
from volprep_formats.readers.dicom.header import SliceImage
from volprep_formats.readers.dicom.stacks import split_stacks
from volprep_formats.readers.dicom.volumes import choose_volume, how_to_choose
from volprep_formats.readers.orientation import ORIENTATION_TOLERANCE, nearest_orthonormal
from volprep_formats.source import RepairKind
from volprep_formats.uneven_source import SlicePlaces

Points = Float64Array

SAME_TOLERANCE = 1e-4
"""Largest difference of cosines (absolute) and pixel spacings (relative) between slices of one volume."""
DRIFT_TOLERANCE_PIXELS = 0.1
"""Largest distance of a slice from the line along the normal."""
UNEVEN_TOLERANCE = 0.02
"""Largest distance of a slice from its even position, in slice distances."""
_ROUNDED_MM = 0.01
"""Positions written with two decimals put no slice further than this from its even place (and never by 0.1)."""
_REMARK_MM = 1e-3
_SAME_PLACE = 1e-3
"""Slices nearer than this share of the largest gap count as one position."""


_REPAIRABLE: dict[RepairKind, tuple[str, ...]] = {"gaps": ("VP2014", "VP2015"), "tilt": ("VP2007",)}
"""Codes of the errors that each repair does away with."""


@dataclass(frozen=True)
class Stack:
    """A series as a grid: `order[z]` is the index of the image that is slice z."""

    order: tuple[int, ...]
    grid: Grid
    remarks: tuple[str, ...]
    places: SlicePlaces | None
    """Positions of slices that do not form a grid; the grid is then that of `UnevenSource.nominal`."""


def stack_images(
    images: Sequence[SliceImage],
    repair: Collection[RepairKind] = (),
    volume: int | None = None,
    *,
    by_number: bool = False,
) -> Stack:
    """Order the images of one series and find their grid. Faults that `repair` allows are not refused.

    Of several stacks, or volumes at one place, `volume`, from 1, is taken; volumes of the first stack come first.
    `by_number` tells volumes apart by InstanceNumber. Stacks that lie end to end on one grid are one volume if no
    `volume` is given. Raises VolprepError VP1036 (essential attribute missing), and VP2001 to VP2015, VP2017 and
    VP2022 (not a grid), with the numbers.
    """
    for image in images:
        check_complete(image)
    stacks, differ = split_stacks(images)
    if len(stacks) == 1:
        return _stack(images, repair, volume, by_number=by_number)
    own = [[images[k] for k in stack] for stack in stacks]
    counts = [_volumes_in(stack) for stack in own]
    if volume is None:
        return _joined(images, own, differ, sum(counts), repair)
    if volume > sum(counts):
        raise VolprepError("VP2017", path=images[0].path.parent, volume=volume, count=sum(counts))
    ends = np.cumsum(counts).tolist()
    chosen = next(k for k, end in enumerate(ends) if volume <= end)
    before = ends[chosen] - counts[chosen]
    found = _stack(own[chosen], repair, volume - before, by_number=by_number, before=before)
    remark = f"there are {len(stacks)} stacks, which differ in {differ}; number {chosen + 1} of them was read"
    return replace(found, order=tuple(stacks[chosen][k] for k in found.order), remarks=(remark, *found.remarks))


def _joined(
    images: Sequence[SliceImage],
    stacks: Sequence[Sequence[SliceImage]],
    differ: str,
    volumes: int,
    repair: Collection[RepairKind],
) -> Stack:
    """Return stacks that lie end to end on one grid as one volume, with a remark. Refuse others with VP2022."""
    try:
        # Between two stacks nothing was scanned: a gap there is not filled.
        found = _stack(images, [kind for kind in repair if kind != "gaps"])
    except VolprepError as error:
        folder = _names(images)[0]
        sizes = ", ".join(f"{len(stack)} {_plane(np.array(stack[0].orientation))}" for stack in stacks)
        raise VolprepError(
            "VP2022",
            folder=folder,
            stacks=len(stacks),
            differ=differ,
            sizes=sizes,
            cause=f"{error.code}, {error.summary.removeprefix(f'{folder}: ')}",
            volumes=volumes,
        ) from error
    remark = (
        f"the slices are of {len(stacks)} stacks, which differ in {differ} and lie end to end; they were read as one "
        f"volume; --volume, from 1 to {volumes}, reads one stack"
    )
    return replace(found, remarks=(*found.remarks, remark))


def _volumes_in(images: Sequence[SliceImage]) -> int:
    """Return the number of volumes in one stack: the most images at one place."""
    try:
        return int(np.bincount(places_of(images)).max())
    except VolprepError:
        return 1


def _stack(
    images: Sequence[SliceImage],
    repair: Collection[RepairKind],
    volume: int | None = None,
    *,
    by_number: bool = False,
    before: int = 0,
) -> Stack:
    """Order images without a look at stacks. `before` is the number of volumes in other stacks, which come first."""
    # Check orientations first: the images of localisers differ in orientation, which identifies them.
    axes, remarks = _axes(images)
    shape_yx, spacing_mm_yx = _common_plane(images)
    positions = np.array([image.position_mm_xyz for image in images], dtype=np.float64)
    along_mm = positions @ axes[:, 2]
    order = np.argsort(along_mm, kind="stable")
    if volume is not None:
        ordered = [images[i] for i in order]
        kept, remark = choose_volume(ordered, _places(along_mm[order]), volume, by_number=by_number)
        order = order[kept]
        remarks += remark
    ordered = [images[i] for i in order]
    positions, along_mm = positions[order], along_mm[order] - along_mm[order[0]]
    needed: list[RepairKind] = []
    if len(ordered) == 1:
        pitch_mm, extent_remark = _single_pitch(ordered[0])
        remarks.append(extent_remark)
    else:
        _check_places(ordered, along_mm, before)
        with _repairing("tilt", repair, needed):
            remarks += _check_line(ordered, positions, along_mm, axes, min(spacing_mm_yx))
        with _repairing("gaps", repair, needed):
            remarks += _check_even(ordered, along_mm)
        pitch_mm = float(along_mm[-1]) / (len(ordered) - 1)
        remarks += _pitch_remarks(ordered, pitch_mm)
    grid = Grid.of((len(ordered), *shape_yx), (pitch_mm, *spacing_mm_yx), positions[0], axes)
    places = None
    if needed:
        beside = ((positions - positions[0]) @ axes[:, :2]).tolist()
        places = SlicePlaces(
            folder=_names(ordered)[0],
            along_mm=tuple(along_mm.tolist()),
            beside_mm_xy=tuple((x, y) for x, y in beside),
            repairs=tuple(needed),
        )
    return Stack(tuple(order.tolist()), grid, tuple(remarks), places)


@contextmanager
def _repairing(kind: RepairKind, allowed: Collection[RepairKind], needed: list[RepairKind]) -> Iterator[None]:
    """Record that the repair `kind` is needed instead of raising the error, if it is allowed."""
    try:
        yield
    except VolprepError as error:
        if kind not in allowed or error.code not in _REPAIRABLE[kind]:
            raise
        needed.append(kind)


def repair_of(error: VolprepError) -> RepairKind | None:
    """Return the repair for a fault of geometry, or None."""
    return next((kind for kind, codes in _REPAIRABLE.items() if error.code in codes), None)


def check_complete(image: SliceImage) -> None:
    """Raise VP1036 for an image that does not say where it lies."""
    for keyword, value in (
        ("ImageOrientationPatient", image.orientation),
        ("ImagePositionPatient", image.position_mm_xyz),
        ("PixelSpacing", image.pixel_spacing_mm_yx),
    ):
        if value is None:
            raise VolprepError("VP1036", path=image.path, keyword=keyword)


def _common_plane(images: Sequence[SliceImage]) -> tuple[tuple[int, int], tuple[float, float]]:
    """Shape and pixel spacing that all slices share."""
    shape_yx = images[0].shape_yx
    spacing = np.array([image.pixel_spacing_mm_yx for image in images], dtype=np.float64)
    alike = np.isclose(spacing, spacing[0], rtol=SAME_TOLERANCE, atol=0.0).all(axis=1).tolist()
    for image, own, same in zip(images, spacing, alike, strict=True):
        if image.shape_yx != shape_yx:
            folder, (one, two) = _names((images[0], image))
            raise VolprepError(
                "VP2001",
                first=f"{one} has {shape_yx[1]}×{shape_yx[0]}",
                other=f"{two} has {image.shape_yx[1]}×{image.shape_yx[0]}",
                folder=folder,
            )
        if not same:
            folder, (one, two) = _names((images[0], image))
            raise VolprepError(
                "VP2002",
                first=f"{one} has {spacing[0, 1]:.6g}×{spacing[0, 0]:.6g}",
                other=f"{two} has {own[1]:.6g}×{own[0]:.6g}",
                folder=folder,
            )
    return shape_yx, (float(spacing[0, 0]), float(spacing[0, 1]))


def _plane(cosines: Points) -> str:
    """Name the plane of a slice by the axis of the patient that its normal is nearest to."""
    normal = np.cross(cosines[:3], cosines[3:])
    length = float(np.linalg.norm(normal))
    name = ("sagittal", "coronal", "axial")[int(np.argmax(np.abs(normal)))]
    tilt_deg = math.degrees(math.acos(min(float(np.abs(normal).max()) / length, 1.0))) if length > 0 else 0.0
    return name if tilt_deg < 1.0 else f"{name} by {tilt_deg:.0f}° oblique"


def _axes(images: Sequence[SliceImage]) -> tuple[Points, list[str]]:
    """3×3 matrix whose columns are the index axes x, y and z (the normal) in the world."""
    cosines = np.array([image.orientation for image in images], dtype=np.float64)
    differing = np.abs(cosines - cosines[0]).max(axis=1) > SAME_TOLERANCE
    if differing.any():
        worst = int(np.argmax(np.abs(cosines - cosines[0]).max(axis=1)))
        folder, names = _names(images)
        raise VolprepError(
            "VP2003",
            count=int(differing.sum()),
            total=len(images),
            first=f"{names[0]}, which is {_plane(cosines[0])}",
            other=f"{names[worst]}, which is {_plane(cosines[worst])},",
            angle=_angle_deg(cosines[0], cosines[worst]),
            folder=folder,
        )
    plane, deviation = nearest_orthonormal(cosines[0].reshape(2, 3).T)
    if deviation > ORIENTATION_TOLERANCE:
        raise VolprepError("VP2004", path=images[0].path, deviation=deviation, tolerance=ORIENTATION_TOLERANCE)
    remarks = []
    if deviation > 1e-5:
        remarks.append(
            f"the direction cosines are off from right angles or unit length by {deviation:.1e}; the nearest "
            "right-angled ones are used"
        )
    return np.column_stack((plane, np.cross(plane[:, 0], plane[:, 1]))), remarks


def _angle_deg(cosines: Points, other: Points) -> float:
    """Largest angle between the row or column directions of two slices."""
    own, its = cosines.reshape(2, 3), other.reshape(2, 3)
    lengths = np.linalg.norm(own, axis=1) * np.linalg.norm(its, axis=1)
    cosine = (own * its).sum(axis=1) / np.where(lengths > 0, lengths, 1.0)
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max())


def _single_pitch(image: SliceImage) -> tuple[float, str]:
    """Extent of the only slice along the normal: no second position says more."""
    for keyword, value in (
        ("SpacingBetweenSlices", image.spacing_between_slices_mm),
        ("SliceThickness", image.slice_thickness_mm),
    ):
        if value:
            return abs(value), f"the series has one slice; its extent of {abs(value):.6g} mm is from {keyword}"
    raise VolprepError("VP1036", path=image.path, keyword="SliceThickness")


def places_of(images: Sequence[SliceImage]) -> NDArray[np.intp]:
    """Return the index of each image's place along the normal, from 0. Raises VP2003 for other orientations."""
    axes, _ = _axes(images)
    along_mm = np.array([image.position_mm_xyz for image in images], dtype=np.float64) @ axes[:, 2]
    order = np.argsort(along_mm, kind="stable")
    places = np.empty(len(images), np.intp)
    places[order] = _places(along_mm[order])
    return places


def _places(along_mm: Points) -> NDArray[np.intp]:
    """Return the index of each slice's position, from 0; slices are in order."""
    gaps = np.diff(along_mm)
    result: NDArray[np.intp] = np.cumsum(np.concatenate(([0], gaps > _SAME_PLACE * gaps.max(initial=0.0))))
    return result


def _check_places(images: Sequence[SliceImage], along_mm: Points, before: int) -> None:
    """Refuse several images at one place along the normal."""
    places = _places(along_mm)
    counts = np.bincount(places)
    if counts.max() == 1:
        return
    starts = np.cumsum(counts) - counts
    first = int(starts[np.argmax(counts > 1)])
    here, there = images[first], images[first + 1]
    if here.instance_uid and (here.instance_uid, here.number) == (there.instance_uid, there.number):
        differ = "they have one SOPInstanceUID, but differ"
    else:
        names = [name for k, name in enumerate(VARIANTS) if len({i.variants[k] for i in images}) > 1]
        differ = "they differ in " + ", ".join(names) if names else "nothing in their headers tells them apart"
    folder, (one, two) = _names((here, there))
    code = "VP2006" if counts.min() == counts.max() else "VP2005"
    raise VolprepError(
        code,
        first=one,
        second=two,
        position=_point(here.position_mm_xyz),
        places=len(counts),
        several=int((counts > 1).sum()),
        each=int(counts.max()),
        differ=differ,
        folder=folder,
        how=how_to_choose(images, places, before),
    )


def _check_line(
    images: Sequence[SliceImage], positions: Points, along_mm: Points, axes: Points, pixel_mm: float
) -> list[str]:
    """Refuse slices that do not lie above each other: a tilted gantry, or single slices that are shifted."""
    beside = (positions - positions[0]) @ axes[:, :2]
    drift = beside[-1] / along_mm[-1]
    off_line = np.abs(beside - along_mm[:, None] * drift).max(axis=1)
    worst = int(np.argmax(off_line))
    if off_line[worst] > DRIFT_TOLERANCE_PIXELS * pixel_mm:
        folder, names = _names(images)
        raise VolprepError(
            "VP2008",
            name=names[worst],
            slice=worst,
            shift_mm=float(off_line[worst]),
            tolerance_mm=DRIFT_TOLERANCE_PIXELS * pixel_mm,
            folder=folder,
        )
    total_mm = float(np.abs(beside[-1]).max())
    if total_mm > DRIFT_TOLERANCE_PIXELS * pixel_mm:
        about_rows, about_columns = np.degrees(np.arctan(drift[::-1]))
        angles = [f"{about_rows:.2f}° about the rows"] if abs(drift[1]) * along_mm[-1] > _REMARK_MM else []
        angles += [f"{about_columns:.2f}° about the columns"] if abs(drift[0]) * along_mm[-1] > _REMARK_MM else []
        pitch = along_mm[-1] / (len(images) - 1)
        raise VolprepError(
            "VP2007",
            angles=" and ".join(angles),
            pitch_mm=float(pitch),
            step_mm=float(pitch * math.hypot(1.0, *drift)),
            total_mm=total_mm,
            folder=_names(images)[0],
        )
    if total_mm > _REMARK_MM:
        return [f"the slices drift sideways by {total_mm:.3g} mm from the first to the last; taken as straight"]
    return []


def _check_even(images: Sequence[SliceImage], along_mm: Points) -> list[str]:
    """Refuse missing slices and uneven gaps."""
    gaps = np.diff(along_mm)
    pitch = along_mm[-1] / len(gaps)
    off_mm = np.abs(along_mm - pitch * np.arange(len(along_mm)))
    tolerance_mm = min(0.1 * pitch, max(UNEVEN_TOLERANCE * pitch, _ROUNDED_MM))
    worst_mm = float(off_mm.max())
    if worst_mm <= tolerance_mm:
        if worst_mm > _REMARK_MM:
            return [f"the slices lie up to {worst_mm:.3g} mm from their even places; taken as even"]
        return []
    usual = float(np.sort(gaps)[(len(gaps) - 1) // 2])
    at = int(np.argmax(gaps))
    missing = round(float(gaps[at]) / usual) - 1
    folder, names = _names(images)
    numbers = {
        "below": f"{names[at]} (slice {at})",
        "above": f"{names[at + 1]} (slice {at + 1})",
        "gap_mm": float(gaps[at]),
        "usual_mm": usual,
        "folder": folder,
    }
    if missing >= 1 and abs(gaps[at] / usual - (missing + 1)) < 0.1:
        holes = int((gaps > 1.5 * usual).sum())
        raise VolprepError("VP2014", missing=missing, holes=holes, **numbers)
    raise VolprepError(
        "VP2015", least_mm=float(gaps.min()), off_mm=worst_mm, tolerance_mm=float(tolerance_mm), **numbers
    )


def _pitch_remarks(images: Sequence[SliceImage], pitch_mm: float) -> list[str]:
    """Return when the tags tell another distance than the positions."""
    said = images[0].spacing_between_slices_mm
    if said is None or math.isclose(abs(said), pitch_mm, rel_tol=1e-3):
        return []
    tags_and_positions = f"SpacingBetweenSlices says {abs(said):.6g} mm, but the positions lie {pitch_mm:.6g} mm apart"
    return [f"{tags_and_positions}; the positions are used"]


def _names(images: Sequence[SliceImage]) -> tuple[str, list[str]]:
    """Folder that holds all these files, and their paths from there."""
    folder = os.path.commonpath([image.path.parent for image in images])
    numbers = ["" if image.number is None else f" frame {image.number}" for image in images]
    return folder, [os.path.relpath(i.path, folder) + number for i, number in zip(images, numbers, strict=True)]


def _point(position_mm_xyz: tuple[float, ...] | None) -> str:
    return ", ".join(f"{p:.3f}" for p in position_mm_xyz or ())
