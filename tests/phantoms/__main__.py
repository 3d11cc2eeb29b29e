"""`make phantoms`: builds phantoms of combined features by defaults, and validates them with the witness.

out/phantoms gets a table with the last lines of each verdict, the report of each, and a sheet of first pictures. Exit
status 1 if a build fails, or validation ends with anything but a verdict.
"""

import argparse
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from tests.strangers.sheet import write_sheet

from .scenes import PHANTOMS

_ROOT = Path(__file__).parents[2]
_COMMAND = (sys.executable, "-c", "from volprep_cli.main import main; main()")
_SAID = 4
"""Last lines of a verdict that the table has."""


class Outcome(NamedTuple):
    """What came of a phantom."""

    name: str
    result: str
    """within, beyond, or failed."""
    said: str


def main() -> int:
    """Build and validate all phantoms, or those that are named."""
    parser = argparse.ArgumentParser(prog="make phantoms", description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*PHANTOMS, []], help="phantoms; all of them if absent")
    parser.add_argument("--out", type=Path, default=_ROOT / "out/phantoms", help="folder of table and pictures")
    asked = parser.parse_args()
    outcomes, pictures = [], []
    for name in asked.names or PHANTOMS:
        folder = asked.out / name
        folder.mkdir(parents=True, exist_ok=True)
        outcomes.append(_proved(name, folder))
        print(f"{outcomes[-1].result:8}{name}: {outcomes[-1].said}", flush=True)
        preview = folder / "phantom.volpkg/preview.png"
        pictures += [(name, preview)] if preview.exists() else []
    lines = [f"| {each.name} | {each.result} | {each.said.replace('|', '/')} |\n" for each in outcomes]
    table = "| phantom | result | last lines of the verdict |\n|---|---|---|\n" + "".join(lines)
    (asked.out / "table.md").write_text(table, encoding="utf-8")
    write_sheet(asked.out / "sheet.png", pictures, columns=5)
    return int(any(each.result == "failed" for each in outcomes))


def _proved(name: str, folder: Path) -> Outcome:
    source, package = PHANTOMS[name](folder), folder / "phantom.volpkg"
    status, said = _run("build", str(source), "-o", str(package), "--force")
    if status:
        return Outcome(name, "failed", f"build: {said}")
    status, said = _run("validate", str(package), "--witness", "--report", str(folder / "report"), "--quiet")
    return Outcome(name, {0: "within", 1: "beyond"}.get(status, "failed"), said)


def _run(*arguments: str) -> tuple[int, str]:
    """Return the exit status of a command, and its last lines in one."""
    run = subprocess.run([*_COMMAND, *arguments], capture_output=True, text=True, check=False)
    lines: Sequence[str] = (run.stdout + run.stderr).strip().splitlines()
    return run.returncode, "; ".join(line.strip() for line in lines[-_SAID:])


if __name__ == "__main__":
    sys.exit(main())
