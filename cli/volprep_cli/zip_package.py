"""volprep zip: the single-file form of a package."""

from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Literal

import typer

from volprep_cli.console import bytes_text, print_done, progress
from volprep_cli.outputs import Force, Package, require_new
from volprep_formats.diagnostics import VolprepError

Output = Annotated[
    Path | None, typer.Option("-o", "--output", help="File to write; if not given, PACKAGE.zip.", metavar="FILE")
]
Texels = Annotated[
    Literal["as-is", "zstd", "plain"],
    typer.Option(
        "--texels",
        help="zstd: compress textures with Zstandard, where that saves at least a tenth. plain: not compressed. "
        "as-is: as in PACKAGE.",
    ),
]


def zip_package(package: Package, output: Output = None, *, texels: Texels = "as-is", force: Force = False) -> None:
    """Write a package as one zip file, which apps can map into memory.

    All verbs that read packages also read this file. Unzipping it gives the folder back. --texels zstd makes it smaller
    for web pages; formats/c/volpkg.h, which uses textures in place, needs --texels plain.
    """
    from volprep.validation.checks.consistency import open_whole
    from volprep_formats.output import new_file, require_place
    from volprep_formats.package.storage.files import MANIFEST
    from volprep_formats.package.storage.single_file import write_single_file
    from volprep_formats.package.transport import write_converted

    target = output or package.resolve().with_name(f"{package.resolve().name}.zip")
    require_new(target, force=force and not target.is_dir())
    require_place(target)
    whole = open_whole(package)
    if not package.is_dir() and texels == "as-is":
        raise VolprepError("VP4044", path=package)
    with progress() as watcher, ExitStack() as stack:
        folder, names = package, [MANIFEST, *(record.path for record in whole.manifest.files)]
        if texels != "as-is":
            beside = TemporaryDirectory(prefix=f".{target.name}.", dir=target.resolve().parent)
            folder = Path(stack.enter_context(beside))
            names = write_converted(whole, texels, folder, watcher)
        write_single_file(folder, names, stack.enter_context(new_file(target)), watcher)
    size = target.stat().st_size
    told = f"{target}: {len(names)} files, {bytes_text(size)}"
    print_done(told, file=str(target), files=len(names), size_bytes=size)
