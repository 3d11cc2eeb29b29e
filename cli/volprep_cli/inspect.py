"""volprep inspect: print the contents of a package."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import bytes_text, print_done, print_json, print_line, print_table, wants_json
from volprep_cli.outputs import Force, require_new
from volprep_formats.path_text import path_text

if TYPE_CHECKING:
    from volprep_formats.package.manifest import Manifest
    from volprep_formats.package.reader import Package

PackageFolder = Annotated[Path, typer.Argument(help="Package, or a draft.", metavar="PACKAGE")]
Picture = Annotated[
    Path | None,
    typer.Option(help="Write a picture of the slices of a level, side by side, to this PNG file.", metavar="PICTURE"),
]
Figure = Annotated[
    Path | None,
    typer.Option(
        help="Draw proxy meshes, bricks, sub-volumes and slices in space into this PNG file. Needs pyvista.",
        metavar="PICTURE",
    ),
]
Level = Annotated[int | None, typer.Option(help="Level of the picture; if not given, the finest.", metavar="NUMBER")]
Normals = Annotated[bool, typer.Option("--normals", help="Show normals in the picture, with x, y and z as colours.")]


def inspect(
    package: PackageFolder,
    *,
    picture: Picture = None,
    figure: Figure = None,
    level: Level = None,
    normals: Normals = False,
    force: Force = False,
) -> None:
    """Print the contents of a package: levels, textures, transfer functions, segments, programs, plan, files.

    Only the manifest is read; volprep validate --quick also checks the files. If the report of the package lies beside
    it, where volprep validate writes it, it adds the size of pictures that each coarse level is right up to. With
    --picture, a picture of the slices of a level is written instead; with --figure, a picture of the layout of the
    volume in space.
    """
    from volprep.validation.verdicts.sizes import right_up_to_pixels
    from volprep_cli.inspect_tables import tables_of
    from volprep_formats.package.reader import Package

    for written in (picture, figure):
        if written is not None:
            require_new(written, force=force)
    opened = Package.open(package, allow_draft=True)
    if picture is not None:
        _picture(opened, level, picture, normals=normals)
        return
    if figure is not None:
        _figure(opened, figure)
        return
    manifest = opened.manifest
    right = right_up_to_pixels(package)
    if wants_json():
        record = opened.whole.model_dump(mode="json", exclude_none=True)
        judged = {"right_up_to_pixels": right} if right else {}
        print_json({"package": str(package), "size_bytes": _size(manifest), "manifest": record, **judged})
        return
    print_line(f"{package}: {manifest.state} package, {bytes_text(_size(manifest))} in {len(manifest.files)} files")
    print_line("")
    for table in tables_of(manifest, right):
        if table.rows:
            if table.title:
                print_line(table.title)
            print_table(table.headings, table.rows)
            print_line("")


def _picture(package: "Package", level: int | None, path: Path, *, normals: bool) -> None:
    from volprep.parts.mosaic.montage import write_montage

    made = write_montage(package, level, path, normals=normals)
    height, width, _ = made.pixels.shape
    layout = {"level": made.level, "slices": made.shown, "every": made.every, "tiles_x": made.tiles_x}
    every = "" if made.every == 1 else f", one of {made.every}"
    channels, frames = package.manifest.channels, package.manifest.frames or ()
    of = f", channel {channels[0].name} of {len(channels)}" if len(channels) > 1 else ""
    of += f", frame 0 of {len(frames)}" if frames else ""
    told = f"{path}: {width}×{height}, level {made.level}{of}, {made.shown} slices{every}, {made.tiles_x} in a row"
    print_done(told, picture=path_text(path), width=width, height=height, **layout)


def _figure(package: "Package", path: Path) -> None:
    from volprep.vtk.layouts import write_figure

    width, height = write_figure(package, path)
    print_done(f"{path}: {width}×{height}", picture=path_text(path), width=width, height=height)


def _size(manifest: "Manifest") -> int:
    return sum(record.size_bytes for record in manifest.files)
