"""Stacks in a DICOM series: slices that a scanner planned together, each group a volume of its own.

Stacks differ in StackID. Where that is the same or missing, a stack ends where InStackPositionNumber, which counts the
slices of one stack from 1, begins again. Source: DICOM PS3.3, C.7.6.16.2.2.4.
"""

from collections.abc import Sequence

import numpy as np

from volprep_formats.readers.dicom.fields import VARIANTS
from volprep_formats.readers.dicom.header import SliceImage
from volprep_formats.readers.dicom.volumes import in_order

_STACK_ID = VARIANTS.index("StackID")
Indices = tuple[int, ...]


def split_stacks(images: Sequence[SliceImage]) -> tuple[tuple[Indices, ...], str]:
    """Return the indices of the images of each stack, and the attributes in which the stacks differ.

    There is one stack if nothing divides the images, or if each part would be a single slice. All images have an
    orientation and a position.
    """
    by_id: dict[str, list[int]] = {}
    for index, image in enumerate(images):
        by_id.setdefault(image.variants[_STACK_ID], []).append(index)
    parts = [part for name in sorted(by_id, key=in_order) for part in _restarts([(k, images[k]) for k in by_id[name]])]
    if len({len({images[k].position_mm_xyz for k in part}) for part in parts} | {1}) == 1:
        return (tuple(range(len(images))),), ""
    names = ["StackID"] if len(by_id) > 1 else []
    names += ["InStackPositionNumber"] if len(parts) > len(by_id) else []
    return tuple(parts), " and ".join(names)


def _restarts(images: Sequence[tuple[int, SliceImage]]) -> list[Indices]:
    """Divide images with one StackID where their numbers in the stack begin again, along their normal.

    Numbers that do not count slices (missing, not the same for all images of a place, in no order) divide nothing.
    """
    everything = [tuple(index for index, _ in images)]
    cosines = np.array(images[0][1].orientation, dtype=np.float64).reshape(2, 3)
    normal = np.cross(*cosines)
    at: dict[float, set[str]] = {}
    for _, image in images:
        at.setdefault(_along(image, normal), set()).add(image.stack_position)
    numbers = [next(iter(at[place])) if len(at[place]) == 1 else "" for place in sorted(at)]
    if not all(number.isdecimal() for number in numbers):
        return everything
    runs = _runs([int(number) for number in numbers])
    least = min(min(run) for run in runs)
    if len(runs) == 1 or any(least not in run or len(run) < 2 for run in runs):
        return everything
    run_of = np.repeat(np.arange(len(runs)), [len(run) for run in runs])
    run_at = dict(zip(sorted(at), run_of.tolist(), strict=True))
    return [
        tuple(index for index, image in images if run_at[_along(image, normal)] == number)
        for number in range(len(runs))
    ]


def _along(image: SliceImage, normal: np.ndarray) -> float:
    """Return the place along the normal in mm, to a millionth: positions of one place may differ by rounding."""
    return round(float(np.dot(image.position_mm_xyz or (0.0, 0.0, 0.0), normal)), 6)


def _runs(numbers: Sequence[int]) -> list[list[int]]:
    """Divide numbers into the longest parts that only rise or only fall, from the first on."""
    runs = [[numbers[0]]]
    for number in numbers[1:]:
        run = runs[-1]
        step = number - run[-1]
        if step == 0 or (len(run) > 1 and (step > 0) != (run[1] > run[0])):
            runs.append([number])
        else:
            run.append(number)
    return runs
