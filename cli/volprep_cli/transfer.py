"""volprep transfer: what turns values into colours."""

from typing import Annotated

import typer

from volprep_cli.stage import Draft, run_stage


def transfer(
    package: Draft,
    classification: Annotated[
        str | None,
        typer.Option(
            help="lookup, preintegrated, palette, control-points, preclassified, auto. Replaces the scene's "
            "render.classification.",
            metavar="KIND",
        ),
    ] = None,
    palette_entries: Annotated[
        int | None,
        typer.Option(
            min=2, max=256, help="Entries of a palette. Replaces the scene's render.palette_entries.", metavar="COUNT"
        ),
    ] = None,
) -> None:
    """Write the tables that turn values into colours, for each transfer function.

    lookup: a table of values. preintegrated: the integral of the transfer function, read at both ends of a ray
    segment; a steep transfer function then needs far fewer samples. palette: a few entries in the shader, without a
    texture. control-points: arithmetic in the shader, without a texture. preclassified: no table, because voxels become
    colours when textures are made. auto: the fastest of lookup, preintegrated and control-points that is exact enough.

    A transfer function of a scene may be a preset (preset = "NAME" in [[transfer]]); volprep presets lists them.
    """
    run_stage(package, "transfer", classification=classification, palette_entries=palette_entries)
