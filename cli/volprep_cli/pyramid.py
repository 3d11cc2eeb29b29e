"""volprep pyramid: coarser levels."""

from typing import Annotated, get_args

import typer

from volprep_cli.stage import Draft, run_stage


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
    made_by: Annotated[
        str | None,
        typer.Option(
            "--filter",
            help="Filter that makes each level from level 0. Replaces the scene's pyramid.filter. Smooth: box, "
            "binomial, gaussian, lanczos3, bilinear. To keep thin features: feature-preserving, maximum, minimum. "
            "Against outliers: median. For labels: mode, mode-foreground (label 0 does not count), nearest. "
            "Fitted to level 0: least-squares, appearance (for the scene's transfer functions). To compare with: "
            "two-step-bilinear. auto tries several.",
            metavar="NAME",
        ),
    ] = None,
) -> None:
    """Make the coarser levels that the package holds, each from level 0."""
    from volprep.scene.scene import PyramidSettings

    unions = get_args(PyramidSettings.model_fields["filter"].annotation)
    filters = [name for names in unions for name in get_args(names)]
    if made_by is not None and made_by not in filters:
        msg = f"there is no filter {made_by}; the filters are {', '.join(filters)}"
        raise typer.BadParameter(msg)

    run_stage(package, "pyramid", coarsest_longest_axis=coarsest, filter=made_by)
