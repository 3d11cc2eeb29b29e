"""One of several volumes in a DICOM series: time points, echoes, phases, b-values.

An attribute, or up to three together, that has one value throughout each volume, and another in each, tells them
apart: time, echo, phase, b-value, magnitude and phase. Their order is that of its values.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.fields import VARIANTS
from volprep_formats.readers.dicom.header import SliceImage

_MOST_TOGETHER = 3
"""Attributes that tell volumes apart together, such as echo and part of a complex image."""


def choose_volume(
    images: Sequence[SliceImage], places: NDArray[np.intp], volume: int, *, by_number: bool = False
) -> tuple[NDArray[np.intp], list[str]]:
    """Return the indices of the images of volume number `volume`, from 1, and a remark.

    Returns all images if there is one volume, or if no attribute distinguishes them. `places` gives the position index
    of each image. With `by_number`, volumes that no attribute distinguishes are ordered by InstanceNumber, as time
    points of GE are. Raises VolprepError VP2017 when there are fewer volumes.
    """
    count = int(np.bincount(places).max())
    if volume > count:
        raise VolprepError("VP2017", path=images[0].path.parent, volume=volume, count=count)
    everything = np.arange(len(images))
    if count == 1:
        return everything, []
    remark = f"there are {count} volumes, which differ in {{}}; number {volume} of them was read"
    for kinds in _combinations(images):
        values = [tuple(in_order(image.variants[k]) for k in kinds) for image in images]
        distinct = sorted(set(values))
        chosen = [np.array([value == one for value in values]) for one in distinct]
        if len(distinct) == count and all(np.array_equal(places[each], np.unique(places)) for each in chosen):
            names = " and ".join(VARIANTS[k] for k in kinds)
            return np.flatnonzero(chosen[volume - 1]), [remark.format(names)]
    if by_number:
        numbers = np.array([np.inf if image.instance_number is None else image.instance_number for image in images])
        return _by_number(numbers, places, count, volume), [remark.format("nothing but InstanceNumber")]
    return everything, []


def how_to_choose(images: Sequence[SliceImage], places: NDArray[np.intp], before: int) -> str:
    """Describe how to read one of several volumes at one position, if possible; their numbers begin after `before`."""
    count = int(np.bincount(places).max())
    choice = f"--volume, or source.volume in a scene, from {before + 1} to {before + count}"
    if len(choose_volume(images, places, 1)[0]) < len(images):
        return f"Choose one with {choice}."
    if len(choose_volume(images, places, 1, by_number=True)[0]) < len(images):
        return f"If they follow each other by InstanceNumber, give --volumes-by number, and choose one with {choice}."
    return "Keep only the images of one volume in the folder."


def _combinations(images: Sequence[SliceImage]) -> Iterator[tuple[int, ...]]:
    """Return the attributes that differ between the images: each alone first, then two and three together."""
    differing = [k for k in range(len(VARIANTS)) if len({image.variants[k] for image in images}) > 1]
    for together in range(1, _MOST_TOGETHER + 1):
        yield from combinations(differing, together)


def _by_number(numbers: NDArray[np.float64], places: NDArray[np.intp], count: int, volume: int) -> NDArray[np.intp]:
    """Return at each place the image that comes `volume`-th by its number; all images if some place has fewer."""
    if not np.isfinite(numbers).all() or np.bincount(places).min() < count:
        return np.arange(len(places))
    order = np.lexsort((numbers, places))
    return np.sort(order.reshape(-1, count)[:, volume - 1])


def in_order(text: str) -> tuple[float, str]:
    """Return a key that sorts values of attributes: numbers come before text."""
    try:
        return float(text), text
    except ValueError:
        return float("inf"), text
