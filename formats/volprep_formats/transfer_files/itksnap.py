"""Label descriptions of ITK-SNAP (.txt): a line for each label.

It has number, red, green, blue (0 to 255), alpha (0 to 1), whether the label is visible, whether it has a mesh, and its
name. Each label owns the values nearest to it.
"""

from volprep_formats.transfer_files.points import MOST_POINTS, FilePoint, number

_FIELDS = 7
_LARGEST_LABEL = 65535
_Label = tuple[tuple[float, float, float], float]
_CLEAR = 0.0


def read_labels(text: str) -> list[FilePoint]:
    """Read the points. Raises ValueError with a description of the problem."""
    labels: dict[int, _Label] = {}
    for row, line in enumerate(text.splitlines(), start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            label, entry = _label(line, row)
            if label in labels:
                msg = f"line {row}: label {label} occurs twice"
                raise ValueError(msg)
            labels[label] = entry
    if len(labels) > MOST_POINTS:
        msg = f"{len(labels)} labels, more than {MOST_POINTS}"
        raise ValueError(msg)
    if not labels:
        msg = "no labels"
        raise ValueError(msg)
    points: list[FilePoint] = []
    for label, (colour, opacity) in sorted(labels.items()):
        # Where no label is beside it, its opacity ends at its border.
        if label - 1 not in labels:
            points.append(FilePoint(label - 0.5, colour, _CLEAR))
        points += [FilePoint(label - 0.5, colour, opacity), FilePoint(label + 0.5, colour, opacity)]
        if label + 1 not in labels:
            points.append(FilePoint(label + 0.5, colour, _CLEAR))
    return points


def _label(line: str, row: int) -> tuple[int, _Label]:
    fields = line.split(maxsplit=_FIELDS)
    if len(fields) < _FIELDS:
        msg = f"line {row}: {len(fields)} fields, expected {_FIELDS} and a name"
        raise ValueError(msg)
    label, red, green, blue, alpha, visible, _ = (number(field) for field in fields[:_FIELDS])
    if not label.is_integer() or not 0 <= label <= _LARGEST_LABEL:
        msg = f"line {row}: {fields[0][:40]} is no label from 0 to {_LARGEST_LABEL}"
        raise ValueError(msg)
    if not all(0 <= value <= 255 for value in (red, green, blue)) or not 0 <= alpha <= 1:
        msg = f"line {row}: colours go from 0 to 255, alpha from 0 to 1"
        raise ValueError(msg)
    return int(label), ((red / 255, green / 255, blue / 255), alpha if visible else _CLEAR)
