"""Keyword arguments that select a part of a source, with the names and values of [source] in a scene."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, TypedDict

from pydantic import ValidationError

from volprep_formats.diagnostics import VolprepError
from volprep_formats.path_text import path_text
from volprep_formats.record import problems
from volprep_formats.source import GreyOf, RepairKind, SourceFormat, SourceSpec


class SourceChoices(TypedDict, total=False):
    """Some keys of [source] in a scene, as sample_specs/README.md explains them."""

    format: SourceFormat
    series: str
    volume: int
    volumes_by: Literal["number"]
    channel: str | int
    level: int
    grid: str
    labels: bool | None
    label_table: str
    rgb: GreyOf
    repair: Sequence[RepairKind]
    mask: str
    outside: float
    nan: float | Literal["outside"]
    raw: Mapping[str, object]
    stack: Mapping[str, object]
    array: Mapping[str, object]
    mosaic: Mapping[str, object]


def source_of(path: Path, choices: SourceChoices) -> SourceSpec:
    """Return the source at `path`, with its part selected by `choices`; relative paths start at the current folder.

    Raises VP9010 for a key or a value that a source cannot have.
    """
    try:
        return SourceSpec.model_validate({**choices, "path": path_text(path)}).resolved(Path.cwd())
    except ValidationError as error:
        raise VolprepError("VP9010", problems=problems(error, SourceSpec)) from error
