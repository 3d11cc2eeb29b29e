"""`make fuzz`: the damaged files of the tests for as long as there is time, from a new seed.

Usage: python -m tests.robustness.fuzz [--seconds 300] [--seed N] [--only NAME ...]. The seed is printed first, and
all is repeated with it. A file that ends in anything but a volume or a coded error is kept in out/fuzz; the exit
status is 1. So is a file that contradicts itself and is read as another picture than it was made from (`lies.py`).
"""

import argparse
import secrets
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "out" / "fuzz"
BATCH = 200
LIES_BATCH = 20


def main() -> int:
    """Damage every kind of file in turn, a batch each, until time is up."""
    parser = argparse.ArgumentParser(prog="make fuzz", description="Read damaged files for a while.")
    parser.add_argument("--seconds", type=float, default=300.0, help="how long (300)")
    parser.add_argument("--seed", type=int, default=secrets.randbelow(2**31), help="of an earlier run")
    parser.add_argument("--only", nargs="*", default=[""], help="kinds whose name contains one of these")
    options = parser.parse_args()
    warnings.simplefilter("error")  # as in the tests
    sys.path.append(str(ROOT / "tests" / "support"))
    from write_anew import write_anew

    from volprep_formats.isolation import workers

    from .dicom_lies import LIES, lie_outcome
    from .mutations import mutation, outcome
    from .subjects import SUBJECTS, VDB, sound_file

    kinds = (*SUBJECTS, VDB) if find_spec("volprep_formats._vdb") else SUBJECTS
    subjects = [(subject, sound_file(subject)) for subject in kinds if _is_asked(subject.name, options.only)]
    lies = [lie for lie in LIES if _is_asked(lie.name, options.only)]
    kinds_of_lies = f"{len(lies)} kinds of lies"
    print(f"seed {options.seed}, {len(subjects)} kinds of files, {kinds_of_lies}, {options.seconds:g} s", flush=True)
    KEPT.mkdir(parents=True, exist_ok=True)
    outcomes = {
        name: Counter[str]() for name in (*(subject.name for subject, _ in subjects), *(lie.name for lie in lies))
    }
    failures = 0

    def count(name: str, end_of: Callable[[], str]) -> None:
        nonlocal failures
        try:
            outcomes[name][end_of()] += 1
        except AssertionError as error:
            failures += 1
            print(error, flush=True)

    end = time.monotonic() + options.seconds
    with workers():
        for turn in range(sys.maxsize):
            for subject, whole in subjects:
                file = KEPT / f"damaged{subject.suffix}"
                for case in range(turn * BATCH, (turn + 1) * BATCH):
                    write_anew(file, subject.pack(mutation(whole, options.seed, case)))
                    name = f"{subject.name} case {case} of seed {options.seed}"
                    count(subject.name, partial(outcome, file, subject.read, name))
                file.unlink()
            for lie in lies:
                file = KEPT / "lie"
                for case in range(turn * LIES_BATCH, (turn + 1) * LIES_BATCH):
                    count(lie.name, partial(lie_outcome, lie, file, options.seed, case))
                file.unlink()
            if time.monotonic() > end:
                break
    for name, counts in outcomes.items():
        print(f"{name}: {counts.total()} files, {dict(counts.most_common())}")
    print(f"{sum(counts.total() for counts in outcomes.values())} files, {failures} failures, seed {options.seed}")
    return 1 if failures else 0


def _is_asked(name: str, words: Sequence[str]) -> bool:
    return any(word in name for word in words)


sys.exit(main())
