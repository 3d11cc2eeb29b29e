"""Parse label tables of other programs from their text, whatever the name of the file.

Known are the colour tables of FreeSurfer and 3D Slicer (number, name, red, green, blue, alpha; Slicer also as CSV), the
label descriptions of ITK-SNAP, dseg.tsv of BIDS, the atlas XML of FSL and SPM, the LabelTable of Caret and GIFTI, and
plain lists of number and name, as AAL and Talairach have. Each text is untrusted input.
"""

import csv
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from html import unescape

from volprep_formats.label_tables.table import LabelEntry, made_colour

MOST_LABELS = 65535
_LONGEST_NAME = 200
_MOST_DIGITS = 9
_LONGEST_LINE = 1000
_MATCHING = 0.8
"""Share of the lines of a table that must be entries: notes that begin with a number are not a table."""

_ITKSNAP = re.compile(r'(\d+)\s+(\d+)\s+(\d+)\s+(\d+)\s+([\d.]+)\s+([01])\s+([01])\s+"(.*)"$')
_COLOURS = re.compile(r"(\d+)\s+(\S.*?)\s+(\d{1,3})\s+(\d{1,3})\s+(\d{1,3})(?:\s+(\d{1,3})(?:\s.*)?)?$")
_PLAIN = re.compile(r"(\d+)(?:\s*[,;:]\s*|\s+)(\S.*?)(?:\s+\d+)?$")
_FSL = re.compile(r'<label\s[^>]*index="(\d+)"[^>]*>([^<]*)</label>')
_SPM = re.compile(r"<index>\s*(\d+)\s*</index>\s*<name>([^<]*)</name>")
_CARET = re.compile(r"<Label\s([^<>]*)>(?:<!\[CDATA\[([^\]]*)\]\]>|([^<]*))</Label>")
_ATTRIBUTE = re.compile(r'(\w+)="([^"]*)"')


def parse_table(text: str) -> list[LabelEntry]:
    """Return the entries of a table, ascending; an empty list if the text is not a table."""
    is_xml = any(sign in text for sign in ("<label", "<index>", "<Label "))
    found = _from_xml(text) if is_xml else _from_columns(text) or _from_lines(text)
    entries = {entry.number: entry for entry in found if 0 < entry.number <= MOST_LABELS}
    return [entries[number] for number in sorted(entries)]


def _entry(number: str, name: str, rgb: tuple[int, int, int] | None = None, opacity: float = 1.0) -> LabelEntry:
    colour = made_colour(int(number)) if rgb is None else "#" + "".join(f"{min(channel, 255):02x}" for channel in rgb)
    return LabelEntry(int(number), name.strip().strip('"')[:_LONGEST_NAME], colour, min(opacity, 1.0))


def _from_xml(text: str) -> list[LabelEntry]:
    if caret := _CARET.findall(text):
        return [
            entry for attributes, plain, escaped in caret if (entry := _caret(attributes, plain or unescape(escaped)))
        ]
    pairs = _FSL.findall(text) or _SPM.findall(text)
    # A probabilistic atlas counts its maps from 0; the label image made from it has 0 for "no label".
    shift = 1 if _FSL.search(text) and re.search(r"<type>\s*Probabili", text) else 0
    return [_entry(str(int(number) + shift), unescape(name)) for number, name in pairs]


def _caret(attributes: str, name: str) -> LabelEntry | None:
    told = dict(_ATTRIBUTE.findall(attributes))
    number = told.get("Key", "")
    shares = []
    for part in ("Red", "Green", "Blue"):
        with suppress(ValueError):
            shares.append(float(told.get(part, "")))
    if not number.isdecimal() or len(number) > _MOST_DIGITS:
        return None
    if len(shares) != 3 or not all(0.0 <= share <= 1.0 for share in shares):
        return _entry(number, name)
    red, green, blue = (round(255 * share) for share in shares)
    return _entry(number, name, (red, green, blue))


def _from_columns(text: str) -> list[LabelEntry]:
    """Read a table with named columns: dseg.tsv of BIDS, or Slicer's CSV."""
    first = text.split("\n", 1)[0]
    rows = csv.DictReader(text.splitlines(), delimiter="\t" if "\t" in first else ",")
    columns = {(name or "").strip().lower(): name for name in rows.fieldnames or ()}
    number = columns.get("index") or columns.get("labelvalue")
    name = columns.get("name")
    if number is None or name is None:
        return []
    return [
        _entry(row[number].strip(), row[name] or "", _row_colour(row, columns))
        for row in rows
        if (row[number] or "").strip().isdecimal()
    ]


def _row_colour(row: dict[str, str], columns: dict[str, str]) -> tuple[int, int, int] | None:
    hexadecimal = re.fullmatch(r"#?([0-9a-fA-F]{6})", (row.get(columns.get("color", "")) or "").strip())
    if hexadecimal:
        red, green, blue = bytes.fromhex(hexadecimal[1])
        return red, green, blue
    parts = [(row.get(columns.get(f"color_{letter}", "")) or "").strip() for letter in "rgb"]
    if not all(part.isdecimal() for part in parts):
        return None
    red, green, blue = (int(part) for part in parts)
    return red, green, blue


def _itksnap(line: re.Match[str]) -> LabelEntry:
    number, red, green, blue, alpha, visible, _, name = line.groups()
    opacity = float(alpha) if visible == "1" and alpha.count(".") <= 1 and alpha != "." else 0.0
    return _entry(number, name, (int(red), int(green), int(blue)), opacity)


def _coloured(line: re.Match[str]) -> LabelEntry:
    number, name, red, green, blue, _ = line.groups()
    # FreeSurfer writes an alpha of 0 for everything, so the column has no meaning.
    return _entry(number, name, (int(red), int(green), int(blue)))


def _plain(line: re.Match[str]) -> LabelEntry:
    return _entry(line[1], line[2])


_LINES: tuple[tuple[re.Pattern[str], Callable[[re.Match[str]], LabelEntry]], ...] = (
    (_ITKSNAP, _itksnap),
    (_COLOURS, _coloured),
    (_PLAIN, _plain),
)


def _from_lines(text: str) -> list[LabelEntry]:
    lines = list(_entries_of(text))
    for pattern, entry_of in _LINES:
        matches = [pattern.match(line) for line in lines]
        found = [entry_of(match) for match in matches if match]
        if len(found) >= max(2, _MATCHING * len(lines)):
            return found
    return []


def _entries_of(text: str) -> Iterator[str]:
    for line in text.splitlines():
        plain = line.strip()
        if plain and len(plain) <= _LONGEST_LINE and not plain.startswith(("#", "//", "%")):
            yield plain
