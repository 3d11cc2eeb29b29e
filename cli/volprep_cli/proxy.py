"""volprep proxy: meshes around what can be seen, at which rays begin."""

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
    """Write, for each level and transfer function, a closed mesh around what it shows: rays may begin at its faces.

    Meshes are glTF files, whose positions are box millimetres after the scale of their node.
    """
    run_stage(package, "proxy", form=form, block=block)
