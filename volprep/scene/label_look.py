"""Transfer function of a label map: each label in its colour from a table of names and colours."""

from volprep.scene.points import ScenePoint
from volprep.scene.transfer import SceneTransfer
from volprep_formats.label_tables import table_of
from volprep_formats.label_tables.table import LabelTable, made_colour
from volprep_formats.source import SourceInfo

_OPACITY = 0.6
"""Opacity of a label along the hundredth part of the scan's diagonal, as in the preset "labels"."""
_SHARE = 0.01


def label_transfer(info: SourceInfo, table: str | None, largest: int) -> SceneTransfer:
    """Return a function over the codes 1 to `largest`, each in the colour of its label.

    `table` names a built-in table or a file; without one colours are made. Raises VP1300 for a file that is no table.
    """
    named = LabelTable("", ()) if table is None else table_of(table)
    numbers = info.label_numbers or tuple(range(largest + 1))
    points: list[ScenePoint] = []
    for code, number in enumerate(numbers[1 : largest + 1], 1):
        entry = named.entry(number) if table is not None else None
        colour = made_colour(code) if entry is None else entry.colour
        opacity = _OPACITY if entry is None else _OPACITY * entry.opacity
        if not points:
            points.append(ScenePoint(value=0.5, colour=colour, opacity=0.0))
        points += [ScenePoint(value=code + side, colour=colour, opacity=opacity) for side in (-0.5, 0.5)]
    return SceneTransfer(name="labels", points=tuple(points), reference_share=_SHARE)
