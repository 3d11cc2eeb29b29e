"""`make combinations`: builds, validates and witnesses rows of a covering array; the table is in out/combinations.

Without arguments it takes every pair, and VTK draws the scan, too. `--triples` takes every triple: hours. `--rows` only
writes rows.txt anew, after a change of the factors. Each outcome is written at once, and `--resume` leaves out what the
table has. Exit status 1 if a row is neither within, nor refused by the plan, nor beyond the tolerance with a warning of
the build.
"""

import argparse
import json
import os
import sys
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path

from .factors import Row, name_of, row_of
from .outcome import Outcome, outcome_of_name
from .pairs import ROWS, all_combinations, alone, combinations_of, covering_array, rows_of_pairs

_ROOT = Path(__file__).parents[2]


def main() -> int:
    """Try all rows."""
    parser = argparse.ArgumentParser(prog="make combinations", description=__doc__)
    parser.add_argument("--out", type=Path, default=_ROOT / "out/combinations", help="folder of the table")
    parser.add_argument("--triples", action="store_true", help="take every triple, not only every pair")
    parser.add_argument("--rows", action="store_true", help="write rows.txt anew, and do nothing else")
    parser.add_argument("--resume", action="store_true", help="leave out rows that the table has")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="rows to try at a time")
    asked = parser.parse_args()
    if asked.rows:
        ROWS.write_text("".join(f"{name_of(row)}\n" for row in covering_array()), encoding="utf-8")
        return 0
    strength = 3 if asked.triples else 2
    rows = covering_array(strength) if asked.triples else rows_of_pairs()
    asked.out.mkdir(parents=True, exist_ok=True)
    outcomes = _tried([*rows, *alone(rows, strength)], asked.out / f"rows-of-{strength}.jsonl", asked)
    table = _table(outcomes, strength)
    (asked.out / f"table-of-{strength}.md").write_text(table, encoding="utf-8")
    print(table)
    return int(any(each.result in {"beyond", "failed"} for each in outcomes))


def _tried(rows: Iterable[Row], file: Path, asked: argparse.Namespace) -> list[Outcome]:
    known: dict[str, Outcome] = {}
    if asked.resume and file.exists():
        lines = file.read_text(encoding="utf-8").splitlines()
        known = {found.name: found for found in (Outcome(**json.loads(line)) for line in lines)}
    names = [*dict.fromkeys(name_of(row) for row in rows)]
    left = [name for name in names if name not in known]
    # EGL does not survive a fork.
    pool = ProcessPoolExecutor(asked.jobs, mp_context=get_context("spawn"))
    with file.open("a" if known else "w", encoding="utf-8") as log, pool:
        for outcome in pool.map(outcome_of_name, left):
            log.write(json.dumps(asdict(outcome)) + "\n")
            log.flush()
            print(f"{outcome.result:8}{outcome.name} {outcome.said[:160]}", flush=True)
            known[outcome.name] = outcome
    return [known[name] for name in names]


def _table(outcomes: list[Outcome], strength: int) -> str:
    """Return the counts of rows and of combinations, and the rows that are neither within nor refused."""
    counts = Counter(each.result for each in outcomes)
    rows = [row_of(each.name) for each in outcomes if each.result in {"within", "warned"}]
    within = set().union(*(combinations_of(row, strength) for row in rows))
    total = sum(1 for _ in all_combinations(strength))
    refused = Counter(each.said.split()[0] for each in outcomes if each.result == "refused")
    lines = [f"| rows | {' | '.join(_RESULTS)} |", f"|---|{'---|' * len(_RESULTS)}"]
    lines.append(f"| {len(outcomes)} | {' | '.join(str(counts[each]) for each in _RESULTS)} |")
    shown = "are within a tolerance, or beyond it and the build warns of it"
    lines.append(f"\nOf {total} combinations of {strength} values {len(within)} {shown}.\n")
    lines.append(f"Codes of refusals: {', '.join(f'{code} {count}' for code, count in refused.most_common())}.\n")
    faults = [each for each in outcomes if each.result in {"warned", "beyond", "failed"}]
    lines += [f"- {each.result}: {each.name}: {each.said}" for each in faults]
    return "\n".join(lines) + "\n"


_RESULTS = ("within", "refused", "warned", "beyond", "failed")


if __name__ == "__main__":
    sys.exit(main())
