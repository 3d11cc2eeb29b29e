"""volprep pyramid: coarser levels."""

from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.stage import Draft, run_stage

if TYPE_CHECKING:
    from volprep.scene import Scene


def pyramid(
    package: Draft,
    coarsest: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Longest axis of the coarsest level, in voxels. Replaces the scene's pyramid.coarsest_longest_axis.",
            metavar="VOXELS",
        ),
    ] = None,
) -> None:
    """Make the coarser levels that the package holds."""

    def change(scene: "Scene") -> "Scene":
        update = {} if coarsest is None else {"coarsest_longest_axis": coarsest}
        return scene.model_copy(update={"pyramid": scene.pyramid.model_copy(update=update)})

    run_stage(package, "pyramid", change)
