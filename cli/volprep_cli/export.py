"""volprep export: write a level of a package in a format that other programs read."""

from importlib import import_module
from pathlib import Path
from typing import Annotated, Literal

import typer

from volprep_cli.console import Json, print_json, print_line, progress, voxels_text
from volprep_cli.inspect import PackageFolder

File = Annotated[
    Path,
    typer.Argument(
        help="File to write: .nii, .nii.gz, .nrrd, .raw or .vdb. A name without an ending becomes a DICOM series.",
        metavar="FILE",
    ),
]
Level = Annotated[int | None, typer.Option(min=0, help="Level to write; if not given, the finest.", metavar="NUMBER")]
Channel = Annotated[
    str | None, typer.Option(help="Name or number of the channel to write, if the package has several.", metavar="NAME")
]
Values = Annotated[
    Literal["physical", "stored"],
    typer.Option(help="physical: values as in the scan, by a slope if the format has one. stored: the codes."),
]
Force = Annotated[bool, typer.Option("--force", help="Replace a file that exists.")]


def export(
    package: PackageFolder,
    file: File,
    level: Level = None,
    channel: Channel = None,
    values: Values = "physical",
    *,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a level of a package as NIfTI, NRRD, raw, OpenVDB or a DICOM series.

    Of a draft, level 0 is the scan as it was imported. A raw file gets a sidecar with its shape, FILE.toml.
    """
    from volprep_formats.diagnostics import VolprepError
    from volprep_formats.output import output_errors, require_place
    from volprep_formats.readers.volpkg import open_level
    from volprep_formats.writers.values import StoredValues

    kind = _kind(file)
    with output_errors(file):
        if file.is_dir() if kind != "dicom" else file.exists():
            raise VolprepError("VP1251", path=file)
        for target in (file, file.with_name(f"{file.name}.toml")) if kind == "raw" else (file,):
            if target.exists() and not force:
                raise VolprepError("VP1251", path=target)
            if kind != "dicom":
                require_place(target)
    with open_level(package, level, channel) as source, progress() as watcher:
        writer = import_module(f"volprep_formats.writers.{kind}")
        writer.write(StoredValues(source) if values == "stored" else source, file, watcher)
        shape_zyx = source.info.grid.shape_zyx
    if as_json:
        print_json({"file": str(file), "format": kind, "shape_zyx": list(shape_zyx), "values": values})
    else:
        print_line(f"{file}: {voxels_text(shape_zyx)} voxels, {values} values, {kind}")


def _kind(file: Path) -> str:
    """Name of the writer, which is a module of `volprep_formats.writers`."""
    from volprep_formats.diagnostics import VolprepError

    endings = {".nii": "nifti", ".nrrd": "nrrd", ".raw": "raw", ".vdb": "vdb", "": "dicom"}
    ending = file.suffix.lower()
    if file.name.lower().endswith(".nii.gz"):
        return "nifti"
    if ending not in endings:
        raise VolprepError("VP1252", path=file)
    return endings[ending]
