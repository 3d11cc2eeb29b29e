"""volprep doctor on this machine, and on the same machine with something hidden from it."""

import json
import os
import subprocess
import sys

import pytest
from command_line import ended

RUN = "from volprep_cli.main import main; main()"
NO_DRIVER = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nowhere"}


def doctor(*arguments: str, hidden_module: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
    hide = f"import sys; sys.modules[{hidden_module!r}] = None; " if hidden_module else ""
    return ended(
        [sys.executable, "-c", hide + RUN, "doctor", *arguments], env={**os.environ, **environment}, timeout=60
    )


def found(run: subprocess.CompletedProcess[str]) -> dict[str, bool]:
    return {f"{fact['topic']} {fact['name']}": fact["found"] for fact in json.loads(run.stdout)["facts"]}


def test_a_machine_that_make_has_set_up_is_ready() -> None:
    run = doctor("--json")
    assert run.returncode == 0, run.stdout + run.stderr
    facts = found(run)
    # Not 1.1: Debian 13 builds Mesa without it.
    for level in ("2.0", "3.0", "3.1"):
        assert facts[f"OpenGL ES {level}"]
    assert all(there for name, there in facts.items() if name.startswith("DICOM"))
    assert facts["volprep native core"]
    for name in ("gles2-2048", "gles2-4096", "gles3"):
        assert facts[f"profile {name}"]
    probes = {each["profile"]: each["results"] for each in json.loads(run.stdout)["probes"]}
    assert len(probes["gles3"]) > len(probes["gles2-2048"]) > 5
    assert all(each["works"] and len(each["drawn"]) == 4 for each in probes["gles3"])


def test_every_fact_is_one_line() -> None:
    facts = json.loads(doctor("--json").stdout)["facts"]
    lines = doctor().stdout.splitlines()
    assert len(lines) == len(facts)
    for line, fact in zip(lines, facts, strict=True):
        assert line.startswith("OK" if fact["found"] else ("missing", "no")[not fact["needed"]])
        assert fact["name"] in line
        # Free memory changes from one run to the next.
        assert fact["detail"] in line or fact["name"] == "memory"


def test_without_a_driver_every_level_of_opengl_es_is_missing_and_the_status_is_8() -> None:
    run = doctor(**NO_DRIVER)
    assert run.returncode == 8
    assert "VP7001" in run.stderr
    assert "Traceback" not in run.stderr
    run = doctor("--json", **NO_DRIVER)
    assert run.returncode == 8
    facts = found(run)
    assert not any(there for name, there in facts.items() if name.startswith(("OpenGL ES", "profile")))
    assert facts["volprep native core"]


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("module", "name", "status"),
    [
        ("volprep.kernels._native", "volprep native core", 8),
        ("volprep_formats._vdb", "volprep OpenVDB", 0),
        ("OpenImageIO", "files pictures", 8),
        ("OpenGL", "OpenGL ES EGL", 8),
        ("imagecodecs", "DICOM JPEG lossless", 0),
        ("jinja2", "extra validate", 0),
        ("zarr", "extra zarr", 0),
    ],
)
def test_a_missing_part_is_a_fact_with_a_remedy(module: str, name: str, status: int) -> None:
    run = doctor("--json", hidden_module=module)
    assert run.returncode == status, run.stderr
    assert "Traceback" not in run.stderr
    (fact,) = [fact for fact in json.loads(run.stdout)["facts"] if f"{fact['topic']} {fact['name']}" == name]
    assert not fact["found"]
    assert fact["remedy"]
