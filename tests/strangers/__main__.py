"""`make strangers`: builds scans of other projects as a new user would; table and first pictures in out/strangers.

Each input is one command, `volprep build INPUT -o PACKAGE`, in a process of its own. One that is refused because it
holds several volumes, or is tilted, is tried again with the option that the message names. Exit status 1 if a command
crashed: a defect of volprep, a traceback, a signal, no code, or no end. Inputs that are in the table are not built
again; --anew starts from nothing.
"""

import argparse
import json
import re
import resource
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from .corpus import Input, inputs
from .sheet import write_sheet

_ROOT = Path(__file__).parents[2]
_COMMAND = (sys.executable, "-c", "from volprep_cli.main import main; main()")
_SECONDS = 1800.0
"""Longest wait for a command, long enough for a busy machine."""
_DEFECT = 70
_PICTURES = 64
"""First pictures on one sheet."""
_SECOND_TRIES = (("--volume N", ("--volume", "1")), ("--repair tilt", ("--repair", "tilt")))
"""What a message offers, and what is then tried."""


@dataclass(frozen=True)
class Outcome:
    """What came of an input."""

    origin: str
    name: str
    option: str
    """Option of the second try, which the first one's message named."""
    result: str
    """built, refused or crashed."""
    said: str
    """The message, or what was recognised."""
    seconds: float
    """Processor time, which depends less than wall time on what else the machine does."""
    picture: str | None

    @property
    def code(self) -> str:
        """The code of a refusal."""
        found = re.search(r"VP\d{4}", self.said)
        return found.group() if found and self.result != "built" else ""


def main() -> int:
    """Build all inputs, or those whose name contains a word."""
    parser = argparse.ArgumentParser(prog="make strangers", description=__doc__)
    parser.add_argument("words", nargs="*", help="parts of names; all inputs if absent")
    parser.add_argument("--out", type=Path, default=_ROOT / "out/strangers", help="folder of table and pictures")
    parser.add_argument("--anew", action="store_true", help="forget the outcomes of an earlier run")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    kept = asked.out / "outcomes.jsonl"
    if asked.anew:
        kept.unlink(missing_ok=True)
    done = {(each.origin, each.name, each.option): each for each in read_outcomes(kept)}
    chosen = [each for each in inputs() if not asked.words or any(word in each.name for word in asked.words)]
    outcomes = []
    for number, each in enumerate(chosen):
        for outcome in _tried(each, number, asked.out, done):
            outcomes.append(outcome)
            if (outcome.origin, outcome.name, outcome.option) not in done:
                with kept.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(outcome)) + "\n")
                print(f"{outcome.result:8}{outcome.seconds:6.1f} s  {outcome.name}: {outcome.said[:110]}", flush=True)
    _write(asked.out, outcomes)
    return 1 if any(each.result == "crashed" for each in outcomes) else 0


def read_outcomes(kept: Path) -> list[Outcome]:
    """Return the outcomes of earlier runs."""
    lines = kept.read_text(encoding="utf-8").splitlines() if kept.exists() else []
    return [Outcome(**json.loads(line)) for line in lines]


def _tried(given: Input, number: int, out: Path, done: dict[tuple[str, str, str], Outcome]) -> list[Outcome]:
    first = done.get((given.origin, given.name, "")) or _build(given, number, out, ())
    for offered, option in _SECOND_TRIES:
        if offered in first.said:
            known = done.get((given.origin, given.name, " ".join(option)))
            return [first, known or _build(given, number, out, option)]
    return [first]


def _build(given: Input, number: int, out: Path, option: Sequence[str]) -> Outcome:
    package = out / "a.volpkg"
    shutil.rmtree(package, ignore_errors=True)
    begun = _processor_seconds()
    command = [*_COMMAND, "build", str(given.path), "-o", str(package), *option]
    try:
        run = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False, timeout=_SECONDS)
        status, told = run.returncode, run.stderr
    except subprocess.TimeoutExpired:
        status, told = -1, f"no end after {_SECONDS:.0f} s"
    seconds = round(_processor_seconds() - begun, 1)
    picture = None
    errors = [line for line in told.splitlines() if line.startswith("volprep: VP")]
    if status == 0:
        picture = f"{number:03}{'-'.join(option)}.png"
        shutil.copy(package / "preview.png", out / picture)
        notes = [line.removeprefix("note: ") for line in told.splitlines() if "recognised" in line]
        result, said = "built", "; ".join(notes)
    elif 0 < status != _DEFECT and len(errors) == 1 and "Traceback" not in told:
        result, said = "refused", errors[0].removeprefix("volprep: ").replace(str(given.path), given.path.name)
    else:
        result, said = "crashed", f"status {status}: {told[-500:]}"
    shutil.rmtree(package, ignore_errors=True)
    return Outcome(given.origin, given.name, " ".join(option), result, said, seconds, picture)


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _write(out: Path, outcomes: Sequence[Outcome]) -> None:
    counts = Counter(each.result for each in outcomes if not each.option)
    total = f"{sum(counts.values())} inputs: " + ", ".join(f"{counts[each]} {each}" for each in sorted(counts))
    codes = Counter(each.code for each in outcomes if each.code)
    lines = [f"# Scans of other projects\n\n{total}. Refusals: "]
    lines[0] += ", ".join(f"{code} {count}" for code, count in codes.most_common()) + ".\n\n"
    lines.append("| from | input | result | processor s | said |\n|---|---|---|---|---|\n")
    for each in outcomes:
        said = each.said.replace("|", "\\|").replace("\n", " ")
        name = f"{each.name} {each.option}".strip()
        lines.append(f"| {each.origin} | {name} | {each.result} | {each.seconds:.1f} | {said} |\n")
    (out / "table.md").write_text("".join(lines), encoding="utf-8")
    pictures = [(each.name, out / each.picture) for each in outcomes if each.picture]
    for number, start in enumerate(range(0, len(pictures), _PICTURES), 1):
        write_sheet(out / f"sheet-{number}.png", pictures[start : start + _PICTURES])
    print(f"{total}; {out / 'table.md'}")


if __name__ == "__main__":
    sys.exit(main())
