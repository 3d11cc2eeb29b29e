"""volprep quantize: physical values become stored codes."""

from typing import Annotated

import typer

from volprep_cli.stage import Draft, run_stage


def quantize(
    package: Draft,
    bits: Annotated[
        int | None, typer.Option(help="8 or 16. Replaces the scene's quantize.bits.", metavar="BITS")
    ] = None,
    window: Annotated[
        tuple[float, float] | None,
        typer.Option(
            help="Physical values of the smallest and the largest code. Replaces the scene's quantize.window.",
            metavar="LOW HIGH",
        ),
    ] = None,
) -> None:
    """Turn values into codes of 8 or 16 bits, and record the loss."""
    if bits not in {None, 8, 16}:
        msg = f"--bits is {bits}, but must be 8 or 16"
        raise typer.BadParameter(msg)

    run_stage(package, "quantize", bits=bits, window=window)
