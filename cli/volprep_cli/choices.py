"""Options that say which part of a scan is meant and how it is drawn: the same for import, build, plan and batch."""

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Annotated, Literal, get_type_hints

import typer

if TYPE_CHECKING:
    from volprep.scene.request import Request

_REPAIRS = ("gaps", "tilt")


@dataclass(frozen=True)
class Choices:
    """What a command line says of the source and its look; it replaces what the scene says."""

    series: Annotated[
        str | None,
        typer.Option(help="SeriesInstanceUID, or an ending of it, if there are several.", metavar="UID"),
    ] = None
    volume: Annotated[
        int | None,
        typer.Option(min=1, help="Number of the volume, if there are several in a series or file.", metavar="NUMBER"),
    ] = None
    channel: Annotated[
        str | None,
        typer.Option(help="Name or number of the channel, if an OME file holds several.", metavar="NAME"),
    ] = None
    level: Annotated[
        int | None,
        typer.Option(
            min=0, help="Resolution to read from a package or an OME-Zarr store; 0 is the finest.", metavar="NUMBER"
        ),
    ] = None
    vdb_grid: Annotated[
        str | None, typer.Option(help="Name of the grid, if an OpenVDB file holds several.", metavar="NAME")
    ] = None
    rgb: Annotated[
        Literal["luminance", "red", "green", "blue"] | None,
        typer.Option(
            help="What to do with pictures in colour: luminance makes them grey, a colour takes that one alone. If not "
            "given, they are refused."
        ),
    ] = None
    repair: Annotated[
        list[str] | None,
        typer.Option(
            help="Allow a repair by interpolation: gaps (missing slices, uneven distances) or tilt (of the gantry). "
            "Can be given twice.",
            metavar="KIND",
        ),
    ] = None
    labels: Annotated[bool, typer.Option("--labels", help="Voxels are labels: each number names a thing.")] = False
    preset: Annotated[
        str | None,
        typer.Option(
            help="Transfer function that comes with volprep, in place of the scene's; volprep presets lists them.",
            metavar="NAME",
        ),
    ] = None

    def __post_init__(self) -> None:
        if unknown := set(self.repair or ()) - set(_REPAIRS):
            msg = f"--repair is {min(unknown)}, and can be gaps or tilt"
            raise typer.BadParameter(msg)

    def of(self, request: "Request") -> "Request":
        """Return the request with what was chosen. Raises VP1243 for a list of channels, VP3005 for the preset."""
        told: dict[str, object] = {
            "series": self.series,
            "volume": self.volume,
            "channel": self.channel,
            "level": self.level,
            "grid": self.vdb_grid,
            "rgb": self.rgb,
            "repair": tuple(self.repair or ()) or None,
            "labels": self.labels or None,
        }
        source = {key: value for key, value in told.items() if value is not None}
        if source:
            request = request.with_source(**source)
        return request if self.preset is None else request.with_preset(self.preset)


def takes_choices(verb: Callable[..., None]) -> Callable[..., None]:
    """Give a verb the fields of `Choices` as options, in place of its parameter `choices`."""
    names = [each.name for each in fields(Choices)]
    hints = get_type_hints(Choices, include_extras=True)
    options = [
        inspect.Parameter(each.name, inspect.Parameter.KEYWORD_ONLY, default=each.default, annotation=hints[each.name])
        for each in fields(Choices)
    ]
    plain = inspect.signature(verb, eval_str=True)
    others = [each for each in plain.parameters.values() if each.name != "choices"]

    @functools.wraps(verb)
    def with_options(**given: object) -> None:
        chosen = {name: given.pop(name) for name in names}
        verb(**given, choices=Choices(**chosen))  # type: ignore[arg-type]

    parameters = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in others] + options
    with_options.__signature__ = plain.replace(parameters=parameters)  # type: ignore[attr-defined]
    with_options.__annotations__ = {each.name: each.annotation for each in parameters}
    return with_options
