"""`make mutants`: plants bugs one by one, and writes to out/mutants who finds each.

For each bug a package is built and validated, the witness is asked, and the tests that are named for it run; all in a
copy of the product. Scenes and tests run once before without a bug: one that finds something there counts for no bug,
and is named. Exit status 1 if the tests miss a bug, or if something was found without one.

`--jobs 16` tries so many bugs at a time, each in a copy of its own. `--part 1/3` takes every third bug, for three
machines; `--merge` puts the JSON files of several runs of one commit together, later ones replacing earlier ones. Each
result is written at once; `--resume` leaves out what the table in the folder has for this commit.
"""

import argparse
import resource
import sys
from functools import partial
from pathlib import Path

from .catalogue import MUTANTS
from .copies import Copies
from .mutant import ROOT, Mutant
from .outcomes import Run, commit_of_checkout, table_of


def main() -> int:
    """Try the named bugs, or all of them; or put the results of several runs together."""
    parser = argparse.ArgumentParser(prog="make mutants", description=__doc__)
    parser.add_argument("names", nargs="*", help="bugs to plant; all if absent")
    parser.add_argument("--out", type=Path, default=ROOT / "out/mutants", help="folder of the table")
    parser.add_argument("--jobs", type=int, default=1, help="bugs to try at a time")
    parser.add_argument("--part", default="1/1", help="i/n: every n-th bug from the i-th on, for several machines")
    parser.add_argument("--python-only", action="store_true", help="leave out bugs of the native core: no compiler")
    parser.add_argument("--merge", type=Path, nargs="+", help="JSON files of several runs, to put together")
    parser.add_argument("--resume", action="store_true", help="leave out what the folder has for this commit")
    asked = parser.parse_args()
    if asked.merge:
        return _merged(asked.out, asked.merge)
    part, parts = (int(each) for each in asked.part.split("/"))
    if unknown := set(asked.names) - {each.name for each in MUTANTS}:
        parser.error(f"no bug is named {', '.join(sorted(unknown))}")
    named = [each for each in MUTANTS if not asked.names or each.name in asked.names]
    chosen = [each for each in named if not (asked.python_only and each.is_native)][part - 1 :: parts]
    suffix = "" if parts == 1 else f"-{part}-of-{parts}"
    run = _begun(asked.out / f"mutants{suffix}.json", resume=asked.resume)
    _try(run, chosen, Copies(ROOT / "build/mutants" / f"{part}-of-{parts}", asked.jobs, chosen), asked.out, suffix)
    return 0 if run.is_good else 1


def _begun(file: Path, *, resume: bool) -> Run:
    """Return what `file` has for this commit; an empty run if it has nothing, or if all is tried again."""
    commit = commit_of_checkout()
    if resume and file.exists() and (run := Run.read(file)).commit == commit:
        return run
    return Run(commit)


def _try(run: Run, chosen: list[Mutant], copies: Copies, folder: Path, suffix: str) -> None:
    save = partial(run.write, folder, suffix)
    scenes = [*dict.fromkeys(each.scene for each in chosen)]
    copies.without_bugs(run, scenes, [*dict.fromkeys(test for each in chosen for test in each.tests)], save)
    print(
        "\n".join(f"without a bug, {each}" for each in run.without_bugs) or "without a bug nothing is found", flush=True
    )
    copies.outcomes(run, chosen, save)
    print(table_of(run.in_order()))
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"processor time: {used.ru_utime + used.ru_stime:.0f} s")


def _merged(folder: Path, files: list[Path]) -> int:
    """Write one table of several runs, in the order of the catalogue."""
    run = Run.merged([Run.read(file) for file in files])
    run.write(folder)
    print(table_of(run.in_order()))
    if missing := [mutant.name for mutant in MUTANTS if mutant.name not in run.outcomes]:
        print(f"not tried: {', '.join(missing)}")
    return 0 if run.is_good and not missing else 1


if __name__ == "__main__":
    sys.exit(main())
