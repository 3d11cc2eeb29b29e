"""`make papers`: measures the tables and curves of the papers again, and writes a page for each to out/papers."""

import argparse
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path

from volprep_formats.diagnostics import VolprepError

from . import diaz_garcia, moser_weiskopf, noguera, schultz_bailey, thesis
from .bench import Bench
from .contact_sheet import write_contact_sheet
from .page import write_page
from .record import Paper

PAPERS: dict[str, Callable[[Bench], Paper]] = {
    "noguera": noguera.measure,
    "moser-weiskopf": moser_weiskopf.measure,
    "thesis": thesis.measure,
    "schultz-bailey": schultz_bailey.measure,
    "diaz-garcia": diaz_garcia.measure,
}
_SHEET = "contact-sheet"
_SECONDS = {
    "noguera": (206, 8),
    "moser-weiskopf": (21, 5),
    "thesis": (687, 69),
    "schultz-bailey": (909, 109),
    "diaz-garcia": (204, 5),
    _SHEET: (214, 58),
}
"""Of each in full, and quick, on two cores with llvmpipe: how the time that is left is guessed."""


def main() -> None:
    """Measure what is asked for; all papers and the contact sheet if nothing is."""
    parser = argparse.ArgumentParser(prog="make papers", description=__doc__)
    parser.add_argument(
        "papers", nargs="*", metavar="PAPER", help=f"some of {', '.join((*PAPERS, _SHEET))}; all if none"
    )
    parser.add_argument("--quick", action="store_true", help="fewer and smaller pictures: a minute for a paper")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/papers"), help="folder of the pages")
    asked = parser.parse_args()
    unknown = set(asked.papers) - {*PAPERS, _SHEET}
    if unknown:
        parser.error(f"no paper is named {', '.join(sorted(unknown))}")
    wanted = asked.papers or [*PAPERS, _SHEET]
    asked.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="volprep-") as folder:
        missing = _measure(wanted, Bench(Path(folder), quick=asked.quick), asked.output)
    if missing:
        parser.exit(1, f"not measured: {', '.join(missing)}\n")


def _measure(wanted: Sequence[str], bench: Bench, output: Path) -> list[str]:
    """Measure one after the other, write each page at once, and return what could not be measured."""
    found: list[tuple[Paper, str]] = []
    missing = []
    began = time.perf_counter()
    for number, name in enumerate(wanted):
        took = time.perf_counter() - began
        left = _minutes_left(wanted[:number], wanted[number:], took, quick=bench.quick)
        minutes = f"{took / 60:.0f} min so far, about {left:.0f} min left"
        print(f"{name}: {number + 1} of {len(wanted)}, {minutes}", flush=True)
        try:
            if name == _SHEET:
                print(write_contact_sheet(bench, output), flush=True)
                continue
            found.append((PAPERS[name](bench), bench.driver))
        except VolprepError as error:
            missing.append(name)
            print(f"{name}: this driver does not do it: {error}", flush=True)
        except Exception:  # noqa: BLE001 - the others go on
            missing.append(name)
            print(f"{name}: {traceback.format_exc()}", flush=True)
        else:
            # Those before have links to this one now.
            for paper, driver in found:
                others = [each for each, _ in found if each is not paper]
                page = write_page(paper, others, output, driver, quick=bench.quick)
            print(page, flush=True)
    return missing


def _minutes_left(done: Sequence[str], rest: Sequence[str], took_s: float, *, quick: bool) -> float:
    """Guess how long the rest takes: as on another machine, by how much slower or faster this one has been so far."""
    expected, ahead = (sum(_SECONDS[name][quick] for name in names) for names in (done, rest))
    return ahead / 60 * (took_s / expected if expected else 1.0)


if __name__ == "__main__":
    main()
