"""volprep export: write a level of a package in a format that other programs read."""

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from volprep_cli.console import print_done, print_note, progress, voxels_text
from volprep_cli.inspect import PackageFolder
from volprep_cli.outputs import Force, require_new

if TYPE_CHECKING:
    from volprep_formats.source import VolumeSource

File = Annotated[
    Path,
    typer.Argument(
        help="File to write. Values: .nii, .nii.gz, .nrrd, .raw, .vdb or .ome.zarr; a name without an ending becomes a "
        "DICOM series. Segments: .seg.nrrd, .nii or .nii.gz with --labels, .dcm with --series. Surfaces: .glb, .usdz, "
        ".ply, .stl. The voxels with their looks as glTF (draft): .glb with --volume. The looks alone: .json.",
        metavar="FILE",
    ),
]
Level = Annotated[
    int | None,
    typer.Option(
        min=0, help="Level to write; if not given, the finest one, or all levels of OME-Zarr.", metavar="NUMBER"
    ),
]
Channel = Annotated[
    str | None,
    typer.Option(
        help="Name or number of the channel to write, if the package has several. If not given, the default one, or "
        "all in OME-Zarr.",
        metavar="NAME",
    ),
]
Frame = Annotated[int, typer.Option(min=0, help="Frame of a time series, from 0 on.", metavar="NUMBER")]
Values = Annotated[
    Literal["physical", "stored"],
    typer.Option(help="physical: values as in the scan, by a slope if the format has one. stored: the codes."),
]
Labels = Annotated[
    bool, typer.Option("--labels", help="Write segments as labels with their names and colours, in place of values.")
]
Series = Annotated[
    Path | None,
    typer.Option(help="Folder of the DICOM series that segments in a .dcm file belong to.", metavar="FOLDER"),
]
Transfer = Annotated[
    str | None,
    typer.Option(
        help="Transfer function whose surface is written; if absent, the first, or all segments.", metavar="NAME"
    ),
]
Within = Annotated[
    float | None,
    typer.Option(
        min=0,
        help="Distance to which triangles of a surface are joined; a quarter of a voxel if absent.",
        metavar="MILLIMETRES",
    ),
]
Volume = Annotated[
    bool,
    typer.Option("--volume", help="Write the voxels into a .glb file, as the draft extension EXT_voxels has them."),
]
Draco = Annotated[bool, typer.Option("--draco", help="Compress a .glb file with Draco.")]


def export(
    package: PackageFolder,
    file: File,
    level: Level = None,
    channel: Channel = None,
    values: Values = "physical",
    *,
    frame: Frame = 0,
    series: Series = None,
    transfer: Transfer = None,
    within_mm: Within = None,
    draco: Draco = False,
    volume: Volume = False,
    labels: Labels = False,
    force: Force = False,
) -> None:
    """Write a level of a package as NIfTI, NRRD, raw, OpenVDB or a DICOM series, or all levels as OME-Zarr.

    Level 0 of a draft is the scan as imported. A raw file gets a sidecar FILE.toml with its shape. Volumes in colour
    become sRGB: bytes of three channels in OME-Zarr, RGB24 in NIfTI. A surface is where rays are half opaque, or each
    segment; the file holds its error against the volume. OME-Zarr and .glb hold the looks too.
    """
    _tell_frame(package, file, frame)
    if labels or series is not None or file.name.lower().endswith((".seg.nrrd", ".dcm")):
        from volprep_cli.export_labels import export_labels

        export_labels(package, file, level, channel, series, force=force)
        return
    if volume or file.suffix.lower() == ".json":
        from volprep_cli.export_looks import export_looks

        export_looks(package, file, level, channel, frame=frame, force=force)
        return
    if file.suffix.lower() in {".glb", ".usdz", ".ply", ".stl"}:
        from volprep_cli.export_surface import export_surface

        export_surface(package, file, level, transfer, within_mm, frame=frame, draco=draco, force=force)
        return
    from volprep_formats.output import output_errors, require_place, taken
    from volprep_formats.readers.volpkg import open_level
    from volprep_formats.writers.values import StoredValues

    kind = _kind(file)
    if kind == "ome_zarr":
        _export_levels(package, file, level, channel, values, frame=frame, force=force)
        return
    with output_errors(file):
        if file.is_dir() if kind != "dicom" else file.exists():
            raise taken(file)
        for target in (file, file.with_name(f"{file.name}.toml")) if kind == "raw" else (file,):
            require_new(target, force=force)
            if kind != "dicom":
                require_place(target)
    if kind == "nifti" and channel is None and values == "physical" and _export_colours(package, file, level):
        return
    channel = channel or _told_channel(package, file)
    with open_level(package, level, channel, frame) as source, progress() as watcher:
        writer = import_module(f"volprep_formats.writers.{kind}")
        writer.write(StoredValues(source) if values == "stored" else source, file, watcher)
        shape_zyx = source.info.grid.shape_zyx
    told = f"{file}: {voxels_text(shape_zyx)} voxels, {values} values, {kind}"
    print_done(told, file=str(file), format=kind, shape_zyx=list(shape_zyx), values=values)


