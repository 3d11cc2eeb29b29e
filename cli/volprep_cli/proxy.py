"""volprep proxy: meshes around what can be seen, at which rays begin."""

from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.stage import Draft, run_stage

if TYPE_CHECKING:
    from volprep.scene import Scene


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

    def change(scene: "Scene") -> "Scene":
        from volprep.scene import changed_proxy  # noqa: PLC0415 - keeps volprep --help fast

        return changed_proxy(scene, form, block)

    run_stage(package, "proxy", change)
