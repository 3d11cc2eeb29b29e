"""volprep study walk: pictures of a walk over the sub-volumes of a package."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import end_beyond, print_json, print_line, print_table, progress, wants_json
from volprep_cli.inspect import PackageFolder
from volprep_cli.outputs import Force
from volprep_formats.diagnostics import VolprepError

if TYPE_CHECKING:
    from volprep.lab.walk.study import WalkPicture, WalkReport


def walk(
    package: PackageFolder,
    steps: Annotated[
        Path, typer.Argument(help="Walk: a TOML file with a table [[step]] for each picture.", metavar="WALK")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder to write: walk-001.png, ..., walk.json.", metavar="FOLDER")
    ],
    *,
    force: Force = False,
) -> None:
    """Draw the pictures that a user of an app sees on a walk through a package, and compare each with the truth.

    The level follows the zoom; a move goes along the direction of view, as far as it is legal. The truth is the
    integral in double precision of the texels in the package.

    Exit status 0: every picture is within the scene's tolerance. 1: a picture is not.
    """
    from volprep.lab.walk.study import walk as draw_walk

    with progress() as watcher:
        report = draw_walk(package, steps, output, watcher, force=force)
    if wants_json():
        print_json(report.model_dump(mode="json", exclude_none=True))
    else:
        print_table(
            ("picture", "shows", "voxel", "moves", "RMSE / largest"), [_row(picture) for picture in report.pictures]
        )
        print_line(f"{output}: {len(report.pictures)} pictures, {report.driver}")
    if report.failed:
        end_beyond(_why_not(report))


def _row(picture: "WalkPicture") -> tuple[str, ...]:
    moves = " ".join(picture.made) or ("none is legal" if picture.asked else "")
    errors = f"{picture.rmse:.2g} / {picture.maximum:.2g}{'' if picture.passed else ', beyond'}"
    return picture.file, picture.shown, f"{picture.voxel_pixels:.2g} px", moves, errors


def _why_not(report: "WalkReport") -> VolprepError:
    worst = max(report.failed, key=lambda picture: picture.rmse)
    return VolprepError(
        "VP5051",
        failed=len(report.failed),
        count=len(report.pictures),
        file=worst.file,
        rmse=f"{worst.rmse:.4g}",
        maximum=f"{worst.maximum:.4g}",
    )
