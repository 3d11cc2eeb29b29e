"""Options that the studies of a package share, and how one is made."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import progress
from volprep_cli.outputs import require_new

if TYPE_CHECKING:
    from volprep_formats.record import Record

Output = Annotated[
    Path, typer.Option("--output", "-o", help="Folder to write: a page, and its data as JSON.", metavar="FOLDER")
]
Source = Annotated[
    Path | None,
    typer.Option(
        help="The scan, or the scene, that the package was made from; if not given, PACKAGE.origin.json names it.",
        metavar="PATH",
    ),
]
Size = Annotated[
    int | None,
    typer.Option(min=16, max=4096, help="Width and height of the pictures; the scene's by default.", metavar="N"),
]


def make_study(name: str, package: Path, output: Path, *, source: Path | None, size: int | None) -> "Record":
    """Make the study with this name, write it to the folder `output`, and return its data."""
    from volprep_formats.installation import require_extra

    require_extra("validate")
    require_new(output, force=False)
    from volprep.lab.studies import STUDIES, write_study

    with progress() as watcher:
        return write_study(STUDIES[name], package, output, watcher, source=source, picture_size=size)
