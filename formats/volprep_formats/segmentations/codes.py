"""Names of codes, from the tables of DICOM PS3.16 that pydicom has. The meaning in a file is free text."""

import re
from collections.abc import Sequence
from functools import cache

from volprep_formats.segmentations.records import Code

_REMARK = re.compile(r" \([^)]*\)$")
"""Kind of a concept behind its name: "Liver structure (body structure)"."""


def coded(scheme: str, values: Sequence[str], meanings: Sequence[str]) -> Code:
    """Return a code and its modifiers as one; its meaning is that of a table, or else what the file says."""
    names = [name for value in values if (name := name_of_code(scheme, value)) is not None]
    is_public = len(names) == len(values)
    return Code(scheme, "+".join(values), ", ".join(names if is_public else meanings), is_public)


def name_of_code(scheme: str, value: str) -> str | None:
    """Return the name of a code, the shortest of several; None for one that is in no table."""
    if scheme == "SRT":
        # Codes of SNOMED before 2020.
        from pydicom.sr._snomed_dict import mapping  # noqa: PLC0415 - takes half a second to load

        scheme, value = "SCT", mapping["SRT"].get(value, "")
    return _names_of(scheme).get(value)


@cache
def _names_of(scheme: str) -> dict[str, str]:
    """Return the name of each code of a vocabulary, empty for an unknown one."""
    from pydicom.sr.codedict import codes  # noqa: PLC0415 - takes half a second to load

    if scheme not in codes.schemes():
        return {}
    known = [(code.value, _REMARK.sub("", code.meaning)) for code in getattr(codes, scheme).concepts.values()]
    # The last one of a dict stays.
    return dict(sorted(known, key=lambda value: len(value[1]), reverse=True))
