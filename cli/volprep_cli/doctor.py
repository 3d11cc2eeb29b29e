"""volprep doctor: what this machine has of what volprep needs, and how to get the rest."""

from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import print_json, print_line
from volprep_formats.diagnostics import ExitStatus, VolprepError

if TYPE_CHECKING:
    from volprep.doctor import Fact


def doctor(
    as_json: Annotated[bool, typer.Option("--json", help="Print the same as JSON.")] = False,
) -> None:
    """Print which of the things that volprep needs this machine has.

    There is one line for each component, with how to get a missing one. For each class of devices, all formats, filters
    and sizes of textures that its packages may need are drawn on this driver and read back: offered is not yet drawn
    right. Devices have a profile of their own; --json says where each of its numbers comes from.

    OK: it is here. missing: without it no scan becomes a validated package. no: you lose only what the line says.

    Exit status 0: everything needed is here. 8: something is missing.
    """
    from volprep.doctor import examine

    examination = examine()
    if as_json:
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
