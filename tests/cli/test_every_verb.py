"""What every verb has: short help with examples, --quiet and --json."""

import inspect
from importlib import import_module

import pytest
from command_line import volprep

from volprep.pipeline.stage_graph import STAGES
from volprep_cli.examples import EXAMPLES
from volprep_cli.main import _GROUPS, _VERBS


def test_every_verb_has_two_examples() -> None:
    assert set(EXAMPLES) == set(_VERBS)
    assert all(line.startswith(f"volprep {verb}") for verb, lines in EXAMPLES.items() for line in lines)


REPLACES = {
    "batch": "a batch goes on where it ended",
    "import": "a draft is made only in an empty folder",
    "study ablation": "a study is written only to a new folder",
    "study curves": "a study is written only to a new folder",
    "study progressive": "a study is written only to a new folder",
    "study stress": "a report replaces the report that has its name",
    "validate": "a report replaces the report that has its name",
}
"""Verbs that write a file or folder without --force, and why."""
FUNCTIONS = {verb: getattr(import_module(f"volprep_cli.{name}"), name) for verb, name in _VERBS.items()} | {
    f"{group} {name}": function
    for group in _GROUPS
    for name, function in import_module(f"volprep_cli.{group}").commands().items()
}


@pytest.mark.parametrize("verb", sorted(FUNCTIONS))
def test_a_verb_that_writes_what_the_user_names_has_force(verb: str) -> None:
    options = inspect.signature(FUNCTIONS[verb]).parameters
    writes = bool({"output", "picture", "pictures", "figure", "file", "report"} & set(options))
    assert ("force" in options) == (writes and verb not in REPLACES)


def test_every_stage_that_a_plan_may_need_has_a_verb_with_the_documentation_of_its_keys() -> None:
    assert {f"stage {stage.name}" for stage in STAGES} <= set(FUNCTIONS)
    assert "Replaces skip.kind of the scene." in " ".join(volprep("stage", "skip", "--help").stdout.split())


@pytest.mark.long(keep=5)
@pytest.mark.parametrize("verb", sorted(FUNCTIONS))
def test_the_help_of_a_verb_has_its_examples_and_the_common_options(verb: str) -> None:
    shown = volprep(*verb.split(), "-h").stdout
    assert all(f"  {line}\n" in shown for line in EXAMPLES.get(verb, ()))
    common = ("-h, --help",) if verb in _GROUPS else ("-q, --quiet", "--json", "-h, --help")
    assert all(option in shown for option in common)
