"""volprep grid: level 0 in sub-volumes."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from volprep_cli.stage import Draft, run_stage

if TYPE_CHECKING:
    from volprep.scene import Scene


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
        typer.Option(help="A file for each sub-volume, one to seek in, or both. Replaces the scene's grid.layout."),
    ] = None,
) -> None:
    """Cut level 0 into sub-volumes that share a layer of voxels, for scans that a device cannot hold whole."""

    def change(scene: "Scene") -> "Scene":
        from volprep.scene import GridSettings  # noqa: PLC0415 - keeps volprep --help fast

        chosen = {"size": size, "layout": layout}
        update = {key: value for key, value in chosen.items() if value is not None}
        return scene.model_copy(update={"grid": (scene.grid or GridSettings()).model_copy(update=update)})

    run_stage(package, "grid", change)
