"""Colour volumes in a scene: pictures in colour become four channels, drawn into one picture.

Channels red, green and blue are premultiplied linear light, and opacity is the share of the largest extinction. Each
has one straight line as its transfer function: light and extinction are in proportion to the stored values, so that a
texture filter mixes them as the trilinear field of light and extinction says.
"""

from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Self

from pydantic import Field, ValidationError, model_validator

from volprep_formats.package.transfer_function import Fraction
from volprep_formats.readers.colour import PARTS
from volprep_formats.record import Record
from volprep_formats.source import ColourPart, OpacityOf, SourceSpec
from volprep_formats.transfer_files.points import MOST_POINTS

_LIGHT: Mapping[ColourPart, tuple[float, float, float]] = {
    "red": (1.0, 0.0, 0.0),
    "green": (0.0, 1.0, 0.0),
    "blue": (0.0, 0.0, 1.0),
    "opacity": (0.0, 0.0, 0.0),
}
_NAME = "colour"
_TABLES: Mapping[str, Mapping[str, object]] = {"pyramid": {"filter": "box"}, "render": {"classification": "colour"}}
"""Settings of a colour volume. The mean of premultiplied linear light is that of the voxels."""


class ColourPoint(Record):
    """Extinction at one number of a pixel."""

    value: Fraction
    """Number from 0 to 1: the one that `extinction` of the table [colour] names."""
    extinction_per_mm: Annotated[float, Field(ge=0.0, le=1e9)]
    """Extinction coefficient: a path of d millimetres has opacity 1 - exp(-extinction · d)."""


class ColourSettings(Record):
    """A volume in colour: each voxel has its own colour, and an extinction that follows from the pixel."""

    extinction: OpacityOf = "alpha"
    """Number, from 0 to 1, that the extinction of a pixel follows. "luminance": 0.299 red + 0.587 green + 0.114 blue of
    the sRGB colour. "background": distance of the sRGB colour from `background`, divided by the root of 3. Unless it is
    "alpha", the extinction is multiplied by the alpha of the pixel, if there is one."""
    background: Annotated[str, Field(pattern=r"^#[0-9a-fA-F]{6}$")] | None = None
    """The sRGB colour of pixels that show nothing, for `extinction` "background"."""
    points: Annotated[tuple[ColourPoint, ...], Field(min_length=1, max_length=MOST_POINTS)]
    """Extinction over that number: ascending points, linear between them, constant outside."""

    @model_validator(mode="after")
    def _shows_something(self) -> Self:
        if (self.extinction == "background") != (self.background is not None):
            msg = 'background is the colour for extinction = "background", and for nothing else'
            raise ValueError(msg)
        if any(not lower.value < upper.value for lower, upper in pairwise(self.points)):
            msg = "points must ascend"
            raise ValueError(msg)
        if not self.largest_per_mm > 0.0:
            msg = "no point has an extinction"
            raise ValueError(msg)
        return self

    @property
    def largest_per_mm(self) -> float:
        """Extinction of a share of 1."""
        return max(point.extinction_per_mm for point in self.points)

    def channel(self, part: ColourPart) -> dict[str, object]:
        """Return the fields of the reader for one channel."""
        shares = [(point.value, point.extinction_per_mm / self.largest_per_mm) for point in self.points]
        code = self.background
        background = None if code is None else tuple(int(code[i : i + 2], 16) / 255 for i in (1, 3, 5))
        return {"part": part, "opacity_of": self.extinction, "background": background, "shares": shares}


def with_colour_channels(scene: Mapping[str, object]) -> dict[str, object]:
    """Return the tables of a scene with [colour] with four channels and their transfer functions, drawn together.

    Raises ValueError for tables that a colour volume determines.
    """
    source = scene.get("source")
    if not isinstance(source, Mapping) or not (
        _is_sound(ColourSettings, scene["colour"]) and _is_sound(SourceSpec, source)
    ):
        # The scene is refused for it: the message names the key as it was written, and not one of a channel.
        only = transfer_of("opacity", 1.0)
        return {**scene, "transfer": [{key: only[key] for key in ("name", "colour_space", "points")}]}
    settings = ColourSettings.model_validate(scene["colour"])
    fixed = [f"[{table}]" for table in ("together", "quantize", "segments") if table in scene]
    fixed += [
        f"source.{key}" for key in ("channels", "channel", "labels", "rgb", "colour", "mask", "nan") if key in source
    ]
    tables = {table: {**own, **_mapping(scene.get(table))} for table, own in _TABLES.items()}
    fixed += [f"{table}.{key}" for table, own in _TABLES.items() for key in own if tables[table][key] != own[key]]
    if fixed:
        msg = f"[colour] cannot be combined with {', '.join(fixed)}"
        raise ValueError(msg)
    return {
        **scene,
        **tables,
        "source": {"channels": [{**source, "name": part, "colour": settings.channel(part)} for part in PARTS]},
        "transfer": [transfer_of(part, settings.largest_per_mm) for part in PARTS],
        "together": {"name": _NAME},
    }


def _is_sound(record: type[Record], table: object) -> bool:
    """Return whether a table has the right keys and values."""
    try:
        record.model_validate(table)
    except ValidationError:
        return False
    return True


def _mapping(table: object) -> Mapping[str, object]:
    return table if isinstance(table, Mapping) else {}


def transfer_of(part: ColourPart, largest_per_mm: float) -> dict[str, object]:
    """Return the transfer function of a channel: light, or extinction, in proportion to the value."""
    ends = [
        {"value": value, "colour": _LIGHT[part], "extinction_per_mm": value * largest_per_mm} for value in (0.0, 1.0)
    ]
    return {"name": part, "channel": part, "colour_space": "linear", "points": ends}
