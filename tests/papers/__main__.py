"""`make papers`: measures the tables and curves of the papers again, and writes a page for each to out/papers.

A run that was ended goes on when it is called again; with --again it begins anew.
"""

import argparse
import os
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path

from volprep.render.egl import context
from volprep_formats.diagnostics import VolprepError

from . import diaz_garcia, moser_weiskopf, noguera, schultz_bailey, thesis
from .bench import Bench
from .contact_sheet import write_contact_sheet
from .kept import Kept
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
_VIEWS = 60
"""Views around each volume in a full run."""
_SECONDS = {
    "noguera": (41, 8),
    "moser-weiskopf": (15, 4),
    "thesis": (455, 72),
    "schultz-bailey": (257, 30),
    "diaz-garcia": (425, 7),
    _SHEET: (111, 58),
}
"""Of each in full, and quick, on two quiet cores with llvmpipe: what is said of the time that is left."""


def command_line() -> argparse.ArgumentParser:
    """Return the parser of the arguments."""
    parser = argparse.ArgumentParser(prog="make papers", description=__doc__)
    parser.add_argument(
        "papers", nargs="*", metavar="PAPER", help=f"some of {', '.join((*PAPERS, _SHEET))}; all if none"
    )
    parser.add_argument("--quick", action="store_true", help="fewer and smaller pictures: a minute for a paper")
    parser.add_argument(
        "--views",
        type=int,
        metavar="N",
        help=f"means of diaz-garcia over N views around each volume, in two zooms: {_VIEWS}, or with --quick few",
    )
    parser.add_argument("--again", action="store_true", help="begin anew, though an earlier run was ended")
    parser.add_argument("-o", "--output", type=Path, default=Path("out/papers"), help="folder of the pages")
    return parser


def main() -> None:
    """Measure what is asked for; all papers and the contact sheet if nothing is."""
    parser = command_line()
    asked = parser.parse_args()
    unknown = set(asked.papers) - {*PAPERS, _SHEET}
    if unknown:
        parser.error(f"no paper is named {', '.join(sorted(unknown))}")
    views = asked.views if asked.views is not None else 0 if asked.quick else _VIEWS
    if views < 0:
        parser.error("--views is a number of views, from 1")
    wanted = asked.papers or [*PAPERS, _SHEET]
    asked.output.mkdir(parents=True, exist_ok=True)
    driver = _driver()
    form = "quick" if asked.quick else "full"
    kept = Kept(asked.output, f"views{views}-{form}" if asked.views else form, driver)
    if asked.again:
        kept.forget()
    bench = Bench(kept.folder, quick=asked.quick, driver=driver, views=views)
    missing = _measure(wanted, bench, kept, asked.output)
    if missing:
        parser.exit(1, f"not measured: {', '.join(missing)}\n")
    kept.close(wanted)


def _driver() -> str:
    try:
        with context("es3.0") as opened:
            return str(opened.driver)
    except VolprepError:
        return ""


def _measure(wanted: Sequence[str], bench: Bench, kept: Kept, output: Path) -> list[str]:
    """Measure one after the other, write each page at once, and return what could not be measured."""
    found: list[tuple[Paper, str]] = []
    missing = []
    for number, name in enumerate(wanted):
        left = sum(_SECONDS[each][bench.quick] for each in wanted[number:] if kept.result(each) is None) / 60
        print(f"{name}: {number + 1} of {len(wanted)}, about {left:.0f} min left on two quiet cores", flush=True)
        try:
            paper, driver = _result(name, bench, kept, output)
        except VolprepError as error:
            missing.append(name)
            print(f"{name}: this driver does not do it: {error}", flush=True)
            continue
        except Exception:  # noqa: BLE001 - the others go on
            missing.append(name)
            print(f"{name}: {traceback.format_exc()}", flush=True)
            continue
        if paper is None:
            continue
        found.append((paper, driver))
        # Those before have links to this one now.
        for each, drew in found:
            page = write_page(each, [other for other, _ in found if other is not each], output, drew, quick=bench.quick)
        print(page, flush=True)
    return missing


def _result(name: str, bench: Bench, kept: Kept, output: Path) -> tuple[Paper | None, str]:
    """Return the paper and its driver, as an earlier run has measured it or anew; of the contact sheet, no paper."""
    before = kept.result(name)
    if before is not None and (before[0] is not None or (output / f"{_SHEET}.png").exists()):
        print(f"{name}: measured before that run was ended; --again measures it again", flush=True)
        return before[0], before[1]
    began, busy = time.perf_counter(), _busy_s()
    if name == _SHEET:
        print(write_contact_sheet(bench, output), flush=True)
        result = None, bench.driver
    else:
        result = PAPERS[name](bench), bench.driver
    kept.keep(name, result)
    print(f"{name}: {time.perf_counter() - began:.0f} s, {_busy_s() - busy:.0f} s of processors", flush=True)
    return result


def _busy_s() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


if __name__ == "__main__":
    main()
