"""Orders of everything that can be drawn, by step, grid and pixel; and faults that are planted, and must be found.

Ways to draw come from the registries: a technique, a compositing, a classification or a layout that is registered is
here. What is measured stands in docs/ORDERS.md, which `python tools/make_orders.py` writes.
"""

import math

import pytest
from long_runs import LONG
from order_bench import Bench, as_expected, expected_by_step, expected_elsewhere, is_exact, scatter
from order_document import DOCUMENT, by_grid, by_pixel, by_step, rows, unusual
from order_faults import FAULTS, WORDS, finders
from order_others import OTHERS

from volprep.compositing import COMPOSITINGS
from volprep.lab.stress.combinations import Way
from volprep.techniques import TECHNIQUES

pytestmark = pytest.mark.longer


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Bench:
    return Bench(tmp_path_factory.mktemp("orders"))


def share(ways: list[Way]) -> list[Way]:
    """Return all in long tests; else all with 3D textures, and of other layouts only the usual choices.

    A layout changes where voxels lie, and nothing else.
    """
    return [way for way in ways if LONG or way.sampling == "texture3d" or unusual(way) == 0]


@pytest.fixture(scope="module")
def document() -> str:
    return DOCUMENT.read_text(encoding="utf-8")


def test_all_that_is_registered_is_drawn():
    ways = by_step()
    assert {way.technique for way in ways} == set(TECHNIQUES)
    assert {way.compositing for way in ways} == set(COMPOSITINGS)
    for place in range(4):
        assert len({way.choices[place] for way in ways}) > 3


@pytest.mark.long(keep=6)
@pytest.mark.parametrize("way", share(by_step()), ids=lambda way: way.name)
def test_the_error_falls_with_its_order_as_steps_get_finer(bench, way):
    falling = bench.by_step(way)
    expected = expected_by_step(way)
    assert as_expected(way, falling), falling
    if expected:
        assert falling.errors[-1] < 0.02
    else:
        assert falling.errors[-1] > 1e-4


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("way", share(by_grid()), ids=lambda way: way.name)
def test_the_error_falls_with_its_order_as_grids_get_finer(bench, way):
    falling = bench.by_grid(way)
    assert falling.order > (expected_elsewhere(way) or 0.0) - scatter(way), falling


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("way", share(by_pixel()), ids=lambda way: way.name)
def test_the_error_falls_with_its_order_as_pixels_get_smaller(bench, way):
    falling = bench.by_pixel(way)
    assert falling.order > (expected_elsewhere(way) or 0.0) - 0.3, falling


@pytest.mark.long(keep=4)
@pytest.mark.parametrize("other", OTHERS, ids=lambda other: other.name)
def test_what_is_lit_labels_channels_and_stacks_have_their_orders_and_the_document_says_so(tmp_path, document, other):
    falling = other.falling(tmp_path)
    assert falling.order == pytest.approx(other.expected, abs=other.scatter), falling
    (row,) = (row for row in rows(document, "others") if row[0] == other.name)
    assert float(row[3]) == pytest.approx(falling.order, abs=0.15)


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_is_found(bench, fault):
    assert fault.found_by
    assert not list(finders(bench, fault, planted=False))
    assert set(fault.found_by) <= set(finders(bench, fault))


def test_the_document_lists_everything(document):
    kinds = dict.fromkeys(way.choices[:3] for way in by_step())
    expected = {way.choices[:3]: f"{expected_by_step(way):g}" for way in by_step()}
    assert [tuple(row[:4]) for row in rows(document, "steps")] == [(*kind, expected[kind]) for kind in kinds]
    assert [row[0] for row in rows(document, "places")] == [way.name.replace("+", ", ") for way in by_grid()]
    assert [tuple(row[:3]) for row in rows(document, "others")] == [
        (o.name, o.finer, f"{o.expected:g}") for o in OTHERS
    ]
    found_by = [", ".join(WORDS[each] for each in fault.found_by) for fault in FAULTS]
    assert [(row[0], row[2]) for row in rows(document, "faults")] == [
        (fault.name, words) for fault, words in zip(FAULTS, found_by, strict=True)
    ]


@pytest.mark.long(keep=6)
@pytest.mark.parametrize("way", share(by_step()), ids=lambda way: way.name)
def test_the_document_says_what_is_measured_by_step(bench, document, way):
    (row,) = (row for row in rows(document, "steps") if tuple(row[:3]) == way.choices[:3])
    said = row[4 + ("texture3d", "mosaic", "bricks", "subvolumes").index(way.sampling)]
    falling = bench.by_step(way)
    assert said == "exact" if is_exact(way, falling) else float(said) == pytest.approx(falling.order, abs=0.15)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("way", share(by_grid()), ids=lambda way: way.name)
def test_the_document_says_what_is_measured_by_grid(bench, document, way):
    assert placed(document, way)[2] == pytest.approx(bench.by_grid(way).order, abs=0.15)


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("way", share(by_pixel()), ids=lambda way: way.name)
def test_the_document_says_what_is_measured_by_pixel(bench, document, way):
    assert placed(document, way)[3] == pytest.approx(bench.by_pixel(way).order, abs=0.15)


def placed(document: str, way: Way) -> list[float]:
    """Return the numbers of a way in the table of grids and pixels; NaN for text and what is not measured."""
    (row,) = (row for row in rows(document, "places") if row[0] == way.name.replace("+", ", "))
    return [float(cell) if cell.replace(".", "").isdecimal() else math.nan for cell in row]
