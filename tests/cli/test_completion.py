"""Completion of the command line in a shell, and the name of the build."""

import subprocess
import sys
from pathlib import Path

import pytest
from command_line import COMMAND, volprep

BUILD = "from volprep_cli.version import version_text; print(version_text())"


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("volprep bu", {"build"}),
        ("volprep v", {"validate", "view"}),
        ("volprep build --gr", {"--grid"}),
        ("volprep render --back", {"--background"}),
        ("volprep render --background tr", {"transparent"}),
        ("volprep build --preset mr", {"mr-head", "mr-head-photograph"}),
        ("volprep plan --profile gles2", {"gles2-2048", "gles2-4096"}),
        ("volprep batch --profile phone-a", {"phone-android", "phone-apple"}),
        ("volprep nonsense --x", set()),
    ],
)
def test_a_shell_is_offered_verbs_options_and_choices(words: str, offered: set[str]) -> None:
    last = str(len(words.split()) - 1)
    run = volprep(_VOLPREP_COMPLETE="complete_bash", COMP_WORDS=words, COMP_CWORD=last)
    assert set(run.stdout.split()) == offered


def test_the_script_that_a_shell_loads_completes_in_that_shell(tmp_path: Path) -> None:
    command = tmp_path / "volprep"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -c "{COMMAND[-1]}" "$@"\n')
    command.chmod(0o755)
    # As Tab does it: load the script, then call the function that it registered.
    typed = (
        f'PATH="{tmp_path}:$PATH"; eval "$(volprep --show-completion)"; complete -p volprep; '
        "COMP_WORDS=(volprep pla); COMP_CWORD=1; _volprep_completion volprep; echo ${COMPREPLY[@]}"
    )
    run = subprocess.run(["bash", "-c", typed], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines() == ["complete -o default -F _volprep_completion volprep", "plan"]


@pytest.mark.parametrize(
    ("written", "told"), [("0123456789ab\n", "volprep 9.8.7 (0123456789ab)"), (None, "volprep 9.8.7")]
)
def test_the_version_names_the_revision_that_was_written_when_it_was_built(tmp_path: Path, written, told) -> None:
    metadata = tmp_path / "volprep-9.8.7.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: volprep\nVersion: 9.8.7\n")
    if written is not None:
        (metadata / "build.txt").write_text(written)
    # No git: what is asked for at run time cannot have come from it.
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {BUILD}"
    run = subprocess.run([sys.executable, "-c", code], env={"PATH": ""}, capture_output=True, text=True, check=True)
    assert run.stdout == f"{told}\n"
