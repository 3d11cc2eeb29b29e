"""volprep skip: tables that let rays jump over empty space."""

from typing import Annotated

import typer

from volprep_cli.stage import Draft, run_stage


def skip(
    package: Draft,
    kind: Annotated[
        str | None,
        typer.Option(
            help="auto, none, blocks, table16, distance, octants, pyramid, euclidean. Replaces the scene's skip.kind.",
            metavar="KIND",
        ),
    ] = None,
    block: Annotated[
        int | None,
        typer.Option(
            help="Cells along an edge of a block, 1 to 256. Replaces the scene's skip.block.", metavar="CELLS"
        ),
    ] = None,
    *,
    ranges: Annotated[
        bool | None,
        typer.Option(
            "--ranges/--no-ranges",
            help="Also write the least and greatest value of each block, for apps that make new tables.",
        ),
    ] = None,
) -> None:
    """Write tables of empty space: how far a ray may jump from each block without missing a visible voxel."""
    run_stage(package, "skip", kind=kind, block=block, ranges=ranges)
