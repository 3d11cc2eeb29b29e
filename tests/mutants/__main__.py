"""`make mutants`: plants bugs one by one, and writes to out/mutants who finds each.

For each bug a package is built and validated, the witness is asked, and the tests that are named for it run; all in a
copy of the product. Tests that fail without a bug count for nothing: they run once before. Exit status 1 if the tests
miss a bug.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

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


def main() -> int:
    """Try the named bugs, or all of them."""
    parser = argparse.ArgumentParser(prog="make mutants", description=__doc__)
    parser.add_argument("names", nargs="*", help="bugs to plant; all if absent")
    parser.add_argument("--out", type=Path, default=ROOT / "out/mutants", help="folder of the table")
    parser.add_argument("--part", default="1/1", help="i/n: every n-th bug from the i-th on, for several processes")
    asked = parser.parse_args()
    part, parts = (int(each) for each in asked.part.split("/"))
    chosen = [each for each in MUTANTS if not asked.names or each.name in asked.names][part - 1 :: parts]
    if unknown := set(asked.names) - {each.name for each in MUTANTS}:
        parser.error(f"no bug is named {', '.join(sorted(unknown))}")
    work = ROOT / "build/mutants" / f"{part}-of-{parts}"
    overlay = Overlay(work / "copy")
    native = NativeBuild(work / "native") if any(each.is_native for each in chosen) else None
    _check_without_bugs(overlay, chosen)
    outcomes = [_tried(overlay, native, each) for each in chosen]
    _write(asked.out, outcomes, "" if parts == 1 else f"-{part}-of-{parts}")
    return 0 if all(each.tests for each in outcomes) else 1


def _check_without_bugs(overlay: Overlay, chosen: Sequence[Mutant]) -> None:
    """Exit if a scene or a test finds something where there is no bug."""
    for scene in dict.fromkeys(each.scene for each in chosen):
        found = _trial(overlay, scene)
        if found["witness"]:
            sys.exit(f"without a bug, the scene {scene} is not proved: {found['said']}")
    for tests in dict.fromkeys(test for each in chosen for test in each.tests):
        found, first = _tested(overlay, [tests])
        if found:
            sys.exit(f"without a bug, a test fails: {first}")
    print("without a bug nothing is found", flush=True)


def _tried(overlay: Overlay, native: NativeBuild | None, mutant: Mutant) -> Outcome:
    begun = time.monotonic()
    if mutant.is_native:
        assert native is not None
        overlay.use_library(native.library(mutant))
    overlay.plant(mutant)
    try:
        found = _trial(overlay, mutant.scene)
        tests, failed = _tested(overlay, mutant.tests)
    finally:
        overlay.mend(mutant)
        if mutant.is_native and native is not None:
            overlay.use_library(native.library(None))
    outcome = Outcome(
        mutant.name,
        mutant.says,
        mutant.file,
        bool(found["validate"]),
        bool(found["witness"]),
        tests,
        str(found["said"]),
        failed,
        round(time.monotonic() - begun, 1),
    )
    print(_row(outcome), flush=True)
    return outcome


def _trial(overlay: Overlay, scene: str) -> dict[str, object]:
    with tempfile.TemporaryDirectory() as folder:
        try:
            done = overlay.run(_TRIAL, scene, folder, seconds=_SECONDS)
        except subprocess.TimeoutExpired:
            return {"validate": True, "witness": True, "said": "no end"}
    try:
        result: dict[str, object] = json.loads(done.stdout.splitlines()[-1])
    except (IndexError, ValueError):
        return {"validate": True, "witness": True, "said": done.stderr.strip()[-300:] or "no answer"}
    return result


def _tested(overlay: Overlay, tests: Iterable[str]) -> tuple[bool, str]:
    """Return whether a test fails, and the first that does."""
    # A folder of its own: pytest removes those of other runs.
    own = ("-p", "no:cacheprovider", f"--basetemp={overlay.folder.parent / 'tests'}")
    arguments = ("-m", "pytest", "-x", "-q", "--no-header", "--tb=no", *own, *tests)
    try:
        done = overlay.run(*arguments, seconds=_SECONDS)
    except subprocess.TimeoutExpired:
        return True, "no end"
    if done.returncode == 0:
        return False, ""
    lines = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return True, (lines[0] if lines else done.stdout[-200:] + done.stderr[-200:])[:200]


def _row(outcome: Outcome) -> str:
    marks = ("found" if each else "–" for each in (outcome.validate, outcome.witness, outcome.tests))
    return f"| {outcome.name} | {outcome.says} | {' | '.join(marks)} |"


def _write(folder: Path, outcomes: Sequence[Outcome], suffix: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    counts = {name: sum(getattr(each, name) for each in outcomes) for name in ("validate", "witness", "tests")}
    record = {"count": len(outcomes), "found": counts, "outcomes": [asdict(each) for each in outcomes]}
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
