"""Copies of DICOM images: files that hold the same image again, as two exports of one study do."""

import hashlib
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.fields import CLOCKS
from volprep_formats.readers.dicom.header import SliceImage
from volprep_formats.readers.dicom.value import value_of


def without_copies(images: Sequence[SliceImage]) -> tuple[SliceImage, ...]:
    """Return the images without copies, which repeat header and pixels of an earlier one. Only likely ones are read.

    Copies have the UID of their image, or its place and a UID of their own. Volumes that nothing tells apart may share
    slices, such as empty ones: where all places have equally many images, the latter are copies only if all are.
    """
    alike = [_repeated(group) for group in _groups(images, _name)]
    kept = _without(images, alike)
    groups = _groups(kept, _place)
    are_volumes = len({len(group) for group in groups}) == 1
    copies = []
    for group in groups:
        copies.append(_repeated(group))
        if are_volumes and len(copies[-1]) < len(group) - 1:
            return kept
    return _without(kept, copies)


def _name(image: SliceImage) -> Hashable:
    return (image.instance_uid, image.number) if image.instance_uid else None


def _place(image: SliceImage) -> Hashable:
    position = image.position_mm_xyz
    return (position, image.orientation, image.number, image.variants) if position else None


def _groups(images: Sequence[SliceImage], key: Callable[[SliceImage], Hashable]) -> list[list[SliceImage]]:
    """Return the images with one key together, except those whose key is None."""
    groups: dict[Hashable, list[SliceImage]] = {}
    for image in images:
        groups.setdefault(key(image), []).append(image)
    groups.pop(None, None)
    return list(groups.values())


def _repeated(group: Sequence[SliceImage]) -> set[int]:
    """Return the identities of images that repeat an earlier one of the group."""
    if len(group) == 1:
        return set()
    seen: set[object] = set()
    repeated = set()
    for image in group:
        content = _content(image)
        if content is not None and content in seen:
            repeated.add(id(image))
        seen.add(content)
    return repeated


def _without(images: Sequence[SliceImage], copies: Sequence[set[int]]) -> tuple[SliceImage, ...]:
    left_out = set().union(*copies)
    return tuple(image for image in images if id(image) not in left_out)


def _content(image: SliceImage) -> tuple[SliceImage, bytes] | None:
    """Return the header without what a copy has of its own, and a digest of the pixels; None if they are unreadable."""
    if image.pixels is None or image.problem is not None:
        return None
    try:
        digest = hashlib.sha256(value_of(image.pixels)).digest()
    except (VolprepError, OSError, ValueError):
        return None
    pixels = replace(image.pixels, path=Path(), offset_bytes=0)
    # ContentTime is when the pixels were written, which may be when they were copied.
    clocks = tuple(text for clock, text in zip(CLOCKS, image.clocks, strict=True) if clock != "ContentTime")
    return replace(image, path=Path(), instance_uid="", instance_number=None, clocks=clocks, pixels=pixels), digest
