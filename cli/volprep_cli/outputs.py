"""Options of several verbs: a package, and --force, which allows replacing files."""

from pathlib import Path
from typing import Annotated

import typer

from volprep_formats.output import output_errors, taken

Force = Annotated[bool, typer.Option("--force", help="Replace files that exist; without it they are an error.")]
Package = Annotated[Path, typer.Argument(help="Package.", metavar="PACKAGE")]


def require_new(path: Path, *, force: bool) -> None:
    """Raise VP1251 or VP1254 if `path` exists and `force` is not given, VP4020 if its folder may not be entered."""
    with output_errors(path):
        if path.exists() and not force:
            raise taken(path)
