"""docs/PAPERS.md: every row names a command that exists, or a key that a scene may have."""

import re
import shlex
import tomllib
from pathlib import Path

import pytest
from typer.main import get_command

from tests.papers.__main__ import PAPERS
from tests.papers.__main__ import command_line as papers_line
from volprep.scene.lab import misplaced, without_lab
from volprep.scene.profiles import load_profile
from volprep.scene.scene import Scene
from volprep_cli.main import _GROUPS, command_line

TABLE = Path(__file__).parents[2] / "docs" / "PAPERS.md"
POINTS = '[{ value = 0.2, colour = "#ffffff", extinction_per_mm = 1.0 }]'
REST = 'name = "a"\nsource.path = "scan.nrrd"\n'
LIGHT = "lighting.light_mm = [0.0, 0.0, 1.0]\n"
LIT = 'render.lighting = "phong"\n'


def rows() -> list[list[str]]:
    found = [re.split(r"\s*\|\s*", line.strip("| ")) for line in TABLE.read_text(encoding="utf-8").splitlines()]
    return [row for row in found if len(row) == 3 and row[0] not in {"what", "---"}]


def test_every_paper_has_rows_and_each_says_whether_it_is_there() -> None:
    text = TABLE.read_text(encoding="utf-8")
    assert {f"make papers ARGS={name}" for name in PAPERS} <= set(re.findall(r"`(make [^`]*)`", text))
    assert len(rows()) > 50
    assert all(row[1][0] in "●○" for row in rows())


@pytest.mark.parametrize("command", [row[2].strip("`") for row in rows()])
def test_each_row_has_a_command_or_a_key(command) -> None:
    if command.startswith("make papers ARGS="):
        (words,) = shlex.split(command.partition("ARGS=")[2])
        assert set(papers_line().parse_args(words.split()).papers) <= set(PAPERS)
        return
    if command.startswith("volprep "):
        words = command.split()
        verb = get_command(command_line(words[1:])).commands[words[1]]
        verb = verb.commands[words[2]] if words[1] in _GROUPS else verb
        options = {option for each in verb.params for option in each.opts}
        assert {word for word in words if word.startswith("-")} <= options
        return
    transfer = "" if command.startswith("transfer") else f'transfer = [{{ name = "a", points = {POINTS} }}]\n'
    light = LIGHT if "lighting" in command and "baked" not in command else ""
    light += LIT if command.startswith("lighting.") and light else ""
    tables = tomllib.loads(f"{command}\n{light}{transfer}{REST}")
    assert not list(misplaced(tables))
    scene = Scene.model_validate(without_lab(tables))
    load_profile(scene.profile, TABLE.parent)
