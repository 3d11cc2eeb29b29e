"""Every message of volprep, in one catalogue: permanent code, exit status, what is wrong, what to do.

The entries stand in one file for each thousand.
"""

from volprep_formats.diagnostics import (
    batch,
    defects,
    geometry,
    machine,
    package,
    rendering,
    scene,
    sources,
    validation,
)
from volprep_formats.diagnostics.entry import Diagnostic, ExitStatus
from volprep_formats.diagnostics.shown import Lines, shown

__all__ = ["CATALOGUE", "Diagnostic", "ExitStatus", "Lines", "VolprepError"]

CATALOGUE: dict[str, Diagnostic] = {
    **sources.ENTRIES,
    **geometry.ENTRIES,
    **scene.ENTRIES,
    **package.ENTRIES,
    **rendering.ENTRIES,
    **validation.ENTRIES,
    **machine.ENTRIES,
    **batch.ENTRIES,
    **defects.ENTRIES,
}


class VolprepError(Exception):
    """An error with a permanent code. `fields` fill the catalogue's texts; its message is code, summary, remedy.

    Fields may hold foreign text: it is escaped and cut here, for every message. `Lines` are fields of several lines.
    """

    def __init__(self, code: str, **fields: object) -> None:
        entry = CATALOGUE[code]
        self.code = code
        self.fields = fields
        self.status = entry.status
        texts = {name: shown(value) for name, value in fields.items()}
        self.summary = entry.summary.format(**texts)
        self.remedy = entry.remedy.format(**texts)
        super().__init__(f"{code} {self.summary}. {self.remedy}")
