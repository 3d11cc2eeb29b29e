"""volprep grid: level 0 in sub-volumes."""

from typing import Annotated, Literal

import typer

from volprep_cli.stage import Draft, run_stage


def grid(
    package: Draft,
    size: Annotated[
        int | None,
        typer.Option(
            min=2,
            help="Largest number of voxels of a sub-volume along an axis. Replaces the scene's grid.size.",
            metavar="VOXELS",
        ),
    ] = None,
    layout: Annotated[
        Literal["files", "single", "both"] | None,
        typer.Option(
            help="files: one file for each sub-volume. single: all in one file. both: both forms. Replaces the scene's "
            "grid.layout."
        ),
    ] = None,
) -> None:
    """Cut level 0 into sub-volumes that share a layer of voxels, for scans that a device cannot hold at once."""
    run_stage(package, "grid", size=size, layout=layout)
