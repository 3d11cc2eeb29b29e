"""Options that every verb has: --quiet, and --json unless the verb has one with a help text of its own."""

import functools
import inspect
from collections.abc import Callable
from typing import Annotated

import typer
from typer.models import ParameterInfo

from volprep_cli.console import Json, be_quiet, want_json

_Quiet = Annotated[
    bool, typer.Option("-q", "--quiet", help="Print neither progress nor notes; warnings and errors remain.")
]


def with_common_options(verb: Callable[..., None]) -> Callable[..., None]:
    """Return the function of a verb with the options that all verbs have."""
    plain = inspect.signature(verb, eval_str=True)
    keyword = inspect.Parameter.KEYWORD_ONLY
    added = [inspect.Parameter("quiet", keyword, default=False, annotation=_Quiet)]
    takes_json = "as_json" in plain.parameters
    if not takes_json:
        added.append(inspect.Parameter("as_json", keyword, default=False, annotation=Json))

    @functools.wraps(verb)
    def with_options(**given: object) -> None:
        be_quiet(wanted=bool(given.pop("quiet")))
        want_json(wanted=bool(given["as_json"] if takes_json else given.pop("as_json")))
        verb(**given)

    parameters = [parameter.replace(kind=keyword) for parameter in plain.parameters.values()] + added
    for parameter in parameters:
        _leave_reading_to_the_verb(parameter)
    with_options.__signature__ = plain.replace(parameters=parameters)  # type: ignore[attr-defined]
    with_options.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return with_options


def _leave_reading_to_the_verb(parameter: inspect.Parameter) -> None:
    """Do not check whether a path can be read: the verb's own error has a code, and a fitting status."""
    for info in getattr(parameter.annotation, "__metadata__", ()):
        if isinstance(info, ParameterInfo):
            info.readable = False
