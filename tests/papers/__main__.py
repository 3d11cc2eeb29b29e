"""`make papers`: measures the tables and curves of the papers again, and writes a page for each to out/papers."""

import argparse
import tempfile
import time
from collections.abc import Callable
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
        bench = Bench(Path(folder), quick=asked.quick)
        found, missing = [], []
        for name in wanted:
            began = time.perf_counter()
            try:
                if name == _SHEET:
                    made = str(write_contact_sheet(bench, asked.output))
                else:
                    found.append((PAPERS[name](bench), bench.driver))
                    made = "measured"
            except VolprepError as error:
                missing.append(name)
                made = f"this driver does not do it: {error}"
            print(f"{name}: {made}, {time.perf_counter() - began:.0f} s", flush=True)
        for paper, driver in found:
            others = [each for each, _ in found if each is not paper]
            print(write_page(paper, others, asked.output, driver, quick=asked.quick))
    if missing:
        parser.exit(1, f"not measured: {', '.join(missing)}\n")


if __name__ == "__main__":
    main()