def _tell_frame(package: Path, file: Path, frame: int) -> None:
    """Say which frame of a time series is written."""
    from volprep_formats.output import output_errors
    from volprep_formats.package.reader import Package

    # A folder that may not be entered comes before all faults of the package.
    with output_errors(file):
        file.exists()
    if frames := Package.open(package, allow_draft=True, frame=frame).manifest.frames:
        print_note(f"{file}: frame {frame} of {len(frames)}, from 0 on; --frame NUMBER writes another one")


def _told_channel(package: Path, file: Path) -> str:
    """Return the default channel, and say which one it is if the package has several."""
    from volprep_formats.package.channel_packages import channel_packages
    from volprep_formats.package.reader import Package

    names = [*channel_packages(Package.open(package, allow_draft=True))]
    if len(names) > 1:
        print_note(f"{file}: channel {names[0]} of {', '.join(names)}; --channel NAME writes another one")
    return names[0]


def _export_colours(package: Path, file: Path, level: int | None) -> bool:
    """Write a volume in colour as NIfTI; False if the package is not in colour."""
    from volprep_formats.package.reader import Package
    from volprep_formats.readers.volpkg import open_levels
    from volprep_formats.writers.colours import StraightColours, in_colour
    from volprep_formats.writers.nifti import write_colours

    if not in_colour(Package.open(package, allow_draft=True).manifest):
        return False
    levels = open_levels(package, level).levels
    with progress() as watcher:
        _, channels = next(levels)
        colours = StraightColours(channels)
        write_colours(colours, file, watcher)
    levels.close()
    shape_zyx = colours.info.grid.shape_zyx
    told = f"{file}: {voxels_text(shape_zyx)} voxels, sRGB colours, nifti"
    print_done(told, file=str(file), format="nifti", shape_zyx=list(shape_zyx), values="sRGB")
    return True


def _export_levels(
    package: Path, file: Path, level: int | None, channel: str | None, values: str, *, frame: int, force: bool
) -> None:
    """Write the levels of all channels, or of one, and the labels as OME-Zarr."""
    from volprep_formats.package.look import VolumeLooks, looks_of, of_channels
    from volprep_formats.package.reader import Package
    from volprep_formats.readers.volpkg import open_levels
    from volprep_formats.writers.colours import in_colour, straight_levels
    from volprep_formats.writers.ngff import ChannelLook, is_rotated
    from volprep_formats.writers.ome_zarr import check_target, write
    from volprep_formats.writers.package_labels import label_images

    check_target(file, replaces=force)
    opened = open_levels(package, level, channel, frame)
    looks = [ChannelLook.of(manifest) for manifest in opened.manifests]
    levels: Iterable[tuple[int, tuple[VolumeSource, ...]]] = opened.levels
    manifest = Package.open(package, allow_draft=True).manifest
    own: VolumeLooks | None = of_channels(looks_of(manifest), [look.channel for look in looks])
    stored = values == "stored"
    coloured = channel is None and not stored and in_colour(manifest)
    if coloured:
        looks = [ChannelLook.of_colour(manifest, index) for index, manifest in enumerate(opened.manifests)]
        levels = straight_levels(levels)
    if stored or coloured:
        own = None
        print_note(f"{file}: transfer functions have other values; export FILE.json writes the looks")
    labels = label_images(package, level, [look.channel for look in looks])
    with progress() as watcher:
        grids = write(levels, looks, file, watcher, labels=labels, volume_looks=own, stored=stored, replaces=force)
    if is_rotated(grids[0]):
        print_note(
            f"{file}: OME-NGFF 0.5 has no directions; positions are along the axes of the volume, and the direction "
            "is in the attribute volprep"
        )
    if opened.left_out:
        numbers = ", ".join(map(str, opened.left_out))
        print_note(f"{file}: levels {numbers} are left out, because not all channels have them; --channel writes one")
    names = {"channels": [look.channel for look in looks], "labels": [image.name for image in labels]}
    several = f", channels {', '.join(names['channels'])}" if len(looks) > 1 else ""
    named = f", labels {', '.join(names['labels'])}" if labels else ""
    sizes = ", ".join(voxels_text(grid.shape_zyx) for grid in grids)
    told = f"{file}: {sizes} voxels, {values} values, ome-zarr{several}{named}"
    shapes = [list(grid.shape_zyx) for grid in grids]
    print_done(told, file=str(file), format="ome-zarr", shapes_zyx=shapes, values=values, **names)


def _kind(file: Path) -> str:
    """Name of the writer, which is a module of `volprep_formats.writers`."""
    from volprep_formats.diagnostics import VolprepError

    endings = {".nii": "nifti", ".nrrd": "nrrd", ".raw": "raw", ".vdb": "vdb", ".zarr": "ome_zarr", "": "dicom"}
    ending = file.suffix.lower()
    if file.name.lower().endswith(".nii.gz"):
        return "nifti"
    if ending not in endings:
        raise VolprepError("VP1252", path=file)
    return endings[ending]
