"""`make mutants`: plants bugs one by one, and writes to out/mutants who finds each.

For each bug a package is built and validated, the witness is asked, and the tests that are named for it run; all in a
copy of the product. Scenes and tests run once before without a bug: one that finds something there counts for no bug,
and is named. Exit status 1 if the tests miss a bug, or if something was found without one.

`--jobs 16` tries so many bugs at a time, each in a copy of its own. `--part 1/3` takes every third bug, for three
machines; `--merge` puts the JSON files of several runs together, later ones replacing earlier ones.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import SimpleQueue

from .catalogue import MUTANTS
from .mutant import ROOT, Mutant
from .native import NativeBuild
from .overlay import Overlay

_SECONDS = 900.0
_TRIAL = str(Path(__file__).with_name("trial.py"))


@dataclass(frozen=True)
class Outcome:
    """Who found a bug."""

    name: str
    says: str
    file: str
    validate: bool
    witness: bool
    """`validate --witness`: the verdict or the witness."""
    tests: bool
    said: str
    """Items that verdict and witness named."""
    failed: str
    """The test that failed first."""
    seconds: float


@dataclass(frozen=True)
class Without:
    """What finds something although there is no bug."""

    scenes: frozenset[str]
    tests: frozenset[str]
    said: tuple[str, ...]
    """A line for each."""


class Copies:
    """Copies of the product, each used by one thread at a time, and native cores with a bug."""

    def __init__(self, work: Path, jobs: int, chosen: Sequence[Mutant]) -> None:
        """Make `jobs` copies below `work`, and build the native cores that `chosen` need, one after another."""
        self._free: SimpleQueue[Overlay] = SimpleQueue()
        self._pool = ThreadPoolExecutor(jobs)
        self._threads = None if jobs == 1 else max(1, (os.cpu_count() or 1) // jobs)
        natives = [each for each in chosen if each.is_native]
        build = NativeBuild(work / "native") if natives else None
        self._libraries: dict[str | None, Path] = {}
        if build is not None:
            self._libraries = {each.name: build.library(each) for each in natives} | {None: build.library(None)}
        for job in range(jobs):
            self._free.put(Overlay(work / f"copy-{job}" / "product"))

    def without_bugs(self, scenes: Sequence[str], tests: Sequence[str]) -> Without:
        """Try scenes and tests without a bug."""
        tried = [*self._pool.map(self._scene, scenes)]
        tested = [*self._pool.map(self._test, tests)]
        bad = {scene: said for scene, said in zip(scenes, tried, strict=True) if said}
        failed = {test: said for test, said in zip(tests, tested, strict=True) if said}
        said = [f"the scene {scene} is not proved: {why}" for scene, why in bad.items()]
        said += [f"a test fails: {why}" for why in failed.values()]
        return Without(frozenset(bad), frozenset(failed), tuple(said))

    def outcomes(self, chosen: Sequence[Mutant], without: Without) -> list[Outcome]:
        """Plant each of `chosen`."""
        return [*self._pool.map(lambda each: self._tried(each, without), chosen)]

    def _scene(self, scene: str) -> str:
        overlay = self._free.get()
        try:
            found = _trial(overlay, scene, self._threads)
        finally:
            self._free.put(overlay)
        return str(found["said"]) if found["witness"] else ""

    def _test(self, test: str) -> str:
        overlay = self._free.get()
        try:
            found, first = _tested(overlay, [test], self._threads)
        finally:
            self._free.put(overlay)
        return first if found else ""

    def _tried(self, mutant: Mutant, without: Without) -> Outcome:
        overlay = self._free.get()
        try:
            return self._planted(overlay, mutant, without)
        finally:
            self._free.put(overlay)

    def _planted(self, overlay: Overlay, mutant: Mutant, without: Without) -> Outcome:
        begun = time.monotonic()
        if mutant.is_native:
            overlay.use_library(self._libraries[mutant.name])
        overlay.plant(mutant)
        usable = [test for test in mutant.tests if test not in without.tests]
        try:
            found = _trial(overlay, mutant.scene, self._threads)
            tests, failed = _tested(overlay, usable, self._threads) if usable else (False, "")
        finally:
            overlay.mend(mutant)
            if mutant.is_native:
                overlay.use_library(self._libraries[None])
        counts = mutant.scene not in without.scenes
        outcome = Outcome(
            mutant.name,
            mutant.says,
            mutant.file,
            bool(found["validate"]) and counts,
            bool(found["witness"]) and counts,
            tests,
            str(found["said"]),
            failed,
            round(time.monotonic() - begun, 1),
        )
        print(_row(outcome), flush=True)
        return outcome


def main() -> int:
    """Try the named bugs, or all of them; or put the results of several runs together."""
    parser = argparse.ArgumentParser(prog="make mutants", description=__doc__)
    parser.add_argument("names", nargs="*", help="bugs to plant; all if absent")
    parser.add_argument("--out", type=Path, default=ROOT / "out/mutants", help="folder of the table")
    parser.add_argument("--jobs", type=int, default=1, help="bugs to try at a time")
    parser.add_argument("--part", default="1/1", help="i/n: every n-th bug from the i-th on, for several machines")
    parser.add_argument("--python-only", action="store_true", help="leave out bugs of the native core: no compiler")
    parser.add_argument("--merge", type=Path, nargs="+", help="JSON files of several runs, to put together")
    asked = parser.parse_args()
    if asked.merge:
        return _merged(asked.out, asked.merge)
    part, parts = (int(each) for each in asked.part.split("/"))
    if unknown := set(asked.names) - {each.name for each in MUTANTS}:
        parser.error(f"no bug is named {', '.join(sorted(unknown))}")
    named = [each for each in MUTANTS if not asked.names or each.name in asked.names]
    chosen = [each for each in named if not (asked.python_only and each.is_native)][part - 1 :: parts]
    copies = Copies(ROOT / "build/mutants" / f"{part}-of-{parts}", asked.jobs, chosen)
    scenes = [*dict.fromkeys(each.scene for each in chosen)]
    tests = [*dict.fromkeys(test for each in chosen for test in each.tests)]
    without = copies.without_bugs(scenes, tests)
    print("\n".join(f"without a bug, {each}" for each in without.said) or "without a bug nothing is found", flush=True)
    outcomes = copies.outcomes(chosen, without)
    _write(asked.out, outcomes, without.said, "" if parts == 1 else f"-{part}-of-{parts}")
    return 0 if all(each.tests for each in outcomes) and not without.said else 1


def _merged(folder: Path, files: Iterable[Path]) -> int:
    """Write one table of several runs, in the order of the catalogue."""
    records = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    found: Mapping[str, Outcome] = {each["name"]: Outcome(**each) for record in records for each in record["outcomes"]}
    outcomes = [found[mutant.name] for mutant in MUTANTS if mutant.name in found]
    said = [*dict.fromkeys(line for record in records for line in record["without_bugs"])]
    _write(folder, outcomes, said, "")
    if missing := [mutant.name for mutant in MUTANTS if mutant.name not in found]:
        print(f"not tried: {', '.join(missing)}")
    return 0 if not missing and all(each.tests for each in outcomes) and not said else 1


def _trial(overlay: Overlay, scene: str, threads: int | None) -> dict[str, object]:
    with tempfile.TemporaryDirectory() as folder:
        try:
            done = overlay.run(_TRIAL, scene, folder, seconds=_SECONDS, threads=threads)
        except subprocess.TimeoutExpired:
            return {"validate": True, "witness": True, "said": "no end"}
    try:
        result: dict[str, object] = json.loads(done.stdout.splitlines()[-1])
    except (IndexError, ValueError):
        return {"validate": True, "witness": True, "said": done.stderr.strip()[-300:] or "no answer"}
    return result


def _tested(overlay: Overlay, tests: Iterable[str], threads: int | None) -> tuple[bool, str]:
    """Return whether a test fails, and the first that does."""
    # A folder of its own: pytest removes those of other runs.
    own = ("-p", "no:cacheprovider", f"--basetemp={overlay.folder.parent / 'tests'}")
    arguments = ("-m", "pytest", "-x", "-q", "--no-header", "--tb=no", *own, *tests)
    try:
        done = overlay.run(*arguments, seconds=_SECONDS, threads=threads)
    except subprocess.TimeoutExpired:
        return True, "no end"
    if done.returncode == 0:
        return False, ""
    lines = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return True, (lines[0] if lines else done.stdout[-200:] + done.stderr[-200:])[:200]


def _row(outcome: Outcome) -> str:
    marks = ("found" if each else "–" for each in (outcome.validate, outcome.witness, outcome.tests))
    return f"| {outcome.name} | {outcome.says} | {' | '.join(marks)} |"


def _write(folder: Path, outcomes: Sequence[Outcome], without: Sequence[str], suffix: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    counts = {name: sum(getattr(each, name) for each in outcomes) for name in ("validate", "witness", "tests")}
    record = {
        "count": len(outcomes),
        "found": counts,
        "without_bugs": [*without],
        "outcomes": [asdict(each) for each in outcomes],
    }
    (folder / f"mutants{suffix}.json").write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    (folder / f"mutants{suffix}.md").write_text(table_of(outcomes), encoding="utf-8")
    print(table_of(outcomes))


def table_of(outcomes: Sequence[Outcome]) -> str:
    """Return the table, with the counts below."""
    count = len(outcomes)
    found = [sum(getattr(each, name) for each in outcomes) for name in ("validate", "witness", "tests")]
    head = ["| bug | the fault | validate | validate --witness | tests |", "|---|---|---|---|---|"]
    last = f"| **{count}** | | **{found[0]}** | **{found[1]}** | **{found[2]}** |"
    return "\n".join([*head, *map(_row, outcomes), last]) + "\n"


if __name__ == "__main__":
    sys.exit(main())
