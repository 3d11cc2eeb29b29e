"""Whatever kill -9 leaves is the state before or the state after."""

import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from command_line import ended, volprep
from phantom_scene import write_phantom_scene

CRASH = Path(__file__).with_name("crash.py")


@pytest.fixture
def room() -> Iterator[Path]:
    """Folder in memory where there is one: a kill does not lose what the system holds, and a disk takes its time."""
    memory = Path("/dev/shm")  # noqa: S108 -- the folder in it is new and private
    with TemporaryDirectory(dir=memory if memory.is_dir() else None) as name:
        yield Path(name)


def crash(work: str, *places: Path, script: Path = CRASH) -> list[dict[str, object]]:
    # A child that was forked has none of the threads that its parent's kernels would wait for.
    done = ended([sys.executable, script, work, *places], env={**os.environ, "OMP_NUM_THREADS": "1"})
    assert done.returncode == 0, done.stdout + done.stderr
    runs = [json.loads(line) for line in done.stdout.splitlines()]
    assert not [run for run in runs if "failed" in run]
    return runs


def test_a_stage_killed_before_any_file_operation_leaves_the_draft_before_or_after_it(room: Path) -> None:
    runs = crash("rerun_stage", room)
    states = [run["state"] for run in runs]
    assert not [run for run in runs if run["findings"]]
    assert len(states) > 20
    assert states == sorted(states, reverse=True)
    assert set(states) == {"before", "after"}


@pytest.mark.long
def test_a_killed_seal_ends_as_the_same_sealed_package(room: Path) -> None:
    runs = crash("seal", room)
    assert all(run["same"] for run in runs)
    assert {run["state"] for run in runs} == {"draft", "VP4006"}


def test_a_killed_create_can_be_done_again(room: Path) -> None:
    runs = crash("create", room)
    assert len(runs) > 5
    assert {run["state"] for run in runs} == {"draft"}


@pytest.mark.long
def test_a_killed_publish_leaves_the_older_or_the_newer_package_and_the_next_one_clears_up(room: Path) -> None:
    runs = crash("publish_over", room)
    states = [run["state"] for run in runs]
    assert set(states) == {"old", "new"}
    assert states == sorted(states, reverse=True)
    assert all(run["healed"] and run["left"] == ["new", "old", "target"] for run in runs)


@pytest.mark.long
def test_without_exchange_a_killed_publish_leaves_one_package_or_none(room: Path) -> None:
    runs = crash("publish_without_exchange", room)
    states = [run["state"] for run in runs]
    assert set(states) == {"old", "none", "new"}
    assert all(run["healed"] and run["left"] == ["new", "old", "target"] for run in runs)


@pytest.mark.long
@pytest.mark.timeout(60)
def test_builds_killed_at_thirty_random_moments_never_leave_a_broken_package(tmp_path: Path) -> None:
    runs = crash("at_random", tmp_path)
    assert len(runs) == 30
    assert all(run["sound"] for run in runs)


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> Path:
    """A scene with sub-volumes, and its package phantom.volpkg beside it."""
    scene = write_phantom_scene(tmp_path_factory.mktemp("scene"))
    with scene.open("a", encoding="utf-8") as file:
        file.write("\n[grid]\nsize = 24\n")
    done = volprep("build", scene, "-o", scene.with_name("phantom.volpkg"))
    assert done.returncode == 0, done.stderr
    return scene


@pytest.mark.long
@pytest.mark.parametrize("verb", ["export_file", "export_raw", "export_series", "zip_package", "cut"])
def test_a_killed_verb_leaves_the_older_files_or_the_newer_ones_and_the_next_one_clears_up(scene, room, verb) -> None:
    script = CRASH.with_name("crash_verbs.py")
    runs = crash(verb, scene.with_name("phantom.volpkg"), scene, room / "out", script=script)
    assert len(runs) > 5
    assert not [run for run in runs if run["broken"]]
    assert all(run["healed"] and not run["hidden"] for run in runs)
    assert [run["new"] for run in runs] == sorted(run["new"] for run in runs)
    assert {run["new"] for run in runs} == {False, True}


@pytest.mark.long
def test_a_killed_import_is_done_again_by_the_next_one(scene, room) -> None:
    script = CRASH.with_name("crash_verbs.py")
    runs = crash("import_scan", scene.with_name("phantom.volpkg"), scene, room / "out", script=script)
    assert len(runs) > 20
    assert all(run["healed"] and not run["hidden"] for run in runs)
