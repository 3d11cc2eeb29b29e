"""volprep slices: a level as stacks of slices."""

from typing import Annotated, Literal

import typer

from volprep_cli.stage import Draft, run_stage


def slices(
    package: Draft,
    form: Annotated[
        Literal["palette", "rgba"] | None,
        typer.Option(
            help="palette: a byte for each voxel, and a palette. rgba: four bytes. Replaces the scene's slices.form."
        ),
    ] = None,
    palette_entries: Annotated[
        int | None,
        typer.Option(
            min=2, max=256, help="Colours of a palette. Replaces the scene's slices.palette_entries.", metavar="COUNT"
        ),
    ] = None,
) -> None:
    """Write a level as stacks of slices along each axis, for OpenGL ES 1.1, which has no shaders."""
    run_stage(package, "slices", form=form, palette_entries=palette_entries)
