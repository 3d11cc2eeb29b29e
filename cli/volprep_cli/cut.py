"""volprep cut: a box of level 0 around a place."""

from pathlib import Path
from typing import Annotated

import typer

from volprep_cli.console import print_json, print_line, voxels_text, wants_json
from volprep_cli.inspect import PackageFolder
from volprep_cli.outputs import Force


def cut(
    package: PackageFolder,
    center: Annotated[
        str, typer.Option(help="Voxel of level 0 at the center of the box, for example 120,80,200.", metavar="X,Y,Z")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder to write: cut.ktx2, cut.json, cut.png.", metavar="FOLDER")
    ],
    size: Annotated[int, typer.Option(min=1, help="Voxels of the box along each axis.", metavar="VOXELS")] = 256,
    *,
    world: Annotated[
        bool, typer.Option("--world", help="The center is a position in the patient, in millimetres (LPS).")
    ] = False,
    force: Force = False,
) -> None:
    """Cut a box out of the full resolution of a package with sub-volumes, and mark it on the coarsest level.

    Only the voxels of the box are read. cut.json gives the place of the box in the patient and in each level.
    """
    from volprep.pipeline.cut_files import write_cut
    from volprep_formats.package.reader import Package

    record = write_cut(Package.open(package), _numbers(center), size, output, world=world, force=force)
    if wants_json():
        print_json(record.model_dump(mode="json"))
        return
    shape = voxels_text([b - a for a, b in zip(record.start_zyx, record.stop_zyx, strict=True)])
    print_line(
        f"{output}: {shape} voxels from {','.join(map(str, reversed(record.start_zyx)))}; "
        f"{record.texel_bytes_read} bytes of texels in {record.reads} reads of {record.files_read} files"
    )


def _numbers(text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter("three numbers with commas, for example 120,80,200", param_hint="--center") from None
    return x, y, z
