"""The container image: what its steps name exists, and volprep runs as a user without rights."""

import re
import shlex
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
LINES = (ROOT / "Dockerfile").read_text(encoding="utf-8").splitlines()
STEPS = "\n".join(line for line in LINES if not line.startswith("#")).replace("\\\n", "")
BUILD, RUNTIME = (stage.splitlines() for stage in STEPS.split("FROM debian:12-slim")[1:])


def argument(stage: list[str], instruction: str) -> str:
    """Return what the last such instruction of a stage says."""
    return [line.removeprefix(instruction).strip() for line in stage if line.startswith(instruction)][-1]


def test_the_entry_point_is_the_command_of_the_wheel_in_the_venv_that_the_image_makes() -> None:
    entry = Path(tomllib.loads(f"entry = {argument(RUNTIME, 'ENTRYPOINT')}")["entry"][0])
    venv = re.search(r"-m venv (\S+)", STEPS)[1]
    assert str(entry.parent) == f"{venv}/bin"
    assert entry.name in tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]


def test_the_image_runs_as_a_user_that_it_adds() -> None:
    assert argument(RUNTIME, "USER") == re.search(r"useradd .* (\w+)$", STEPS, re.MULTILINE)[1] != "root"


def test_the_wheel_comes_from_the_target_and_the_folder_of_make() -> None:
    assert argument(BUILD, "RUN").split() == ["make", "wheel"]
    assert re.search(r"^wheel:", (ROOT / "Makefile").read_text(), re.MULTILINE)
    _, *files, _ = shlex.split(argument(RUNTIME, "COPY"))
    folder = argument(BUILD, "WORKDIR")
    assert files == [f"{folder}/dist/*.whl", f"{folder}/constraints.txt"]
    ignored = (ROOT / ".dockerignore").read_text().splitlines()
    assert {"dist", ".venv", "build"} <= set(ignored)
    assert "constraints.txt" not in ignored


def test_the_packages_for_drawing_are_those_of_the_set_up() -> None:
    wanted = set(re.search(r"--no-install-recommends\s+(python3 .*?) +&&", STEPS)[1].split())
    things = (ROOT / "tools" / "system_packages.sh").read_text()
    drawing = {word for name in ("gles", "mesa") for word in re.search(rf'"{name}\|[^|]*\|([^|]*)', things)[1].split()}
    assert wanted == {"python3", "python3-venv", *drawing}
