"""volprep render: one picture of a package."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from volprep_cli.console import print_json, print_line, progress, wants_json
from volprep_cli.outputs import Force, Package, require_new
from volprep_cli.picture_options import Background, Level, Size, Step, Transfer, View, size_of

if TYPE_CHECKING:
    from volprep.pipeline.shot import Shot

Output = Annotated[
    Path,
    typer.Option(
        "-o",
        "--output",
        help="PNG file to write; of several pictures an .mp4 or .webp file, or a folder.",
        metavar="PICTURE",
    ),
]
Turntable = Annotated[
    int, typer.Option(min=0, help="Draw so many pictures of one turn around the body's long axis.", metavar="COUNT")
]
Frames = Annotated[bool, typer.Option("--frames", help="Draw all frames of a time series, each as long as it lasted.")]
Eye = Annotated[
    str | None,
    typer.Option(
        help="Look from this point at the middle of the volume instead: x,y,z in millimetres (LPS).", metavar="X,Y,Z"
    ),
]
Frame = Annotated[int, typer.Option(min=0, help="Frame of a time series, from 0 on.", metavar="NUMBER")]
Point = Annotated[
    int | None,
    typer.Option(
        min=0, help="Draw the sub-volumes around this point of the grid instead of a level.", metavar="NUMBER"
    ),
]
Memory = Annotated[
    float | None,
    typer.Option(
        min=0.0,
        help="Draw from the bricks on demand that fit into so many MiB, instead of a level, and print the bound.",
        metavar="MIB",
    ),
]
Edit = Annotated[
    Path | None,
    typer.Option(
        help="Draw this transfer function instead of the package's, which must be editable: a TOML file with points, "
        "as in [[transfer]] of a scene.",
        metavar="FILE",
    ),
]
Fill = Annotated[
    bool,
    typer.Option(
        "--fill/--no-fill", help="Fill the picture with the visible voxels; otherwise all views have the same scale."
    ),
]
Lines = Annotated[bool, typer.Option("--lines", help="Also draw the box of the volume and its middle axes.")]
Small = Annotated[
    str | None,
    typer.Option(
        help="Draw the volume with this number of pixels along the longer side, and enlarge it to the whole "
        "picture. Lines keep all pixels.",
        metavar="WxH",
    ),
]
Opacity = Annotated[
    Literal["alpha", "black-and-white", "white-volume", "luminance-average", "luminance-perceived"],
    typer.Option(
        help="For OpenGL ES 1.1, with --lines or --small: source of the opacity of the volume if the frame buffer "
        "has no alpha."
    ),
]


def render(
    package: Package,
    output: Output,
    *,
    view: View = None,
    eye: Eye = None,
    size: Size = "512x512",
    level: Level = None,
    frame: Frame = 0,
    frames: Frames = False,
    turntable: Turntable = 0,
    point: Point = None,
    transfer: Transfer = None,
    background: Background = "black",
    step: Step = None,
    memory: Memory = None,
    edit: Edit = None,
    fill: Fill = True,
    lines: Lines = False,
    small: Small = None,
    opacity: Opacity = "alpha",
    force: Force = False,
) -> None:
    """Draw a package off screen with OpenGL ES, with the shaders that it ships, within the limits of its profile."""
    # Before the renderer loads: a wrong command line needs no driver.
    eye_mm_xyz = None if eye is None else _eye(eye)
    width, height = size_of(size)
    small_wh = None if small is None else size_of(small, "--small")
    if small_wh is not None and max(small_wh) > max(width, height):
        raise typer.BadParameter(f"{small} is larger than the picture, {width}x{height}", param_hint="--small")
    require_new(output, force=force)
    from volprep.pipeline.shot import Shot, take
    from volprep.render.hybrid import HybridWish

    hybrid = None
    if lines or small_wh is not None or opacity != "alpha":
        hybrid = HybridWish(None if small_wh is None else small_wh[::-1], lines, opacity)

    shot = Shot(
        view=view,
        eye_mm_xyz=eye_mm_xyz,
        shape_hw=(height, width),
        background=background,
        level=level,
        frame=frame,
        point=point,
        transfer=transfer,
        step_mm=step,
        edit=edit,
        fill=fill,
        hybrid=hybrid,
        brick_bytes=None if memory is None else int(memory * 2**20),
    )
    if frames or turntable:
        _film(package, shot, output, turn=turntable, frames=frames)
        return
    taken = take(package, shot, output)
    if wants_json():
        drawn = {"level": taken.level, "drawn_by": taken.drawn_by, "driver": taken.driver, "seen": taken.seen}
        drawn |= {"notes": list(taken.notes)} if taken.notes else {}
        print_json({"picture": str(output), "width": width, "height": height, **drawn})
        return
    print_line(f"{output}: {width}×{height}, level {taken.level}, {taken.drawn_by}, {taken.driver}")
    for note in taken.notes:
        print_line(note)
    if taken.seen == 0.0:
        print_line("Nothing is seen: every pixel is empty. The volume may be smaller than a pixel, or transparent.")


def _film(package: Path, shot: "Shot", output: Path, *, turn: int, frames: bool) -> None:
    from volprep.pipeline.film import Film, shoot
    from volprep_formats.diagnostics import VolprepError

    if shot.frame or shot.point is not None or shot.brick_bytes is not None:
        raise VolprepError("VP5026", path=output, problem="it is of all frames, and of levels")
    with progress() as bar:
        count, seconds, taken = shoot(package, shot, Film(turn, frames), output, bar)
    if wants_json():
        print_json({"film": str(output), "pictures": count, "seconds": seconds, "drawn_by": taken.drawn_by})
    else:
        print_line(
            f"{output}: {count} pictures in {seconds:.3g} s, level {taken.level}, {taken.drawn_by}, {taken.driver}"
        )


def _eye(text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(number) for number in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not three numbers, as in 100,-200,50", param_hint="--eye") from None
    return x, y, z
