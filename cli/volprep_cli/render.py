"""volprep render: one picture of a package."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from volprep_cli.console import Json, print_json, print_line

Package = Annotated[Path, typer.Argument(help="Package.", metavar="PACKAGE")]
Output = Annotated[Path, typer.Option("-o", "--output", help="PNG file to write.", metavar="PICTURE")]
View = Annotated[
    str,
    typer.Option(
        help="Standard view: anterior, posterior, left, right, superior, inferior, anterior-left, anterior-right or "
        "posterior-left. Left and right are the patient's.",
        metavar="VIEW",
    ),
]
Eye = Annotated[
    str | None,
    typer.Option(
        help="Look from this point at the middle of the volume instead: x,y,z in millimetres (LPS).", metavar="X,Y,Z"
    ),
]
Size = Annotated[str, typer.Option(help="Width and height in pixels, or one number for both.", metavar="WxH")]
Level = Annotated[int | None, typer.Option(help="Level to draw; if not given, the finest.", metavar="NUMBER")]
Transfer = Annotated[
    str | None,
    typer.Option(
        help="Transfer function, or picture of several channels; if not given, the default one.", metavar="NAME"
    ),
]
Point = Annotated[
    int | None,
    typer.Option(
        min=0, help="Draw the sub-volumes around this point of the grid instead of a level.", metavar="NUMBER"
    ),
]
Background = Annotated[Literal["black", "white", "transparent"], typer.Option(help="What is behind the volume.")]
Step = Annotated[
    float | None, typer.Option(help="Distance of the samples; if not given, that of the package.", metavar="MM")
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
    typer.Option("--fill", help="Let what is seen fill the picture; otherwise all views show the volume in one size."),
]
Lines = Annotated[bool, typer.Option("--lines", help="Draw the box of the volume and its middle axes, too.")]
Small = Annotated[
    str | None,
    typer.Option(
        help="Draw the volume with so many pixels only, and enlarge it to the whole picture. Lines keep all pixels.",
        metavar="WxH",
    ),
]
Opacity = Annotated[
    Literal["alpha", "black-and-white", "white-volume", "luminance-average", "luminance-perceived"],
    typer.Option(
        help="For OpenGL ES 1.1, with --lines or --small: where the opacity of the volume comes from, for buffers "
        "without alpha."
    ),
]


def render(
    package: Package,
    output: Output,
    *,
    view: View = "anterior",
    eye: Eye = None,
    size: Size = "512x512",
    level: Level = None,
    point: Point = None,
    transfer: Transfer = None,
    background: Background = "black",
    step: Step = None,
    edit: Edit = None,
    fill: Fill = False,
    lines: Lines = False,
    small: Small = None,
    opacity: Opacity = "alpha",
    as_json: Json = False,
) -> None:
    """Draw a package off screen with OpenGL ES, with the shaders that it ships, within the limits of its profile."""
    # Before the renderer loads: a wrong command line needs no driver.
    eye_mm_xyz = None if eye is None else _eye(eye)
    width, height = _size(size)
    small_wh = None if small is None else _size(small, "--small")
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
        point=point,
        transfer=transfer,
        step_mm=step,
        edit=edit,
        fill=fill,
        hybrid=hybrid,
    )
    taken = take(package, shot, output)
    if as_json:
        drawn = {"level": taken.level, "drawn_by": taken.drawn_by, "driver": taken.driver, "seen": taken.seen}
        print_json({"picture": str(output), "width": width, "height": height, **drawn})
        return
    print_line(f"{output}: {width}×{height}, level {taken.level}, {taken.drawn_by}, {taken.driver}")
    if taken.seen == 0.0:
        print_line("Nothing is seen: every pixel is empty. The volume may be smaller than a pixel, or transparent.")


def _eye(text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(number) for number in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not three numbers, as in 100,-200,50", param_hint="--eye") from None
    return x, y, z


def _size(text: str, option: str = "--size") -> tuple[int, int]:
    try:
        width, height = (int(number) for number in (text if "x" in text else f"{text}x{text}").split("x"))
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a size, as in 640x480 or 512", param_hint=option) from None
    return width, height
