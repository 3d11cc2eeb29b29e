"""Options of several verbs: a package, and --force, which allows replacing files."""

import os
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


def default_package(source: Path) -> Path:
    """Return the package of a scan or scene in the current folder: head.volpkg for head.nii.gz, ct.volpkg for ct/."""
    source = Path(os.path.abspath(source))  # noqa: PTH100 - resolve would follow a link to a file of another name
    name = source.name if source.is_dir() else Path(source.name.removesuffix(".gz")).stem
    return Path(f"{name}.volpkg")
