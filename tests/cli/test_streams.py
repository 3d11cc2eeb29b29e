"""Whatever the shell gave as standard streams, folder and names: one message, the right status, nothing obeyed."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import nibabel
import numpy as np
import pytest
from command_line import COMMAND, ended, volprep
from hostile_text import made_hostile
from phantom_scene import phantom, write_phantom_scene

from volprep_formats.diagnostics import ExitStatus

EVIL = "a\x1b[31m\nvolprep: VP9999 \u202efdp\x9b2J"
NOBODY = 65534


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A folder with a scene and a draft."""
    folder = tmp_path_factory.mktemp("place")
    write_phantom_scene(folder)
    assert volprep("import", "phantom.toml", "-o", "draft.volpkg", cwd=folder).returncode == 0
    return folder


def shell(text: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a line of sh, in which volprep is the command."""
    script = f'volprep() {{ "{COMMAND[0]}" -c "{COMMAND[2]}" "$@"; }}\n{text}'
    return ended(["sh", "-c", script], cwd=folder, env={**os.environ, **environment})


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("streams", ["2>/dev/full", "2>&-", ">&- 2>&-", "<&- >&- 2>&-", ">/dev/null 2>/dev/full"])
@pytest.mark.parametrize(
    ("command", "status"),
    [
        ("import phantom.toml -o {}/a.volpkg", ExitStatus.OK),
        ("plan missing.toml", ExitStatus.SCENE),
        ("biuld x", ExitStatus.USAGE),
    ],
)
def test_streams_that_take_nothing_change_no_status(place, tmp_path, command, status, streams) -> None:
    done = shell(f"volprep {command.format(tmp_path)} {streams}", place)
    assert done.returncode == status, done.stdout + done.stderr
    if status == ExitStatus.OK:
        manifest = json.loads((tmp_path / "a.volpkg/manifest.json").read_text(encoding="utf-8"))
        assert manifest["state"] == "draft"


def test_a_result_in_json_that_goes_nowhere_is_an_error(place) -> None:
    done = shell("volprep inspect draft.volpkg --json >&-", place)
    assert (done.returncode, done.stderr[:16]) == (ExitStatus.OUTPUT, "volprep: VP7094 ")


def test_a_picture_is_not_mixed_with_what_is_printed_where_the_streams_are_closed(place, tmp_path) -> None:
    # The first file that is opened would be standard output.
    assert shell(f"volprep export draft.volpkg {tmp_path}/a.raw >&- 2>&-", place).returncode == 0
    assert (tmp_path / "a.raw").stat().st_size == phantom().nbytes


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("letters", [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C"}, {"LC_ALL": "POSIX"}])
@pytest.mark.parametrize("command", ["inspect draft.volpkg", "inspect draft.volpkg --json", "plan phantom.toml"])
def test_a_terminal_that_knows_only_ascii_is_no_error(place, letters, command) -> None:
    done = volprep(*command.split(), cwd=place, **letters)
    assert done.returncode == 0, done.stderr
    assert "45" in done.stdout
    if "PYTHONIOENCODING" in letters:
        assert done.stdout.isascii()
        assert "\\x" not in done.stdout
        assert "--json" in command or re.search(r"\d+x\d+x\d+", done.stdout)


def test_a_folder_that_was_deleted_is_told(place, tmp_path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    done = shell(f"rmdir {gone}; volprep inspect draft.volpkg; volprep build {place}/phantom.toml -o x", gone)
    assert done.returncode == ExitStatus.MACHINE
    told = done.stderr.splitlines()
    assert told[0].startswith("volprep: VP4001 draft.volpkg: no such package")
    assert told[1].startswith("volprep: VP7002 the folder that this command runs in no longer exists")


@pytest.mark.long(keep=2)
@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become somebody who may not")
@pytest.mark.parametrize(
    ("command", "statuses"),
    [
        ("inspect {}/draft.volpkg", {ExitStatus.PACKAGE, ExitStatus.MACHINE}),
        ("import {}/phantom.toml -o /tmp/never.volpkg", {ExitStatus.SCENE}),
        ("import {}/phantom.nii -o /tmp/never.volpkg", {ExitStatus.SOURCE, ExitStatus.MACHINE}),
        ("plan {}/phantom.nii", {ExitStatus.SOURCE, ExitStatus.MACHINE}),
        ("build {scene} -o {}/a.volpkg", {ExitStatus.OUTPUT}),
        ("import {scene} -o {}/a.volpkg", {ExitStatus.OUTPUT}),
        ("export {draft} {}/a.nii", {ExitStatus.OUTPUT}),
    ],
)
def test_a_folder_that_may_not_be_entered_is_no_defect(place, tmp_path, command, statuses) -> None:
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o700)
    (tmp_path / "phantom.raw").write_bytes((place / "phantom.raw").read_bytes())
    (tmp_path / "phantom.toml").write_bytes((place / "phantom.toml").read_bytes())
    words = command.format(closed, scene=tmp_path / "phantom.toml", draft=place / "draft.volpkg").split()
    code = f"""
import os, sys
import volprep_cli.build, volprep_cli.import_source, volprep_cli.export, volprep_cli.plan, volprep.pipeline.build
import volprep_formats.writers.nifti, volprep_formats.readers.nifti, volprep_formats.readers.raw
import volprep.pipeline.import_draft
for folder in ({str(tmp_path)!r}, *{[str(each) for each in tmp_path.parents][:-1]!r}):
    os.chmod(folder, os.stat(folder).st_mode | 0o055) if folder != "/" else None
os.setresgid({NOBODY}, {NOBODY}, {NOBODY}); os.setresuid({NOBODY}, {NOBODY}, {NOBODY})
{COMMAND[2]}
"""
    done = ended([sys.executable, "-c", code, *words])
    assert done.returncode in statuses, done.stdout + done.stderr
    assert len(re.findall(r"^volprep: VP\d{4} ", done.stderr, re.MULTILINE)) == 1
    assert "VP9001" not in done.stderr


@pytest.mark.long
@pytest.mark.parametrize("name", [EVIL, os.fsdecode(b"caf\xe9")], ids=["escapes", "not-utf-8"])
def test_names_reach_the_terminal_as_visible_escapes_and_json_as_unicode(tmp_path, name) -> None:
    folder = tmp_path / name
    folder.mkdir()
    nibabel.save(nibabel.Nifti1Image(phantom().T.astype(np.int16), np.eye(4)), tmp_path / "scan.nii")
    commands = [
        ("import", "scan.nii", "-o", folder / "a.volpkg"),
        ("inspect", folder / "a.volpkg"),
        ("stage", "quantize", folder / "a.volpkg"),
        ("export", folder / "a.volpkg", folder / "a.nrrd"),
        ("inspect", folder / "a.volpkg", "--json"),
    ]
    for command in commands:
        words = [os.fsencode(each) for each in command]
        done = subprocess.run([*COMMAND, *words], cwd=tmp_path, capture_output=True, check=False)
        assert done.returncode == 0, done.stderr
        text = (done.stdout + done.stderr).decode("utf-8")
        assert all(each.isprintable() for each in text.splitlines())
        assert not any(line.startswith("volprep: VP9999") for line in text.splitlines())
    told = json.loads(done.stdout)["package"]
    assert told.encode("utf-8")
    assert told.endswith("a.volpkg")
    assert (name in told) == name.isascii() or "caf\\xe9" in told or "\x1b" in told


PRINTS = """
import sys, warnings
from volprep_cli.streams import prepare_streams, unescaped
prepare_streams()
print("one\\x1b[2J\\x9b\\u202etwo\\nthree")
warnings.warn("four\\x1b]0;five\\x07")
unescaped(sys.stdout).write("\\x1b[1msix\\n")
"""


def test_whoever_prints_nothing_steers_the_terminal_but_colours_of_our_own() -> None:
    done = ended([sys.executable, "-c", PRINTS])
    assert done.stdout == "one\\x1b[2J\\x9b\\u202etwo\nthree\n\x1b[1msix\n"
    assert "four\\x1b]0;five\\x07" in done.stderr


@pytest.mark.long
def test_no_text_of_a_package_steers_the_terminal_or_makes_a_line(tmp_path) -> None:
    scene = write_phantom_scene(tmp_path, level_filter="box")
    assert volprep("build", scene, "-o", tmp_path / "p.volpkg").returncode == 0
    assert made_hostile(tmp_path / "p.volpkg", EVIL) > 50
    commands = (
        *("inspect p.volpkg", "inspect p.volpkg --json", "validate p.volpkg --quick", "validate p.volpkg --size 16"),
        *("render p.volpkg --transfer none -o a.png", "view p.volpkg -o p.html", "zip p.volpkg"),
    )
    said = {command: volprep(*command.split(), cwd=tmp_path) for command in commands}
    for command, done in said.items():
        text = done.stdout + done.stderr
        assert text.replace("\n", "").isprintable(), command
        assert not re.search("^volprep: VP9999|Warning", text, re.MULTILINE), command
    assert sum("a\\x1b[31m\\nvolprep" in done.stdout + done.stderr for done in said.values()) == 3
    assert "a\\x1b[31m\\nvolprep" in said["validate p.volpkg --size 16"].stderr
