"""What every verb has: short help with examples, --quiet and --json."""

import inspect
from importlib import import_module

import pytest
from command_line import volprep

from volprep_cli.examples import EXAMPLES
from volprep_cli.main import _VERBS


def test_every_verb_has_two_examples() -> None:
    assert set(EXAMPLES) == set(_VERBS)
    assert all(line.startswith(f"volprep {verb}") for verb, lines in EXAMPLES.items() for line in lines)


REPLACES = {
    "batch": "a batch goes on where it ended",
    "import": "a draft is made only in an empty folder",
    "stress": "a report replaces the report that has its name",
    "validate": "a report replaces the report that has its name",
}
"""Verbs that write a file or folder without --force, and why."""


@pytest.mark.parametrize("verb", sorted(_VERBS))
def test_a_verb_that_writes_what_the_user_names_has_force(verb: str) -> None:
    function = getattr(import_module(f"volprep_cli.{_VERBS[verb]}"), _VERBS[verb])
    options = inspect.signature(function).parameters
    writes = bool({"output", "picture", "pictures", "figure", "file", "report"} & set(options))
    assert ("force" in options) == (writes and verb not in REPLACES)


@pytest.mark.long(keep=5)
@pytest.mark.parametrize("verb", sorted(_VERBS))
def test_the_help_of_a_verb_has_its_examples_and_the_common_options(verb: str) -> None:
    shown = volprep(verb, "-h").stdout
    assert all(f"  {line}\n" in shown for line in EXAMPLES[verb])
    assert all(option in shown for option in ("-q, --quiet", "--json", "-h, --help"))
