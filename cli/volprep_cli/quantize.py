"""volprep quantize: physical values become stored codes."""

from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.stage import Draft, run_stage

if TYPE_CHECKING:
    from volprep.scene import Scene


def quantize(
    package: Draft,
    bits: Annotated[
        int | None, typer.Option(help="8 or 16. Replaces the scene's quantize.bits.", metavar="BITS")
    ] = None,
    window: Annotated[
        tuple[float, float] | None,
        typer.Option(
            help="Values of the smallest and largest code. Replaces the scene's quantize.window.", metavar="LOW HIGH"
        ),
    ] = None,
) -> None:
    """Turn values into codes of 8 or 16 bits, and record the loss."""
    if bits not in {None, 8, 16}:
        msg = f"--bits is {bits}, and can be 8 or 16"
        raise typer.BadParameter(msg)

    def change(scene: "Scene") -> "Scene":
        update = {name: value for name, value in (("bits", bits), ("window", window)) if value is not None}
        return scene.model_copy(update={"quantize": scene.quantize.model_copy(update=update)})

    run_stage(package, "quantize", change)
