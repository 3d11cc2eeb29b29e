"""volprep study progressive: a picture of a package frame by frame."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from volprep_cli.console import print_json, print_line, wants_json
from volprep_cli.outputs import Package, require_new
from volprep_cli.picture_options import Background, Level, Size, Step, Transfer, View, size_of

Output = Annotated[
    Path, typer.Option("--output", "-o", help="Folder to write: frame-000.png, ..., frames.json.", metavar="FOLDER")
]
Order = Annotated[
    Literal["slabs", "tiles", "random", "structured"] | None,
    typer.Option(help="Which pixels are finished first; if not given, the order of the package's technique."),
]
Budget = Annotated[float, typer.Option(min=0.0, help="Time of a frame.", metavar="MS")]


def progressive(
    package: Package,
    output: Output,
    *,
    order: Order = None,
    budget: Budget = 100.0,
    view: View = None,
    size: Size = "512x512",
    level: Level = None,
    transfer: Transfer = None,
    background: Background = "black",
    step: Step = None,
) -> None:
    """Draw a picture frame by frame, as an app finishes it: low resolution first, then more in each frame.

    frames.json has the time of each frame and its DSSIM to the last one.
    """
    shape_hw = size_of(size)[::-1]
    require_new(output, force=False)
    from volprep.lab.progressive import Finishing, take_progressively
    from volprep.pipeline.shot import Shot

    shot = Shot(
        view=view,
        eye_mm_xyz=None,
        shape_hw=shape_hw,
        background=background,
        level=level,
        point=None,
        transfer=transfer,
        step_mm=step,
        fill=True,
    )
    found = take_progressively(package, shot, Finishing(order, budget), output)
    if wants_json():
        print_json(found.model_dump(mode="json"))
        return
    drawn = [frame.milliseconds for frame in found.frames]
    print_line(
        f"{output}: {len(drawn)} frames by {found.order}, {sum(drawn):.0f} ms in all, the longest {max(drawn):.0f} ms"
    )
