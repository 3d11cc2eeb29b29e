"""An entry of the catalogue of diagnostics, and the exit statuses of the command line."""

import re
from dataclasses import dataclass
from enum import IntEnum


class ExitStatus(IntEnum):
    """Exit statuses of the command line. They never change their meaning."""

    OK = 0
    """The command succeeded."""
    TOLERANCE = 1
    """The package is sound, but a picture is farther from the truth than the scene allows."""
    USAGE = 2
    """The command line itself is wrong."""
    SOURCE = 3
    """The source cannot be read, or its geometry cannot be trusted."""
    SCENE = 4
    """The scene or the profile is wrong, or the scene does not fit the profile."""
    PACKAGE = 5
    """The package is damaged, of another version, or in the wrong state."""
    OUTPUT = 6
    """The output cannot be written."""
    RENDER = 7
    """OpenGL ES failed, or a limit of the profile would be broken."""
    MACHINE = 8
    """A part that this command needs is missing on this machine."""
    INTERNAL = 70
    """A defect in volprep."""


@dataclass(frozen=True)
class Diagnostic:
    """One entry of the catalogue. `summary` and `remedy` are format strings over the fields of the error."""

    status: ExitStatus
    summary: str
    remedy: str


def entries(text: str) -> dict[str, Diagnostic]:
    """Parse entries: a line of code, status and summary, then the remedy in indented lines."""
    parsed = {}
    for entry in re.split(r"^(?=VP)", text, flags=re.MULTILINE)[1:]:
        head, *remedy = entry.splitlines()
        code, status, summary = head.split(" ", 2)
        parsed[code] = Diagnostic(ExitStatus[status], summary, " ".join(line.strip() for line in remedy))
    return parsed
