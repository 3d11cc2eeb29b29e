"""docs/ORDERS.md: its tables are made from what the tests measure, between lines that name them."""

import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import get_args

from order_bench import Bench, expected_by_step, expected_elsewhere, is_exact
from order_faults import FAULTS, WORDS
from order_others import OTHERS

from volprep.compositing import COMPOSITINGS
from volprep.lab.stress.combinations import Way
from volprep.techniques import TECHNIQUES
from volprep_formats.package.program import ClassificationName, Sampling

DOCUMENT = Path(__file__).parents[2] / "docs" / "ORDERS.md"
_TABLE = re.compile(r"(<!-- (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
_SAMPLINGS = ("texture3d", "mosaic", "bricks", "subvolumes")
Rows = Iterable[Sequence[str]]


def every_way() -> Iterator[Way]:
    """Every possible way, in the order of the registries of techniques and compositings."""
    # A volume in colour has a classification of four channels.
    classifications = [name for name in get_args(ClassificationName) if name != "colour"]
    for sampling, technique, compositing, classification in itertools.product(
        get_args(Sampling), TECHNIQUES, COMPOSITINGS, classifications
    ):
        way = Way(technique, compositing, classification, sampling)
        if way.is_possible:
            yield way


def unusual(way: Way) -> int:
    """Number of choices among technique, compositing and classification that differ from the defaults."""
    return sum(one != usual for one, usual in zip(way.choices[:3], Way().choices, strict=False))


def by_step() -> list[Way]:
    """Ways of which steps are refined: all."""
    return [*every_way()]


def by_grid() -> list[Way]:
    """Ways of which grids are refined: those that differ from what is usual in one thing at most."""
    return [way for way in every_way() if unusual(way) <= 1 and expected_elsewhere(way) is not None]


def by_pixel() -> list[Way]:
    """Ways of which pixels are refined: as by_grid, where no outline is in the way and each has its own rays."""
    return [way for way in by_grid() if way.classification == "lookup" and _has_own_rays(way)]


def _has_own_rays(way: Way) -> bool:
    outlines = ("first-hit", "isosurface")
    return way.sampling in {"texture3d", "mosaic"} and way.compositing not in outlines


def tables(folder: Path) -> Mapping[str, str]:
    """Measure everything and return the tables by their names."""
    bench = Bench(folder / "ways")
    steps = {way: bench.by_step(way) for way in by_step()}
    grids = {way: bench.by_grid(way).order for way in by_grid()}
    pixels = {way: bench.by_pixel(way).order for way in by_pixel()}
    kinds = dict.fromkeys(way.choices[:3] for way in steps)
    expected = {way.choices[:3]: expected_by_step(way) for way in steps}
    head = ["technique", "compositing", "classification", "expected", *_SAMPLINGS]
    found = {
        (way.choices[:3], way.sampling): "exact" if is_exact(way, falling) else _cell(falling.order)
        for way, falling in steps.items()
    }
    refined = ((*kind, f"{expected[kind]:g}", *(found.get((kind, each), "") for each in _SAMPLINGS)) for kind in kinds)
    places = (
        (way.name.replace("+", ", "), f"{expected_elsewhere(way):g}", _cell(grids[way]), _cell(pixels.get(way)))
        for way in grids
    )
    others = (
        (other.name, other.finer, f"{other.expected:g}", _cell(other.falling(folder / f"other-{number}").order))
        for number, other in enumerate(OTHERS)
    )
    faults = (
        (each.name, each.way.name.replace("+", ", "), ", ".join(WORDS[one] for one in each.found_by)) for each in FAULTS
    )
    return {
        "steps": _table(head, refined),
        "places": _table(["way", "at least", "grids", "pixels"], places),
        "others": _table(["what", "finer", "expected", "found"], others),
        "faults": _table(["fault", "planted in", "found by"], faults),
    }


def filled(text: str, made: Mapping[str, str]) -> str:
    """Return the document with these tables."""
    return _TABLE.sub(lambda match: f"{match[1]}\n{made[match[2]]}\n{match[3]}", text)


def rows(text: str, name: str) -> list[list[str]]:
    """Return the rows of a table of the document, without its head."""
    body = next(match[0] for match in _TABLE.finditer(text) if match[2] == name)
    lines = [line for line in body.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def _cell(order: float | None) -> str:
    return "" if order is None else f"{abs(order) if abs(order) < 0.05 else order:.1f}"


def _table(head: Sequence[str], body: Rows) -> str:
    lines = [head, ["---"] * len(head), *body]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
