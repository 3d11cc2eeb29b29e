"""volprep doctor: check what volprep needs on this machine, and explain how to install missing programs."""

from typing import TYPE_CHECKING

import typer

from volprep_cli.console import print_json, print_line, wants_json
from volprep_formats.diagnostics import ExitStatus, VolprepError

if TYPE_CHECKING:
    from volprep.doctor import Fact


def doctor() -> None:
    """Check that this machine has what volprep needs.

    Prints one line for each component, with how to get a missing one. Drivers advertise textures that they draw wrong:
    each format, filter and size that the packages of a profile may need is therefore drawn and read back. For each
    device with a profile of its own, a line gives its limits; --json gives the source of each number.

    OK: it is here. missing: volprep cannot build or draw packages without it. no: only what the line names is lost,
    such as a command whose extra is not installed.

    Exit status 0: this machine can build and draw packages. 8: something is missing.
    """
    from volprep.doctor import examine

    examination = examine()
    if wants_json():
        print_json(examination.model_dump(mode="json"))
        raise typer.Exit(ExitStatus.OK if examination.ready else ExitStatus.MACHINE)
    for fact in examination.facts:
        print_line(_line(fact))
    if not examination.ready:
        missing = [f"{fact.topic} {fact.name}" for fact in examination.facts if fact.needed and not fact.found]
        raise VolprepError("VP7001", missing=", ".join(missing))


def _line(fact: "Fact") -> str:
    found = "OK" if fact.found else "missing" if fact.needed else "no"
    remedy = f". {fact.remedy}" if fact.remedy else ""
    return f"{found:8}{fact.topic + ' ' + fact.name:34}{fact.detail}{remedy}"
