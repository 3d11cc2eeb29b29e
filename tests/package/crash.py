"""Runs a piece of work again and again, and kills it with SIGKILL at a new place each time. Not a test itself.

    python crash.py WORK FOLDER

`every_step` kills before the n-th operation on the file system, for n = 0, 1, ... until the work ends by itself;
`at_random` kills after a random time. Prints one line of JSON for each run: what the work left.
"""

import json
import os
import random
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from conftest import STAGES, build, heading, run_import, run_seal, run_shaders, run_texture

from volprep_formats import output
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.package.storage.publish import publish, remove_package

OPERATIONS = ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.truncate", "ctypes.")


def die_before(step: int) -> None:
    left = step

    def hook(event: str, _arguments: tuple[object, ...]) -> None:
        nonlocal left
        if event.startswith(OPERATIONS):
            if left == 0:
                os.kill(os.getpid(), signal.SIGKILL)
            left -= 1

    sys.addaudithook(hook)


def killed(work: Callable[[], object], *, step: int | None = None, after_s: float = 0.0) -> bool:
    """Run `work` in a child; say whether it was killed before its end."""
    child = os.fork()
    if child == 0:
        if step is not None:
            die_before(step)
        try:
            work()
        except BaseException as error:  # noqa: BLE001 -- the child must not go on as a second parent
            print(json.dumps({"failed": repr(error)}), flush=True)
            os._exit(1)
        os._exit(0)
    if step is None:
        time.sleep(after_s)
        os.kill(child, signal.SIGKILL)
    return os.WIFSIGNALED(os.waitpid(child, 0)[1])


def every_step(prepare: Callable[[], Callable[[], object]], look: Callable[[], dict[str, object]]) -> Iterator[str]:
    step = 0
    alive = True
    while alive:
        alive = killed(prepare(), step=step)
        yield json.dumps({"step": step, "killed": alive, **look()})
        step += 1


def tree(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def fresh(folder: Path, source: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(source, folder)
    return folder


def draft_state(folder: Path, states: dict[str, dict[str, bytes]]) -> dict[str, object]:
    draft = Draft.open(folder)
    found = tree(folder)
    state = next((name for name, content in states.items() if content == found), "neither")
    for stage in STAGES:
        if stage.__name__ not in {f"run_{record.name}" for record in draft.manifest.stages}:
            stage(draft)
    return {"state": state, "findings": [finding.summary for finding in check(folder)]}


def rerun_stage(room: Path) -> Iterator[str]:
    before, after, folder = room / "before", room / "after", room / "draft"
    started = Draft.create(before, heading())
    run_import(started)
    run_texture(started)
    run_import(Draft.open(fresh(after, before)), seed=1)
    states = {"before": tree(before), "after": tree(after)}

    def prepare() -> Callable[[], object]:
        fresh(folder, before)
        return lambda: run_import(Draft.open(folder), seed=1)

    return every_step(prepare, lambda: draft_state(folder, states))


def seal(room: Path) -> Iterator[str]:
    before, folder = room / "before", room / "draft"
    started = Draft.create(before, heading())
    for stage in (run_import, run_texture, run_shaders):
        stage(started)
    sealed = tree(build(room / "sealed"))

    def prepare() -> Callable[[], object]:
        fresh(folder, before)
        return lambda: run_seal(Draft.open(folder))

    def look() -> dict[str, object]:
        try:
            run_seal(Draft.open(folder))
        except VolprepError as error:
            return {"state": error.code, "same": tree(folder) == sealed}
        return {"state": "draft", "same": tree(folder) == sealed}

    return every_step(prepare, look)


def create(room: Path) -> Iterator[str]:
    folder = room / "inner" / "draft"

    def prepare() -> Callable[[], object]:
        shutil.rmtree(folder.parent, ignore_errors=True)
        return partial(Draft.create, folder, heading())

    def look() -> dict[str, object]:
        if (folder / MANIFEST).exists():
            return {"state": Draft.open(folder).manifest.state}
        return {"state": Draft.create(folder, heading()).manifest.state}

    return every_step(prepare, look)


def publish_over(room: Path) -> Iterator[str]:
    new, old = build(room / "new", seed=1), build(room / "old", seed=0)
    made, target = room / "partial", room / "target"
    states = {"new": tree(new), "old": tree(old)}

    def prepare() -> Callable[[], object]:
        shutil.rmtree(room / "partial.old", ignore_errors=True)
        fresh(made, new)
        fresh(target, old)
        return lambda: publish(made, target)

    def look() -> dict[str, object]:
        found = tree(target) if target.exists() else {}
        state = next((name for name, content in states.items() if content == found), "none" if not found else "broken")
        # What a build does next: clear away what was left, build again, publish.
        if made.exists():
            remove_package(made)
        publish(fresh(made, new), target)
        return {
            "state": state,
            "healed": tree(target) == states["new"],
            "left": sorted(path.name for path in room.iterdir()),
        }

    return every_step(prepare, look)


def publish_without_exchange(room: Path) -> Iterator[str]:
    output._renameat2 = lambda *_: False
    return publish_over(room)


def at_random(room: Path) -> Iterator[str]:
    """A build over an older package, killed at 30 random moments; each run goes on with what the one before left."""
    old, new = tree(build(room / "old", seed=0)), tree(build(room / "new", seed=1))
    made, target = room / "partial", room / "target"

    def work() -> None:
        for seed in (0, 1) * 1000:
            if made.exists():
                remove_package(made)
            build(made, seed=seed)
            publish(made, target)

    chance = random.Random(20)  # noqa: S311 -- no secret
    build(target, seed=0)
    for run in range(30):
        killed(work, after_s=chance.uniform(0.0, 0.12))
        yield json.dumps({"run": run, "sound": tree(target) in (old, new)})


def main() -> None:
    # Children are forked without running finally blocks or flushing: nothing may be buffered when they are.
    work, room = sys.argv[1], Path(sys.argv[2])
    for line in globals()[work](room):
        print(line, flush=True)


if __name__ == "__main__":
    main()
