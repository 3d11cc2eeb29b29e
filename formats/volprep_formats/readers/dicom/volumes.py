"""One of several volumes in a DICOM series: time points, echoes, phases, b-values.

An attribute that has one value throughout each volume, and another in each, tells them apart. Their order is that of
its values.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.fields import VARIANTS
from volprep_formats.readers.dicom.header import SliceImage


def choose_volume(
    images: Sequence[SliceImage], places: NDArray[np.intp], volume: int
) -> tuple[NDArray[np.intp], list[str]]:
    """Indices of the images of volume number `volume`, from 1, and a remark; all of them where none can be told apart.

    `places` gives the number of the place of each image. Raises VolprepError VP2017 when there are fewer volumes.
    """
    count = int(np.bincount(places).max())
    if volume > count:
        raise VolprepError("VP2017", path=images[0].path.parent, volume=volume, count=count)
    everything = np.arange(len(images))
    if count == 1:
        return everything, []
    for k, name in enumerate(VARIANTS):
        values = np.array([image.variants[k] for image in images])
        distinct = sorted(set(values.tolist()), key=_in_order)
        wholes = [np.array_equal(places[values == value], np.unique(places)) for value in distinct]
        if len(distinct) == count and all(wholes):
            remark = f"the series holds {count} volumes, which differ in {name}; number {volume} of them was read"
            return np.flatnonzero(values == distinct[volume - 1]), [remark]
    return everything, []


def _in_order(text: str) -> tuple[float, str]:
    """Numbers come before text."""
    try:
        return float(text), text
    except ValueError:
        return float("inf"), text
