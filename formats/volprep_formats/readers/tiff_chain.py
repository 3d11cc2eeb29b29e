"""Number of pages of a TIFF file, counted along its chain of directories.

A library that meets a broken link takes it for the end, and a stack that was cut off for a shorter one. Source: TIFF
revision 6.0, section 2; for files beyond 4 GB, the BigTIFF design of the libtiff project.
"""

import struct
from pathlib import Path

_BIG = 43


def count_pages(path: Path, most: int) -> int | None:
    """Number of directories, at most `most` + 1; None when a link of the chain leads nowhere or back."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(16)
        order = "<" if head[:2] == b"II" else ">"
        is_big = len(head) == 16 and struct.unpack_from(order + "H", head, 2)[0] == _BIG
        count_form, link_form, entry_bytes = (
            (order + "Q", order + "Q", 20) if is_big else (order + "H", order + "I", 12)
        )

        def number(form: str, offset: int) -> int:
            file.seek(offset)
            return int(struct.unpack(form, file.read(struct.calcsize(form)))[0])

        seen: set[int] = set()
        try:
            at = number(link_form, 8 if is_big else 4)
            while at and len(seen) <= most:
                entries = number(count_form, at)
                after = at + struct.calcsize(count_form) + entries * entry_bytes
                if at in seen or after > size:
                    return None
                seen.add(at)
                at = number(link_form, after)
        except struct.error:  # cut off
            return None
    return len(seen)
