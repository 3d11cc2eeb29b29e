"""One of several volumes in a DICOM series: time points, echoes, phases, b-values.

An attribute, or up to three together, that has one value throughout each volume, and another in each, tells them
apart: time, echo, phase, b-value, magnitude and phase. They follow each other in the order of its values.
Without such an attribute, the order of a clock at each place does.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.clocks import ORDERED_BY, seconds_of
from volprep_formats.readers.dicom.fields import VARIANTS
from volprep_formats.readers.dicom.header import SliceImage

_MOST_TOGETHER = 3
"""Attributes that tell volumes apart together, such as echo and part of a complex image."""


@dataclass(frozen=True)
class Volumes:
    """The volumes at one set of places, in their order."""

    differ: tuple[str, ...]
    """Attributes in which they differ; none if there is one volume."""
    members: tuple[NDArray[np.intp], ...]
    """Indices of the images of each, rising."""


def volumes_of(images: Sequence[SliceImage], places: NDArray[np.intp], *, by_number: bool = False) -> Volumes | None:
    """Divide images into volumes; None if nothing tells them apart.

    `places` gives the position index of each image, rising. Volumes that no attribute distinguishes as a whole follow
    each other by a clock, as the phases of a heart whose slices were taken one after the other; with `by_number` by
    InstanceNumber, as time points of scanners that write nothing else.
    """
    count = int(np.bincount(places).max())
    if count == 1:
        return Volumes((), (np.arange(len(images)),))
    for kinds in _combinations(images):
        values = [tuple(in_order(image.variants[k]) for k in kinds) for image in images]
        distinct = sorted(set(values))
        chosen = [np.array([value == one for value in values]) for one in distinct]
        if len(distinct) == count and all(np.array_equal(places[value], np.unique(places)) for value in chosen):
            return Volumes(tuple(VARIANTS[k] for k in kinds), tuple(np.flatnonzero(mask) for mask in chosen))
    for clock in ORDERED_BY:
        members = _ranked(seconds_of(images, clock), places, count, is_clock=True)
        if members:
            return Volumes((clock,), members)
    numbers = np.array([np.inf if image.instance_number is None else image.instance_number for image in images])
    members = _ranked(numbers, places, count) if by_number else ()
    return Volumes(("nothing but InstanceNumber",), members) if members else None


def choose_volume(
    images: Sequence[SliceImage], places: NDArray[np.intp], volume: int, *, by_number: bool = False
) -> tuple[NDArray[np.intp], list[str]]:
    """Return the indices of the images of volume number `volume`, from 1, and a remark.

    Returns all images if there is one volume, or if nothing tells them apart, as `volumes_of` does. Raises VP2017 when
    there are fewer volumes.
    """
    count = int(np.bincount(places).max())
    if volume > count:
        raise VolprepError("VP2017", path=images[0].path.parent, volume=volume, count=count)
    found = volumes_of(images, places, by_number=by_number)
    if found is None or not found.differ:
        return np.arange(len(images)), []
    names = " and ".join(found.differ)
    return found.members[volume - 1], [f"this is volume {volume} of {count}, which differ in {names}"]


def how_to_choose(images: Sequence[SliceImage], places: NDArray[np.intp], before: int) -> str:
    """Describe how to read one of several volumes at one position, if possible; their numbers begin after `before`."""
    count = int(np.bincount(places).max())
    choice = f"--volume, or source.volume in a scene, from {before + 1} to {before + count}"
    if len(choose_volume(images, places, 1)[0]) < len(images):
        return f"Choose one with {choice}. If they are time points, use --frames all."
    if len(choose_volume(images, places, 1, by_number=True)[0]) < len(images):
        return f"If they follow each other by InstanceNumber, give --volumes-by number, and choose one with {choice}."
    return "Keep only the images of one volume in the folder."


def _combinations(images: Sequence[SliceImage]) -> Iterator[tuple[int, ...]]:
    """Return the attributes that differ between the images: each alone first, then two and three together."""
    differing = [k for k in range(len(VARIANTS)) if len({image.variants[k] for image in images}) > 1]
    for together in range(1, _MOST_TOGETHER + 1):
        yield from combinations(differing, together)


def _ranked(
    values: NDArray[np.float64], places: NDArray[np.intp], count: int, *, is_clock: bool = False
) -> tuple[NDArray[np.intp], ...]:
    """Return for each rank the images that have it at their places.

    Returns nothing if a value or an image is missing, or if `is_clock` and two images of a place have one time.
    """
    if not np.isfinite(values).all() or np.bincount(places).min() < count:
        return ()
    order = np.lexsort((values, places)).reshape(-1, count)
    if is_clock and not (np.diff(values[order], axis=1) > 0.0).all():
        return ()
    return tuple(np.sort(order[:, rank]) for rank in range(count))


def in_order(text: str) -> tuple[float, str]:
    """Return a key that sorts values of attributes: numbers come before text."""
    try:
        return float(text), text
    except ValueError:
        return float("inf"), text
