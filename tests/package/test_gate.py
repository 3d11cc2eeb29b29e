"""What validate --quick refuses without reading a file, no verb that reads packages takes."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from volprep_cli.main import command_line
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package


def add_a_file(package: Path) -> None:
    (package / "notes.txt").write_text("mine", encoding="utf-8")


def add_an_empty_folder(package: Path) -> None:
    (package / "notes").mkdir()


def shorten_a_file(package: Path) -> None:
    with (package / "preview.png").open("r+b") as file:
        file.truncate(file.seek(0, 2) - 1)


def remove_a_file(package: Path) -> None:
    (package / "preview.png").unlink()


def link_a_file(package: Path) -> None:
    (package / "preview.png").rename(package.parent / "elsewhere.png")
    (package / "preview.png").symlink_to(package.parent / "elsewhere.png")


def enlarge_a_level(package: Path) -> None:
    manifest = json.loads((package / "manifest.json").read_text(encoding="utf-8"))
    manifest["channels"][0]["levels"][1]["grid"]["shape_zyx"] = [2**31 - 1] * 3
    (package / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")


DAMAGES: dict[str, Callable[[Path], None]] = {
    "VP4010 .*notes.txt": add_a_file,
    "VP4010 .*notes/": add_an_empty_folder,
    "VP4008 .*preview.png": shorten_a_file,
    "VP4007 .*preview.png: (there is n|N)o such file": remove_a_file,
    "VP4007 .*preview.png: (not a regular file|Too many levels)": link_a_file,
    "VP4011 .*level": enlarge_a_level,
}
VERBS = [
    "inspect {}",
    "inspect {} --json",
    "inspect {} --picture a.png",
    "render {} -o a.png",
    "validate {} --quick",
    "validate {}",
    "export {} a.nii",
    "cut {} --center 1,1,1 -o cut",
    "zip {} -o a.zip",
    "import {} -o d.volpkg",
    "plan {}",
]


@pytest.mark.parametrize(("told", "damage"), DAMAGES.items(), ids=[each.__name__ for each in DAMAGES.values()])
def test_no_verb_takes_a_package_that_is_not_whole(sealed, tmp_path, monkeypatch, told, damage) -> None:
    damage(sealed)
    assert check(sealed)
    with pytest.raises(VolprepError, match=told):
        Package.open(sealed)
    room = tmp_path / "room"
    room.mkdir()
    monkeypatch.chdir(room)
    for verb in VERBS:
        words = verb.format(sealed).split()
        with pytest.raises(VolprepError, match=told):
            command_line(words)(words, standalone_mode=False)
    assert not list(room.iterdir())


def test_a_draft_may_hold_what_stages_have_not_yet_made_agree(draft) -> None:
    (draft.folder / "notes.txt").write_text("mine", encoding="utf-8")
    assert Package.open(draft.folder, allow_draft=True).manifest == draft.manifest
