"""volprep zip: the single-file form of a package."""

from pathlib import Path
from typing import Annotated

import typer

from volprep_cli.console import Json, bytes_text, print_json, print_line, progress
from volprep_formats.diagnostics import VolprepError

Package = Annotated[Path, typer.Argument(help="Package.", metavar="PACKAGE")]
Output = Annotated[
    Path | None, typer.Option("-o", "--output", help="Where the file goes; if not given, PACKAGE.zip.", metavar="FILE")
]
Force = Annotated[bool, typer.Option("--force", help="Replace a file that exists.")]


def zip_package(package: Package, output: Output = None, *, force: Force = False, as_json: Json = False) -> None:
    """Write a package as one file: a zip that holds its files as they are, for apps that map it into memory.

    Verbs that read packages read this file, too. Unzipping it gives the folder back. Textures are stored as they are.
    """
    from volprep.validation.whole import open_whole
    from volprep_formats.output import new_file, output_errors, require_place
    from volprep_formats.package.storage.files import MANIFEST
    from volprep_formats.package.storage.single_file import write_single_file

    target = output or package.resolve().with_name(f"{package.resolve().name}.zip")
    with output_errors(target):
        if target.is_dir() or (target.exists() and not force):
            raise VolprepError("VP1251", path=target)
    require_place(target)
    whole = open_whole(package)
    if not package.is_dir():
        raise VolprepError("VP4044", path=package)
    names = [MANIFEST, *(record.path for record in whole.manifest.files)]
    with progress() as watcher, new_file(target) as file:
        write_single_file(package, names, file, watcher)
    size = target.stat().st_size
    if as_json:
        print_json({"file": str(target), "files": len(names), "size_bytes": size})
    else:
        print_line(f"{target}: {len(names)} files, {bytes_text(size)}")
