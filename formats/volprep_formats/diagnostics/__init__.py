"""Every message of volprep, in one catalogue: permanent code, exit status, problem, remedy.

There is one file of entries for each thousand.
"""

from volprep_formats.diagnostics import (
    batch,
    defects,
    geometry,
    light,
    machine,
    package,
    recognition,
    rendering,
    scene,
    segments,
    sources,
    validation,
)
from volprep_formats.diagnostics.entry import Diagnostic, ExitStatus
from volprep_formats.diagnostics.shown import Lines, SafeText, shown

__all__ = ["CATALOGUE", "Diagnostic", "ExitStatus", "Lines", "SafeText", "VolprepError"]

_FILES = (
    sources,
    recognition,
    segments,
    geometry,
    scene,
    light,
    package,
    rendering,
    validation,
    machine,
    batch,
    defects,
)
CATALOGUE: dict[str, Diagnostic] = dict(sorted(item for file in _FILES for item in file.ENTRIES.items()))


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
