"""What the Makefile stands on: pinned versions, the search for a Python, and steps that tell how they end."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PINNED = {
    canonicalize_name(name): Version(version)
    for name, version in (
        line.split("==")
        for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
        if not line.startswith("#")
    )
}
REQUIREMENTS = [
    *PROJECT["build-system"]["requires"],
    *PROJECT["project"]["dependencies"],
    *(line for name, extra in PROJECT["project"]["optional-dependencies"].items() if name != "all" for line in extra),
]


@pytest.mark.parametrize("requirement", [Requirement(line) for line in REQUIREMENTS], ids=str)
def test_every_requirement_is_pinned_to_a_version_that_it_allows(requirement: Requirement) -> None:
    assert requirement.specifier.contains(PINNED[canonicalize_name(requirement.name)])


def test_make_alone_prints_the_commands() -> None:
    run = subprocess.run(["make", "--no-print-directory"], cwd=ROOT, capture_output=True, text=True, check=True)
    first = ["demo", "test", "test-long", "lint", "docs", "bench", "papers", "mutants", "levels-study"]
    last = [
        "fuzz",
        "fuzz-native",
        "fuzz-c",
        "fuzz-readers",
        "tampers",
        "strangers",
        "combinations",
        "phantoms",
        "sanitize",
        "wheel",
    ]
    assert re.findall(r"^make ([\w-]+) ", run.stdout, flags=re.MULTILINE) == first + last


@pytest.mark.parametrize(("command", "status"), [("exit 0", 0), ("echo what went wrong; exit 3", 3)])
def test_a_step_ends_as_its_command_does_and_shows_what_went_wrong(tmp_path: Path, command: str, status: int) -> None:
    run = subprocess.run(
        [ROOT / "tools" / "step.sh", "name", "trying", "bash", "-c", command],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=9,  # less than a heartbeat, for which a step must not wait
    )
    assert run.returncode == status
    assert run.stdout.startswith("volprep: trying ...\n")
    assert ("what went wrong" in run.stdout) == (status != 0)
    assert ("FAILED with status 3" in run.stderr) == (status != 0)


def test_a_python_that_is_too_old_is_not_taken(tmp_path: Path) -> None:
    old = tmp_path / "python3"
    old.write_text("#!/bin/sh\nexit 1\n")
    old.chmod(0o755)
    find = ROOT / "tools" / "find_python.sh"
    run = subprocess.run([find], env={"PATH": "/usr/bin:/bin", "PYTHON": str(old)}, capture_output=True, check=False)
    assert (run.returncode, run.stdout) == (1, b"")


def test_the_python_of_a_venv_stands_for_the_one_it_was_made_from() -> None:
    find = ROOT / "tools" / "find_python.sh"
    environment = {"PATH": "/usr/bin:/bin", "PYTHON": sys.executable}
    run = subprocess.run([find], env=environment, capture_output=True, text=True, check=True)
    assert Path(run.stdout.strip()).resolve() == Path(sys.executable).resolve()
    assert not run.stdout.startswith(sys.prefix) or sys.prefix == sys.base_prefix
