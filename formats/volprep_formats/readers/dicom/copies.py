"""Copies of DICOM images: files that hold the same image again, as two exports of one study do."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.header import SliceImage
from volprep_formats.readers.dicom.value import value_of


def without_copies(images: Sequence[SliceImage]) -> tuple[SliceImage, ...]:
    """Return the images without those that have UID, header and pixels of an earlier one. Only likely ones are read."""
    groups: dict[tuple[str, int | None], list[SliceImage]] = {}
    for image in images:
        groups.setdefault((image.instance_uid, image.number), []).append(image)
    copies = set()
    for (uid, _), group in groups.items():
        if not uid or len(group) == 1:
            continue
        seen = set()
        for image in group:
            content = _content(image)
            if content is not None and content in seen:
                copies.add(id(image))
            seen.add(content)
    return tuple(image for image in images if id(image) not in copies)


def _content(image: SliceImage) -> tuple[SliceImage, bytes] | None:
    """Return the header without places of files, and a digest of the stored pixels; None if they cannot be read."""
    if image.pixels is None or image.problem is not None:
        return None
    try:
        digest = hashlib.sha256(value_of(image.pixels)).digest()
    except (VolprepError, OSError, ValueError):
        return None
    pixels = replace(image.pixels, path=Path(), offset_bytes=0)
    return replace(image, path=Path(), pixels=pixels), digest
