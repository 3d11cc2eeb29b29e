"""A paper's page and data: NAME.html, which needs nothing from outside, and NAME.json with the same numbers."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from jinja2 import ChoiceLoader, FileSystemLoader

from tests.benchmarks.waking import is_software
from volprep.report.environment import environment
from volprep.truth.oracle import DEFAULT_TOLERANCE

from .bench import TRUTH_PIXELS
from .lines import line_plot
from .record import Paper, PaperCurves

_CLOCK = {
    True: "Times are those of the processor, which draws here, over the number of its cores.",
    False: "Times end when the driver has finished.",
}


def write_page(paper: Paper, others: Sequence[Paper], folder: Path, driver: str, *, quick: bool) -> Path:
    """Write both files of a paper; `others` are those that the page has links to."""
    curves = [part for part in paper.parts if isinstance(part, PaperCurves)]
    plots = {part.title: line_plot(part.lines, part.x, part.y) for part in curves}
    pages = environment(DEFAULT_TOLERANCE)
    pages.loader = ChoiceLoader([FileSystemLoader(Path(__file__).parent), pages.loader or FileSystemLoader(())])
    text = pages.get_template("page.html.j2").render(
        paper=paper,
        others=others,
        plots=plots,
        driver=driver,
        quick=quick,
        clock=_CLOCK[is_software(driver)],
        truth_pixels=TRUTH_PIXELS,
    )
    page = folder / f"{paper.name}.html"
    page.write_text(text, encoding="utf-8")
    data = {"driver": driver, "quick": quick, **asdict(paper)}
    (folder / f"{paper.name}.json").write_text(json.dumps(data, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    return page
