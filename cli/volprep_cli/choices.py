"""Options that select a part of a scan and its look: shared by import, build, plan and batch."""

import functools
import inspect
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, get_type_hints

import typer

if TYPE_CHECKING:
    from volprep.scene.request import Request

_REPAIRS = ("gaps", "tilt")


def complete_presets(begun: str) -> list[str]:
    """Return the presets whose names begin with the typed text."""
    from volprep.scene.presets import preset_names

    return [name for name in preset_names() if name.startswith(begun)]


def complete_profiles(begun: str) -> list[str]:
    """Return the profiles whose names begin with the typed text."""
    from volprep.scene.profiles import profile_names

    return [name for name in profile_names() if name.startswith(begun)]


@dataclass(frozen=True)
class Choices:
    """Source and look options of the command line; they override the scene."""

    series: Annotated[
        str | None, typer.Option(help="SeriesInstanceUID, or an ending of it, if there are several.", metavar="UID")
    ] = None
    volume: Annotated[
        int | None,
        typer.Option(min=1, help="Number of the volume, if there are several in a series or file.", metavar="NUMBER"),
    ] = None
    frames: Annotated[
        str | None,
        typer.Option(
            help="Volumes of a file that are frames of a time series: all, a number for every so many, or "
            "FIRST:LAST[:STEP].",
            metavar="FRAMES",
        ),
    ] = None
    volumes_by: Annotated[
        Literal["number"] | None,
        typer.Option(
            help="number: if nothing else distinguishes the volumes of a DICOM series, order them by InstanceNumber; "
            "--volume then selects one."
        ),
    ] = None
    channel: Annotated[
        str | None, typer.Option(help="Name or number of the channel, if an OME file holds several.", metavar="NAME")
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
            help="How to read pictures in colour: luminance makes them grey; red, green or blue takes that colour "
            "alone. If not given, a scan without a scene keeps its colours."
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
    labels: Annotated[
        bool | None,
        typer.Option(
            "--labels/--no-labels",
            help="Whether voxels are labels: each number is a structure. If not given, labels are detected in a scan "
            "without a scene.",
        ),
    ] = None
    label_table: Annotated[
        str | None,
        typer.Option(
            help="Names and colours of labels: freesurfer, slicer, itksnap, or a file of such a program. With "
            "--segments, the names of the segments. If not given, a table of the same name beside the scan.",
            metavar="NAME|FILE",
        ),
    ] = None
    nan: Annotated[
        str | None,
        typer.Option(
            help="Value in place of NaN, or outside for the least value. If not given, a scan without a scene takes 0 "
            "if it has both negative and positive values, else the least value.",
            metavar="VALUE",
        ),
    ] = None
    with_: Annotated[
        Path | None,
        typer.Option(
            "--with",
            help="Second scan, drawn over the first one as a veil of colour: PET or a dose over CT. It may have a grid "
            "of its own in the same frame of reference. For a scan without a scene.",
            metavar="PATH",
        ),
    ] = None
    transform: Annotated[
        Path | None,
        typer.Option(
            help="Registration of --with onto the first scan: a file of ITK, FLIRT or DICOM. If not given, both must "
            "be in one frame of reference.",
            metavar="FILE",
        ),
    ] = None
    segments: Annotated[
        Path | None,
        typer.Option(
            help="Segments of the scan, drawn with it: DICOM SEG or RTSTRUCT, .seg.nrrd, a label volume, or a folder "
            "of masks.",
            metavar="PATH",
        ),
    ] = None
    segment_names: Annotated[
        Literal["coded", "free"] | None,
        typer.Option(
            help="Names of --segments that the package holds. coded, as if not given: names of public vocabularies, "
            "and numbers for other segments. free: typed names and names of files, too, which may identify a patient."
        ),
    ] = None
    preset: Annotated[
        str | None,
        typer.Option(
            help="Transfer function that comes with volprep, in place of the scene's; volprep presets lists them.",
            metavar="NAME",
            autocompletion=complete_presets,
        ),
    ] = None

    def __post_init__(self) -> None:
        if unknown := set(self.repair or ()) - set(_REPAIRS):
            msg = f"--repair is {min(unknown)}, and can be gaps or tilt"
            raise typer.BadParameter(msg)
        if self.transform is not None and self.with_ is None:
            msg = "--transform needs --with; a scene says it in [[source.channels]]"
            raise typer.BadParameter(msg)
        if self.segment_names is not None and self.segments is None:
            msg = "--segment-names needs --segments; a scene says names in [segments]"
            raise typer.BadParameter(msg)

    def of(self, request: "Request") -> "Request":
        """Return the request with these choices applied.

        Raises VP1243 for a list of channels, VP3005 for the preset, VP3078 for a second scan over more than a scan.
        """
        told: dict[str, object] = {
            "series": self.series,
            "volume": self.volume,
            "frames": self._frames(),
            "volumes_by": self.volumes_by,
            "channel": self.channel,
            "level": self.level,
            "grid": self.vdb_grid,
            "rgb": self.rgb,
            "repair": tuple(self.repair or ()) or None,
            "labels": self.labels,
            "label_table": self._table() if self.segments is None else None,
            "nan": self._nan(),
        }
        source = {key: value for key, value in told.items() if value is not None}
        if source:
            request = request.with_source(**source)
        if self.segments is not None:
            settings = {"names": self.segment_names, "table": self._table()}
            told_of_segments = {key: value for key, value in settings.items() if value is not None}
            request = request.with_segments(self.segments, **told_of_segments)
        request = request if self.preset is None else request.with_preset(self.preset)
        return request if self.with_ is None else request.with_veil(self.with_, self.transform)

    def _frames(self) -> int | str | None:
        if self.frames is None:
            return None
        from pydantic import TypeAdapter, ValidationError

        from volprep_formats.source import FrameChoice

        is_number = re.fullmatch(r"[1-9][0-9]{0,17}", self.frames) is not None
        choice: TypeAdapter[int | str] = TypeAdapter(FrameChoice)
        try:
            return choice.validate_python(int(self.frames) if is_number else self.frames)
        except ValidationError:
            msg = f"--frames is {self.frames}, and must be all, a number, or FIRST:LAST[:STEP]"
            raise typer.BadParameter(msg) from None

    def _nan(self) -> float | str | None:
        if self.nan is None or self.nan == "outside":
            return self.nan
        try:
            value = float(self.nan)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            msg = f"--nan is {self.nan}, and must be a number or outside"
            raise typer.BadParameter(msg)
        return value

    def _table(self) -> str | None:
        """Return the table with an absolute path, if it is a file."""
        from volprep_formats.label_tables.table import LABEL_TABLES
        from volprep_formats.path_text import path_text

        if self.label_table is None or self.label_table in LABEL_TABLES:
            return self.label_table
        return path_text(Path(self.label_table).absolute())


def takes_choices(verb: Callable[..., None]) -> Callable[..., None]:
    """Replace a verb's parameter `choices` by the fields of `Choices` as options."""
    names = [option.name for option in fields(Choices)]
    hints = get_type_hints(Choices, include_extras=True)
    options = [
        inspect.Parameter(
            option.name, inspect.Parameter.KEYWORD_ONLY, default=option.default, annotation=hints[option.name]
        )
        for option in fields(Choices)
    ]
    plain = inspect.signature(verb, eval_str=True)
    others = [parameter for parameter in plain.parameters.values() if parameter.name != "choices"]

    @functools.wraps(verb)
    def with_options(**given: object) -> None:
        chosen = {name: given.pop(name) for name in names}
        verb(**given, choices=Choices(**chosen))  # type: ignore[arg-type]

    parameters = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in others] + options
    with_options.__signature__ = plain.replace(parameters=parameters)  # type: ignore[attr-defined]
    with_options.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return with_options
