"""Options of verbs that draw a package."""

from typing import Annotated, Literal

import typer

View = Annotated[
    str | None,
    typer.Option(
        help="Standard view: anterior, posterior, left, right, superior, inferior, anterior-left, anterior-right or "
        "posterior-left. Left and right are the patient's. If not given, anterior-left, or along the thin axis of a "
        "flat volume.",
        metavar="VIEW",
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
Background = Annotated[Literal["black", "white", "transparent"], typer.Option(help="Background behind the volume.")]
Step = Annotated[
    float | None,
    typer.Option(
        help="Distance of samples along a ray, in millimetres; if not given, that of the package.", metavar="MM"
    ),
]


def size_of(text: str, option: str = "--size") -> tuple[int, int]:
    """Return width and height."""
    try:
        width, height = (int(number) for number in (text if "x" in text else f"{text}x{text}").split("x"))
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a size, as in 640x480 or 512", param_hint=option) from None
    return width, height
