"""Every message that volprep can give, in one catalogue: permanent code, exit status, what is wrong, what to do."""

from dataclasses import dataclass
from enum import IntEnum


class ExitStatus(IntEnum):
    """Exit statuses of the command line. They never change their meaning."""

    OK = 0
    """The command did what it was asked to do."""
    TOLERANCE = 1
    """The package is sound, but a picture is further from the truth than the scene allows."""
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


CATALOGUE: dict[str, Diagnostic] = {
    # VP1xxx sources and readers
    "VP1001": Diagnostic(
        ExitStatus.SOURCE, "{path}: no such file or folder", "Check the path in [source] of the scene."
    ),
    "VP1002": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: no reader knows this format",
        "Set source.format, one of: {known}.",
    ),
    # VP3xxx scene, profile, plan
    "VP3001": Diagnostic(ExitStatus.SCENE, "{path}: cannot read the scene: {error}", "Check the path."),
    "VP3002": Diagnostic(ExitStatus.SCENE, "{path}: not a TOML file: {error}", "Mend the line that the message names."),
    "VP3003": Diagnostic(
        ExitStatus.SCENE,
        "{path}: {problems}",
        "Mend these keys; sample_specs holds scenes to start from.",
    ),
    "VP3010": Diagnostic(
        ExitStatus.SCENE,
        "there is no profile {name}",
        "Name one of: {known}; or give the path of a profile file that ends in .toml.",
    ),
    "VP3011": Diagnostic(ExitStatus.SCENE, "{path}: cannot read the profile: {error}", "Check the path and the file."),
    "VP3012": Diagnostic(
        ExitStatus.SCENE, "{path}: {problems}", "Mend these keys; volprep/profiles holds profiles to start from."
    ),
    # VP4xxx package
    # VP5xxx rendering
    # VP6xxx validation and report
    # VP7xxx machine
    # VP9xxx defects
    "VP9001": Diagnostic(
        ExitStatus.INTERNAL,
        "internal error: {error}",
        "This is a defect in volprep. Run again with VOLPREP_TRACEBACK=1 and report what it prints.",
    ),
}


class VolprepError(Exception):
    """An error with a permanent code. `fields` fill the catalogue's texts; its message is code, summary, remedy."""

    def __init__(self, code: str, **fields: object) -> None:
        entry = CATALOGUE[code]
        self.code = code
        self.fields = fields
        self.status = entry.status
        self.summary = entry.summary.format(**fields)
        self.remedy = entry.remedy.format(**fields)
        super().__init__(f"{code} {self.summary}. {self.remedy}")
