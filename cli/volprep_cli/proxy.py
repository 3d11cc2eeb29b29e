"""volprep proxy: meshes around the visible part of the volume, where rays begin."""

from typing import Annotated

import typer

from volprep_cli.stage import Draft, run_stage


def proxy(
    package: Draft,
    form: Annotated[
        str | None,
        typer.Option(help="blocks, merged, convex or box. Replaces the scene's proxy.form.", metavar="FORM"),
    ] = None,
    block: Annotated[
        int | None,
        typer.Option(
            help="Cells along an edge of a block, 1 to 256. Replaces the scene's proxy.block.", metavar="CELLS"
        ),
    ] = None,
) -> None:
    """Write a closed mesh around the visible voxels of each level and transfer function, for rays to start at.

    Meshes are glTF files. The scale of their node turns positions into box millimetres.
    """
    run_stage(package, "proxy", form=form, block=block)
