"""Names and colours of labels: built-in tables of well-known programs, and tables beside a label map or inside it."""

from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.label_tables.nifti import table_text
from volprep_formats.label_tables.parse import parse_table
from volprep_formats.label_tables.table import LABEL_TABLES, LabelEntry, LabelTable
from volprep_formats.path_text import path_of_text
from volprep_formats.regular_files import is_there, read_regular

_SERIES = ((1000, 36, "ctx-lh-", (2000, 3000, 4000)), (11100, 76, "ctx_lh_", (12100, 13100, 14100)))
"""FreeSurfer numbers the parts of the left cortex from here on. The right cortex, and the white matter below both,
follow at fixed distances."""
_COMPANIONS = (".txt", ".tsv", ".csv", ".ctbl", ".lut", ".label", ".xml", "_LUT.txt", "-labels.txt", "_labels.txt")


@cache
def built_in(name: str) -> LabelTable:
    """Return a built-in table. Raises KeyError for another name."""
    if name not in LABEL_TABLES:
        raise KeyError(name)
    text = (files(__name__) / "data" / f"{name}.txt").read_text(encoding="utf-8")
    rows = [line.split(" ", 2) for line in text.splitlines() if not line.startswith("#")]
    entries = [LabelEntry(int(number), label, f"#{colour}") for number, colour, label in rows]
    if name == "freesurfer":
        entries += [label for series in _SERIES for label in _derived(entries, *series)]
    return LabelTable(name, tuple(sorted(entries, key=lambda entry: entry.number)))


def _derived(
    entries: list[LabelEntry], first: int, count: int, prefix: str, starts: tuple[int, ...]
) -> list[LabelEntry]:
    """Make the entries of the right cortex and of both kinds of white matter from the left cortex."""
    right, white, white_right = starts
    made = []
    for entry in entries:
        place, rest = entry.number - first, entry.name.removeprefix(prefix)
        if not 0 <= place < count:
            continue
        # The table of Desikan's parts inverts the colours of white matter, that of Destrieux's keeps them.
        inverted = f"#{0xFFFFFF - int(entry.colour[1:], 16):06x}" if first == _SERIES[0][0] else entry.colour
        for start, kind, colour in (
            (right, prefix.replace("lh", "rh"), entry.colour),
            (white, prefix.replace("ctx", "wm"), inverted),
            (white_right, prefix.replace("ctx", "wm").replace("lh", "rh"), inverted),
        ):
            made.append(replace(entry, number=start + place, name=kind + rest, colour=colour))
    return made


def read_label_table(path: Path) -> LabelTable:
    """Read a table that another program wrote, as a file or inside a NIfTI file.

    Raises VP1300 for a file that cannot be read or is not a table.
    """
    try:
        entries = parse_table(table_text(path) or read_regular(path).decode("utf-8", "replace"))
    except OSError as error:
        raise VolprepError("VP1300", path=path, problem=error.strerror or error) from error
    if not entries:
        raise VolprepError("VP1300", path=path, problem="it has no lines of number, name and colour")
    return LabelTable(path.name, tuple(entries))


def table_of(name_or_path: str, base: Path = Path()) -> LabelTable:
    """Return the built-in table of this name, or read the file; a relative path starts at `base`.

    Raises VP1300 for a file that cannot be read or is not a table.
    """
    if name_or_path in LABEL_TABLES:
        return built_in(name_or_path)
    return read_label_table(base / path_of_text(name_or_path))


def companion_table(scan: Path) -> Path | None:
    """Return the label table beside a scan under the same name, the scan itself if it has one inside, or None.

    For NAME.nii.gz that is NAME.nii.txt, NAME.txt, NAME.tsv, NAME.ctbl and so on. Such files are not opened.
    """
    name = scan.name
    stems = [name, name.removesuffix(".gz"), Path(name.removesuffix(".gz")).stem]
    for stem in dict.fromkeys(stems):
        for ending in _COMPANIONS:
            candidate = scan.with_name(stem + ending)
            if candidate != scan and is_there(candidate):
                return candidate
    return scan if table_text(scan) else None
