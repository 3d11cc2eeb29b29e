"""A jobs table: CSV or JSON lines, one scan in each line."""

import csv
import json
from collections.abc import Iterator
from io import TextIOWrapper
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError, field_validator

from volprep.batch.jobs import FoundScan
from volprep.batch.storage import is_url
from volprep_formats.diagnostics import VolprepError
from volprep_formats.path_text import path_of_text
from volprep_formats.record import Record, problems
from volprep_formats.regular_files import open_regular

_MOST_BYTES = 2**30


class Row(Record):
    """One line of a jobs table; each field is a column."""

    source: str = ""
    """File or folder of the scan, or its address in a store, s3://...; a relative path starts at the folder of the
    table. Empty: the scene names it."""
    series: str | None = None
    """DICOM: SeriesInstanceUID, or an ending of it, if a folder holds several. OME: name of the image."""
    volume: Annotated[int, Field(ge=1)] | None = None
    """Number of the volume, from 1, if there are several."""
    mask: str = ""
    """Mask of the scan, outside which nothing of it is used; a relative path starts at the folder of the table."""
    scene: str = ""
    """Scene file; a relative path starts at the folder of the table. Empty: that of the command line."""
    profiles: tuple[str, ...] = ()
    """Classes of devices, in CSV with blanks between them. Empty: the command line's."""
    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=100)] | None = None
    """Name of the package: lower-case letters, digits, - and _. Empty: made up, the same in each run."""

    @field_validator("profiles", mode="before")
    @classmethod
    def _splits(cls, value: object) -> object:
        return tuple(value.split()) if isinstance(value, str) else value


def is_table(path: Path) -> bool:
    """Whether jobs are a table, by the ending of its name."""
    return path.suffix.lower() in {".csv", ".jsonl", ".ndjson"} and not path.is_dir()


def scans_in_table(path: Path, *, has_scene: bool) -> list[FoundScan]:
    """Read a table. `has_scene` says whether the command line names a scene.

    Raises VP8001 (no table), VP8002 (unknown column), VP8003 (wrong value), VP8004 (a file that is not there), VP8005
    (two lines of one name); each names the line.
    """
    found: list[FoundScan] = []
    lines: dict[str, str] = {}
    for line, cells in _lines(path):
        scan = _scan(path, line, cells, has_scene=has_scene)
        if scan.name is not None:
            first = lines.setdefault(scan.name, scan.where)
            if first != scan.where:
                fields = {"first": first, "second": scan.where, "name": scan.name, "profile": "any"}
                raise VolprepError("VP8005", path=path, **fields)
        found.append(scan)
    if not found:
        raise VolprepError("VP8001", path=path, error="it has no lines")
    return found


def _scan(path: Path, line: int, cells: dict[str, object], *, has_scene: bool) -> FoundScan:
    for column in cells:
        if column not in Row.model_fields:
            raise VolprepError("VP8002", path=path, line=line, column=column, known=", ".join(Row.model_fields))
    try:
        row = Row.model_validate({column: cell for column, cell in cells.items() if cell not in ("", None)})
    except ValidationError as error:
        raise VolprepError("VP8003", path=path, line=line, problem=problems(error)) from error
    if not row.source and not row.scene and not has_scene:
        raise VolprepError("VP8003", path=path, line=line, problem="neither source nor scene is given")
    base = path.absolute().parent
    url = row.source if is_url(row.source) else None
    source = base / path_of_text(row.source) if row.source and url is None else None
    scene = base / path_of_text(row.scene) if row.scene else None
    mask = base / path_of_text(row.mask) if row.mask else None
    for file in (source, scene, mask):
        if file is not None and not file.exists():
            raise VolprepError("VP8004", path=path, line=line, file=file)
    identity = json.dumps(["line", row.source, row.series, row.volume, row.scene, *([row.mask] if row.mask else [])])
    return FoundScan(
        where=f"line {line}",
        source=source,
        url=url,
        series=row.series,
        volume=row.volume,
        mask=mask,
        scene=scene,
        profiles=tuple(str(base / profile) if profile.endswith(".toml") else profile for profile in row.profiles),
        name=row.name,
        identity=identity,
    )


def _lines(path: Path) -> Iterator[tuple[int, dict[str, object]]]:
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise VolprepError("VP8001", path=path, error=f"larger than {_MOST_BYTES} bytes")
        with TextIOWrapper(open_regular(path), encoding="utf-8-sig", newline="") as file:
            if path.suffix.lower() == ".csv":
                rows = csv.DictReader(file, restkey="cells without a heading", strict=True)
                for row in rows:
                    yield rows.line_num, dict(row)
                return
            for line, text in enumerate(file, 1):
                if text.strip():
                    yield line, _object(path, line, text)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise VolprepError("VP8001", path=path, error=error) from error


def _object(path: Path, line: int, text: str) -> dict[str, object]:
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise VolprepError("VP8003", path=path, line=line, problem=f"not JSON: {error}") from error
    if not isinstance(value, dict):
        raise VolprepError("VP8003", path=path, line=line, problem="not a JSON object")
    return value
