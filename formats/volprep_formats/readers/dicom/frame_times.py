"""Frames of a DICOM series: whether its volumes are time points, and when each was taken."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers.dicom.clocks import ORDERED_BY, TIMES_OF_DAY, seconds_of
from volprep_formats.readers.dicom.fields import VARIANTS
from volprep_formats.readers.dicom.geometry import check_complete, places_of
from volprep_formats.readers.dicom.header import SliceImage
from volprep_formats.readers.dicom.scan import choose_series, scan
from volprep_formats.readers.dicom.stacks import split_stacks
from volprep_formats.readers.dicom.volumes import Volumes, in_order, volumes_of
from volprep_formats.readers.time_axis import TimeAxis, not_time
from volprep_formats.source import SourceSpec

_OF_TIME = frozenset({*ORDERED_BY, "TemporalPositionIdentifier", "AcquisitionNumber", "nothing but InstanceNumber"})
"""Attributes in which time points differ. AcquisitionNumber counts diffusion weights, too, which are refused."""
_IMAGE_TYPE = VARIANTS.index("ImageType")


def time_axis(spec: SourceSpec, path: Path) -> TimeAxis:
    """Return the time points of the series. Times of the day count from the first one.

    Raises the errors of the headers, VP1340 for volumes that are not time points (echoes, b-values, stacks), and VP1343
    where an image is missing.
    """
    images = choose_series(scan(path, Silent()), spec).images
    for image in images:
        if image.problem is not None:
            raise image.problem
        check_complete(image)
    stacks, differ = split_stacks(images)
    if len(stacks) > 1:
        raise not_time(path, f"they are stacks, which differ in {differ}")
    if any("DIFFUSION" in image.variants[_IMAGE_TYPE].upper() for image in images):
        raise not_time(path, "its images are weighted by diffusion (ImageType)")
    places = places_of(images)
    images = tuple(images[k] for k in np.argsort(places, kind="stable"))
    places.sort()
    found = volumes_of(images, places, by_number=spec.volumes_by == "number")
    if found is None:
        raise _incomplete(path, images, places)
    if not _OF_TIME.issuperset(found.differ):
        raise not_time(path, f"they differ in {' and '.join(found.differ)}")
    return TimeAxis(len(found.members), _times_s(images, found))


def _times_s(images: Sequence[SliceImage], volumes: Volumes) -> tuple[float, ...] | None:
    """Return the mean time of each volume by the first clock that rises from one to the next."""
    for clock in ORDERED_BY:
        seconds = seconds_of(images, clock)
        of_volume = [seconds[members] for members in volumes.members]
        means = np.array([own.mean() for own in of_volume])
        if not np.isfinite(means).all() or not (np.diff(means) > 0.0).all():
            continue
        if clock not in TIMES_OF_DAY:
            return tuple(means.tolist())
        # Slices that were taken one after the other, each with all its phases, have no time of the day in common.
        if all(own.max() <= later.min() for own, later in pairwise(of_volume)):
            return tuple((means - means[0]).tolist())
    return None


def _incomplete(path: Path, images: Sequence[SliceImage], places: NDArray[np.intp]) -> VolprepError:
    """Return the error about volumes that are not complete, which names the time points that miss images."""
    counts = np.bincount(places)
    count = int(counts.max())
    for kind in (VARIANTS.index("TemporalPositionIdentifier"), VARIANTS.index("TriggerTime")):
        values = [image.variants[kind] for image in images]
        distinct = sorted(set(values), key=in_order)
        if "" in distinct or len(distinct) != count:
            continue
        there = [values.count(value) for value in distinct]
        lacking = ", ".join(f"{k} has {own}" for k, own in enumerate(there, 1) if own < len(counts))
        what = f"by {VARIANTS[kind]} each of {count} time points has {len(counts)} images, but number {lacking}"
        return VolprepError("VP1343", path=path, what=what)
    if counts.min() < count:
        what = f"{int((counts < count).sum())} of its {len(counts)} places have fewer than {count} images"
    else:
        what = f"nothing in the headers tells the {count} images of a place apart"
    return VolprepError("VP1343", path=path, what=what)
