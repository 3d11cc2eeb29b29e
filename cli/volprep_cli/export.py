"""volprep export: write a level of a package in a format that other programs read."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from volprep_cli.console import Json, print_json, progress
from volprep_cli.inspect import PackageFolder

if TYPE_CHECKING:
    from volprep_formats.progress import Progress
    from volprep_formats.source import VolumeSource

File = Annotated[
    Path,
    typer.Argument(
        help="File to write: .nii, .nii.gz, .nrrd, .raw or .vdb. A name without an ending becomes a DICOM series.",
        metavar="FILE",
    ),
]
Level = Annotated[int | None, typer.Option(min=0, help="Level to write; the finest if not given.")]
Channel = Annotated[
    str | None, typer.Option(help="Channel to write, by name or number, of a package of several.", metavar="NAME")
]
Values = Annotated[
    Literal["physical", "stored"],
    typer.Option(help="physical: as in the scan, by a slope where the format has one. stored: the codes alone."),
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
    from volprep_formats.diagnostics import VolprepError  # noqa: PLC0415 - keeps volprep --help fast
    from volprep_formats.readers.volpkg import open_level  # noqa: PLC0415
    from volprep_formats.writers.values import StoredValues  # noqa: PLC0415

    kind = _kind(file)
    if file.is_dir() if kind != "dicom" else file.exists():
        raise VolprepError("VP1251", path=file)
    for target in (file, file.with_name(f"{file.name}.toml")) if kind == "raw" else (file,):
        if target.exists() and not force:
            raise VolprepError("VP1251", path=target)
    with open_level(package, level, channel) as source, progress() as watcher:
        _write(StoredValues(source) if values == "stored" else source, file, kind, watcher)
        shape_zyx = source.info.grid.shape_zyx
    if as_json:
        print_json({"file": str(file), "format": kind, "shape_zyx": list(shape_zyx), "values": values})
    else:
        print(f"{file}: {'×'.join(map(str, shape_zyx))} voxels, {values} values, {kind}")


def _kind(file: Path) -> str:
    from volprep_formats.diagnostics import VolprepError  # noqa: PLC0415 - keeps volprep --help fast

    endings = {".nii": "nifti", ".nrrd": "nrrd", ".raw": "raw", ".vdb": "vdb", "": "dicom"}
    ending = file.suffix.lower()
    if file.name.lower().endswith(".nii.gz"):
        return "nifti"
    if ending not in endings:
        raise VolprepError("VP1252", path=file)
    return endings[ending]


def _write(source: "VolumeSource", file: Path, kind: str, watcher: "Progress") -> None:
    from volprep_formats.writers.values import PhysicalValues  # noqa: PLC0415 - keeps volprep --help fast

    if kind == "dicom":
        from volprep_formats.dicom_series import write_series  # noqa: PLC0415

        write_series(source, file, progress=watcher)
    elif kind == "vdb":
        from volprep_formats.vdb_file import write_vdb  # noqa: PLC0415

        write_vdb(source, file, watcher)
    elif kind == "nifti":
        from volprep_formats.writers import nifti  # noqa: PLC0415

        nifti.write(source, file, watcher)
    elif kind == "nrrd":
        from volprep_formats.writers import nrrd  # noqa: PLC0415

        nrrd.write(PhysicalValues(source), file, watcher)
    else:
        from volprep_formats.writers import raw  # noqa: PLC0415

        raw.write(PhysicalValues(source), file, watcher)
