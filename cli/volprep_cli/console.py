"""What the verbs print: results on stdout, progress and messages on stderr, JSON where a machine may read."""

import gc
import json
import re
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from volprep_formats.shown import shown

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.progress import TaskID

    from volprep_formats.diagnostics import VolprepError
    from volprep_formats.package.manifest import Manifest
    from volprep_formats.progress import Progress

Json = Annotated[bool, typer.Option("--json", help="Print the result, or the error, as JSON.")]
"""The option --json, which every verb with a result has."""

_HEARTBEAT_S = 10.0
_LONGEST_LINE = 10_000
_SURROGATE = re.compile("[\ud800-\udfff]")
"""What Python makes of a byte that is no UTF-8 (PEP 383): JSON has no letter for it, and strict parsers refuse it."""


@contextmanager
def progress() -> Iterator["Progress"]:
    """Show progress on stderr: bars on a terminal, else a line for each task and every ten seconds."""
    # What has been loaded is no garbage; what the work leaves may be.
    gc.freeze()
    gc.enable()
    try:
        if sys.stderr.isatty():
            with _bars() as bars:
                yield bars
        else:
            lines = _Lines()
            yield lines
            lines.finish()
    finally:
        gc.unfreeze()


@contextmanager
def _bars() -> Iterator["Progress"]:
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True)) as bar:
        yield _Bars(bar)


class _Lines:
    """Progress as lines of text."""

    def __init__(self) -> None:
        self._task = ""
        self._total = 0
        self._done = 0
        self._began = self._told = time.monotonic()

    def start(self, task: str, total: int) -> None:
        self.finish()
        self._task, self._total, self._done = task, total, 0
        self._began = self._told = time.monotonic()

    def advance(self, units: int = 1) -> None:
        self._done += units
        if time.monotonic() - self._told > _HEARTBEAT_S:
            self._told = time.monotonic()
            print(f"{self._task}: {self._done} of {self._total}", file=sys.stderr, flush=True)

    def finish(self) -> None:
        if self._task:
            print(f"{self._task}: {time.monotonic() - self._began:.1f} s", file=sys.stderr, flush=True)


class _Bars:
    """Progress as bars, one for each task."""

    def __init__(self, bar: "Bar") -> None:
        self._bar = bar
        self._task: TaskID | None = None

    def start(self, task: str, total: int) -> None:
        self._task = self._bar.add_task(task, total=total or None)

    def advance(self, units: int = 1) -> None:
        if self._task is not None:
            self._bar.advance(self._task, units)


def print_remarks(manifest: "Manifest") -> None:
    """Print to stderr what a user should know of a package."""
    from volprep.pipeline.remarks import remarks, warnings

    for text in remarks(manifest):
        _warn(f"note: {text}")
    for text in warnings(manifest):
        _warn(f"warning: {text}")


def print_json(value: object) -> None:
    """Print JSON to stdout, keys sorted, in ASCII: no reader needs to know an encoding, and no terminal obeys it."""
    print(json.dumps(_unicode(value), indent=2, sort_keys=True))


def _unicode(value: object) -> object:
    """Return a value for JSON in which bytes that are no UTF-8, of names of files, are visible escapes."""
    if isinstance(value, str):
        return _SURROGATE.sub(lambda found: shown(found[0]), value)
    if isinstance(value, dict):
        return {key: _unicode(each) for key, each in value.items()}
    return [_unicode(each) for each in value] if isinstance(value, list | tuple) else value


def print_line(text: str) -> None:
    """Print one line of a result to stdout; what it names may be text from outside."""
    print(shown(text, _LONGEST_LINE))


def _warn(text: str) -> None:
    print(shown(text, _LONGEST_LINE), file=sys.stderr)


def end_beyond(error: "VolprepError", *, as_json: bool) -> NoReturn:
    """End with `error`, which tells of a result that has been printed."""
    if not as_json:
        raise error
    # The report says it all; a second JSON document behind it would break whoever parses it.
    _warn(f"volprep: {error}")
    raise typer.Exit(error.status)


def print_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print rows under headings; on a terminal long cells are folded to its width."""
    from rich.console import Console
    from rich.table import Column, Table

    columns = [Column(heading, overflow="fold") for heading in headings]
    table = Table(*columns, box=None, pad_edge=False, header_style="bold")
    for row in rows:
        table.add_row(*(shown(cell, _LONGEST_LINE) for cell in row))
    # Piped text is for grep and diff: a row stays one line, and no line ends with blanks.
    console = Console(width=None if sys.stdout.isatty() else 10_000, highlight=False, markup=False)
    with console.capture() as captured:
        console.print(table)
    print("\n".join(line.rstrip() for line in captured.get().splitlines()))


def voxels_text(numbers_zyx: Sequence[float]) -> str:
    """Give sizes for people, x first, as scanners and viewers do: 512×512×54."""
    return "×".join(f"{number:.6g}" for number in reversed(numbers_zyx))


def bytes_text(size: int) -> str:
    """Return a size for people: 512 B, 3.4 kB, 21.0 MB."""
    if size < 1000:
        return f"{size} B"
    return f"{size / 1000:.1f} kB" if size < 1_000_000 else f"{size / 1_000_000:.1f} MB"
