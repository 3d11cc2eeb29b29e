"""Copies of the product in which scenes and tests are tried, with a bug or without."""

import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from queue import SimpleQueue

from .mutant import Mutant
from .native import NativeBuild
from .outcomes import Outcome, Run
from .overlay import Overlay

_SECONDS = 900.0
_MEMORY = Path("/dev/shm")  # noqa: S108 - a file system in memory: a build waits for the disk after each stage
_TRIAL = str(Path(__file__).with_name("trial.py"))
_PYTEST = ("-m", "pytest", "-q", "--no-header", "--tb=no", "-p", "no:cacheprovider")


class Copies:
    """Copies of the product, each used by one thread at a time, and native cores with a bug."""

    def __init__(self, work: Path, jobs: int, chosen: Sequence[Mutant]) -> None:
        """Make `jobs` copies below `work`. Native cores that `chosen` need are built when they are needed."""
        self._free: SimpleQueue[Overlay] = SimpleQueue()
        self._pool = ThreadPoolExecutor(jobs)
        self._threads = None if jobs == 1 else max(1, (os.cpu_count() or 1) // jobs)
        is_native = any(each.is_native for each in chosen)
        self._native = NativeBuild(work / "native") if is_native else None
        for job in range(jobs):
            self._free.put(Overlay(work / f"copy-{job}" / "product"))

    def without_bugs(self, run: Run, scenes: Sequence[str], tests: Sequence[str], save: Callable[[], None]) -> None:
        """Try scenes, and all tests in one process, without a bug; those that `run` has are left out."""
        trials: dict[Future[dict[str, str]], dict[str, str]] = {
            self._pool.submit(self._scene, scene): run.scenes for scene in scenes if scene not in run.scenes
        }
        if left := [test for test in tests if test not in run.tests]:
            trials[self._pool.submit(self._tests, left)] = run.tests
        for done in as_completed(trials):
            trials[done] |= done.result()
            save()

    def outcomes(self, run: Run, chosen: Sequence[Mutant], save: Callable[[], None]) -> None:
        """Plant each of `chosen`, native ones last, for they take a compiler; those that `run` has are left out."""
        left = sorted((each for each in chosen if each.name not in run.outcomes), key=lambda each: each.is_native)
        trials = [self._pool.submit(self._planted, each, run) for each in left]
        for done in as_completed(trials):
            outcome = done.result()
            run.outcomes[outcome.name] = outcome
            print(outcome.row, flush=True)
            save()

    @contextmanager
    def _copy(self) -> Iterator[Overlay]:
        overlay = self._free.get()
        try:
            yield overlay
        finally:
            self._free.put(overlay)

    def _scene(self, scene: str) -> dict[str, str]:
        with self._copy() as overlay:
            found = _trial(overlay, scene, self._threads)
        return {scene: str(found["said"]) if found["witness"] else ""}

    def _tests(self, tests: Sequence[str]) -> dict[str, str]:
        with self._copy() as overlay:
            failed = _tested(overlay, tests, self._threads, seconds=_SECONDS * len(tests))
        # A line that names none of them, such as "no end", counts for all.
        unnamed = [line for line in failed if not any(test in line for test in tests)]
        return {test: next((line for line in failed if test in line or line in unnamed), "") for test in tests}

    def _planted(self, mutant: Mutant, run: Run) -> Outcome:
        with self._copy() as overlay, _bug(overlay, mutant, self._native):
            begun = time.monotonic()
            found = _trial(overlay, mutant.scene, self._threads)
            usable = [test for test in mutant.tests if not run.tests[test]]
            failed = _tested(overlay, usable, self._threads, "-x") if usable else []
            seconds = time.monotonic() - begun
        counts = not run.scenes[mutant.scene]
        return Outcome(
            mutant.name,
            mutant.says,
            mutant.file,
            bool(found["validate"]) and counts,
            bool(found["witness"]) and counts,
            bool(failed),
            str(found["said"]),
            failed[0] if failed else "",
            round(seconds, 1),
        )


@contextmanager
def _bug(overlay: Overlay, mutant: Mutant, native: NativeBuild | None) -> Iterator[None]:
    """Plant a bug in a copy, and take it out in the end."""
    plant, mend = partial(overlay.plant, mutant), partial(overlay.mend, mutant)
    if mutant.is_native and native is not None:
        plant, mend = partial(overlay.use_core, native.library(mutant)), overlay.use_installed_core
    plant()
    try:
        yield
    finally:
        mend()


@contextmanager
def _scratch() -> Iterator[str]:
    with tempfile.TemporaryDirectory(dir=_MEMORY if _MEMORY.is_dir() else None) as folder:
        yield folder


def _trial(overlay: Overlay, scene: str, threads: int | None) -> dict[str, object]:
    with _scratch() as folder:
        try:
            done = overlay.run(_TRIAL, scene, folder, seconds=_SECONDS, threads=threads)
        except subprocess.TimeoutExpired:
            return {"validate": True, "witness": True, "said": "no end"}
    try:
        result: dict[str, object] = json.loads(done.stdout.splitlines()[-1])
    except (IndexError, ValueError):
        return {"validate": True, "witness": True, "said": done.stderr.strip()[-300:] or "no answer"}
    return result


def _tested(
    overlay: Overlay, tests: Sequence[str], threads: int | None, *options: str, seconds: float = _SECONDS
) -> list[str]:
    """Return a line for each test that fails; what pytest said if it ended otherwise."""
    with _scratch() as folder:
        # A folder of its own: pytest removes those of other runs.
        arguments = (*_PYTEST, *options, f"--basetemp={folder}/tests", *tests)
        try:
            done = overlay.run(*arguments, seconds=seconds, threads=threads)
        except subprocess.TimeoutExpired:
            return ["no end"]
    if done.returncode == 0:
        return []
    lines = [line[:200] for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return lines or [(done.stdout[-200:] + done.stderr[-200:])[:200] or "no answer"]
