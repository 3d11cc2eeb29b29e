"""volprep normals: directions of gradients."""

from typing import Annotated

import typer

from volprep_cli.stage import Draft, run_stage

_KERNELS = ("forward", "central", "thesis", "sobel", "isotropic")
_CODES = ("biased8", "snorm8", "oct8", "oct12")


def normals(
    package: Draft,
    kernel: Annotated[
        str | None, typer.Option(help=f"{', '.join(_KERNELS)}. Replaces the scene's normals.kernel.", metavar="KERNEL")
    ] = None,
    code: Annotated[
        str | None, typer.Option(help=f"{', '.join(_CODES)}. Replaces the scene's normals.code.", metavar="CODE")
    ] = None,
    magnitude: Annotated[
        bool | None, typer.Option(help="Also store the lengths of gradients. Replaces the scene's normals.magnitude.")
    ] = None,
) -> None:
    """Write the normals of every level, even if the scene needs none.

    kernel: the gradient operator. thesis (the default) and sobel smooth most and suit noisy scans. isotropic is the
    most accurate on clean data. central and forward read the fewest voxels.

    code: biased8 (the default) and snorm8 have three bytes and may be filtered. oct8 has two bytes and oct12 three;
    they are for shaders that fetch single texels, and oct12 is the most exact.
    """
    for name, value, known in (("kernel", kernel, _KERNELS), ("code", code, _CODES)):
        if value is not None and value not in known:
            msg = f"--{name} is {value}, but must be one of {', '.join(known)}"
            raise typer.BadParameter(msg)

    run_stage(package, "normals", kernel=kernel, code=code, magnitude=magnitude)
