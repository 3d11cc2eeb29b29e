"""volprep slices: a level as stacks of slices."""

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from volprep_cli.stage import Draft, run_stage

if TYPE_CHECKING:
    from volprep.scene import Scene


def slices(
    package: Draft,
    form: Annotated[
        Literal["palette", "rgba"] | None,
        typer.Option(help="A byte for each voxel and a palette, or four bytes. Replaces the scene's slices.form."),
    ] = None,
    palette_entries: Annotated[
        int | None,
        typer.Option(
            min=2, max=256, help="Colours of a palette. Replaces the scene's slices.palette_entries.", metavar="COUNT"
        ),
    ] = None,
) -> None:
    """Lay a level out as stacks of slices along each axis, for devices of OpenGL ES 1.1, which have no shaders."""

    def change(scene: "Scene") -> "Scene":
        from volprep.scene import SliceSettings  # noqa: PLC0415 - keeps volprep --help fast

        chosen = {"form": form, "palette_entries": palette_entries}
        update = {key: value for key, value in chosen.items() if value is not None}
        return scene.model_copy(update={"slices": (scene.slices or SliceSettings()).model_copy(update=update)})

    run_stage(package, "slices", change)
