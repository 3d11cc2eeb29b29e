"""The templates of pages, and how numbers look in them."""

import os
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from jinja2 import Environment, FileSystemBytecodeCache, FileSystemLoader, StrictUndefined

from volprep.report import text
from volprep.validation.comparison.colours import css_colour
from volprep_formats.content_policy import source_digest

_TEMPLATES = Path(__file__).parent / "templates"


@lru_cache(maxsize=8)
def environment(truth_bound: float) -> Environment:
    """Return the environment of the page templates: everything is escaped, and an undefined name is an error.

    Errors below `truth_bound`, that of the truth itself, or below the argument of the filter, are shown as such. The
    environment is kept, with the templates that it has compiled, for the next page.
    """
    found = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        bytecode_cache=_compiled(),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    found.filters.update(
        number=text.number,
        error=lambda value, bound=0.0: text.error(value, max(bound, truth_bound)),
        bytes=text.size,
        plain=text.plain,
        ratio=text.ratio,
        decibel=text.decibel,
        seconds=text.seconds,
        css=css_colour,
        kept_light=text.kept_light,
        digest=source_digest,
    )
    return found


def _compiled() -> FileSystemBytecodeCache | None:
    """Return the compiled templates, kept beside them as Python keeps modules; None if the folder takes no file.

    Compiling them takes half a second, a quarter of the report of a small package.
    """
    folder = _TEMPLATES / "__pycache__"
    with suppress(OSError):
        folder.mkdir(exist_ok=True)
    return FileSystemBytecodeCache(str(folder)) if os.access(folder, os.W_OK) else None
