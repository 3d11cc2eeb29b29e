"""kill -9 at random moments: the old package or none, and the next build succeeds."""

import random
import time
from pathlib import Path

import pytest
from build_child import start_build
from long_runs import share_of
from phantom_scene import write_phantom_scene

from volprep_formats.package.check import check

KILLS = share_of(20, 10)
MOST_TRIES = 3 * KILLS
"""A build that goes on where another was killed, or on a machine that is less busy now, may end before its kill."""


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def finish(scene: Path, target: Path) -> float:
    began = time.perf_counter()
    process = start_build(scene, target)
    process.join()
    assert process.exitcode == 0
    return time.perf_counter() - began


@pytest.mark.long
@pytest.mark.timeout(60 * KILLS)
def test_a_build_killed_at_a_random_moment_leaves_the_old_package_or_none(tmp_path: Path) -> None:
    # Two scenes that differ in one stage, each built undisturbed first: what there is must be one of these two.
    scenes, wanted, durations_s = [], [], []
    for number, cutoff in enumerate((0.9, 0.8)):
        folder = tmp_path / str(number)
        folder.mkdir()
        scene = write_phantom_scene(folder, more=f"\n[render]\nopacity_cutoff = {cutoff}\n")
        durations_s.append(finish(scene, folder / "phantom.volpkg"))
        scenes.append(scene)
        wanted.append(contents(folder / "phantom.volpkg"))
    assert wanted[0] != wanted[1]

    moments = random.Random(20)  # noqa: S311 - chance, not secrets
    target = tmp_path / "target" / "phantom.volpkg"
    allowed: list[dict[str, bytes]] = []
    killed = 0
    for kill in range(MOST_TRIES):
        new = kill % 2
        process = start_build(scenes[new], target)
        process.join(moments.uniform(0.0, min(durations_s)))
        killed += process.is_alive()
        process.kill()
        process.join()
        if target.exists():
            assert check(target) == []
            # A build that was killed after it published, or too late, has made the new one.
            assert contents(target) in [*allowed, wanted[new]]
        else:
            assert not allowed
        # Every other kill is followed by a build that runs to its end, the others by the next kill.
        if kill % 2 == 1:
            finish(scenes[new], target)
            assert contents(target) == wanted[new]
            assert {path.name for path in target.parent.iterdir()} == {target.name, f"{target.name}.origin.json"}
        allowed = [contents(target)] if target.exists() else []
        if killed >= KILLS:
            break
    assert killed >= KILLS
