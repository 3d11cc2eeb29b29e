"""The page of a report: what it shows, that it needs nothing from outside, and that it can be read by a machine."""

import re
from html.parser import HTMLParser
from itertools import pairwise
from typing import get_args
from unittest.mock import patch

import pytest
from jinja2 import Environment
from sample_report import seen

from volprep.report import environment as environment_module
from volprep.report.environment import environment
from volprep.report.page import page
from volprep.report.text import kept_light, number
from volprep.validation.results.report import Report
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.program import Program
from volprep_formats.readers import READERS, title_of
from volprep_formats.source import SourceFormat

VOID = {"meta", "link", "img", "br", "input", "hr"}


def test_a_template_is_compiled_once_for_all_processes(monkeypatch, tmp_path):
    monkeypatch.setattr(environment_module, "_TEMPLATES", tmp_path)
    (tmp_path / "a.j2").write_text("one")
    make = environment.__wrapped__
    assert make(1e-6).get_template("a.j2").render() == "one"
    with patch.object(Environment, "compile", side_effect=AssertionError):
        assert make(1e-6).get_template("a.j2").render() == "one"
    (tmp_path / "a.j2").write_text("two")
    assert make(1e-6).get_template("a.j2").render() == "two"


def test_templates_in_a_folder_that_takes_no_file_are_compiled_each_time(monkeypatch, tmp_path):
    monkeypatch.setattr(environment_module, "_TEMPLATES", tmp_path)
    (tmp_path / "a.j2").write_text("one")
    (tmp_path / "__pycache__").write_text("no folder")
    monkeypatch.setattr("os.access", lambda *_: False)
    assert environment.__wrapped__(1e-6).get_template("a.j2").render() == "one"


class Elements(HTMLParser):
    """Start tags with their attributes, and the text; fails where tags do not nest."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.starts: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self._open: list[str] = []
        self.feed(html)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag, attributes) -> None:
        self.starts.append((tag, dict(attributes)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag, attributes) -> None:
        self.starts.append((tag, dict(attributes)))

    def handle_endtag(self, tag) -> None:
        assert self._open.pop() == tag, f"</{tag}> at {self.getpos()}"
        self.text += " "

    def handle_data(self, data) -> None:
        if self._open[-1:] not in (["style"], ["title"]):
            self.text += data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.starts if name == tag]


@pytest.fixture(scope="module")
def html(report: Report) -> str:
    return page(report)


@pytest.fixture(scope="module")
def elements(html: str) -> Elements:
    return Elements(html)


def words(elements: Elements) -> str:
    return re.sub(r"\s+", " ", elements.text)


def test_it_asks_nothing_from_outside_its_folder_and_runs_no_script(html: str, elements: Elements) -> None:
    addresses = [
        value
        for _, attributes in elements.starts
        for name, value in attributes.items()
        if name in {"src", "href", "srcset", "data", "action", "xlink:href"}
    ]
    assert addresses
    for address in addresses:
        assert not re.match(r"(?i)[a-z]+:|//", address) or address == "data:,", address
    assert not elements.all("script")
    assert "@import" not in html
    assert not re.search(r"url\(\s*[\"']?(?!#)", html)


def test_every_picture_has_a_text_and_a_size(elements: Elements) -> None:
    pictures = {attributes["src"]: attributes for attributes in elements.all("img")}
    assert len(elements.all("img")) == 1 + 3 * 3 + 3 * 2 + 1 + 1
    assert all(attributes["alt"] for attributes in pictures.values())
    # Four ways side by side, in half the width and height.
    counted = pictures.pop("pictures/raycast-samples.png")
    assert (counted["width"], counted["height"]) == ("512", "128")
    assert pictures.pop("pictures/kept1.png")["loading"] == "lazy"
    for attributes in pictures.values():
        assert (attributes["width"], attributes["height"]) == ("256", "256")


def test_it_shows_the_pictures_that_the_report_names(report: Report, elements: Elements) -> None:
    (program,) = report.programs
    named = {name for view in program.views for _, name in view.pictures} | {program.empty_space.picture}
    named |= {kept.picture for kept in program.kept_light}
    assert {attributes["src"] for attributes in elements.all("img")} == named


def test_ids_are_unique_and_links_within_the_page_lead_somewhere(elements: Elements) -> None:
    ids = [attributes["id"] for _, attributes in elements.starts if "id" in attributes]
    assert len(ids) == len(set(ids))
    for attributes in elements.all("a"):
        if attributes["href"].startswith("#"):
            assert attributes["href"][1:] in ids


def test_headings_do_not_skip_a_level(elements: Elements) -> None:
    levels = [int(name[1]) for name, _ in elements.starts if re.fullmatch(r"h[1-6]", name)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))


def test_every_table_has_a_caption_and_headings_with_a_scope(elements: Elements) -> None:
    assert len(elements.all("table")) == len(elements.all("caption"))
    assert all("scope" in attributes for attributes in elements.all("th"))


def test_the_page_repeats_the_warnings_of_the_build(elements: Elements) -> None:
    assert "Full resolution is left out, the finest level has 9×9×9 of 18×18×18 voxels." in words(elements)


def test_the_verdict_comes_before_the_views(elements: Elements) -> None:
    text = words(elements)
    assert 0 < text.index("Within tolerance in all 3 views") < text.index("3 views Left the truth")
    assert "Worst view: superior, at 60 %" in text


def test_the_largest_errors_are_those_of_all_views_and_not_of_the_worst_one(report: Report) -> None:
    program = report.programs[0]
    first = program.views[0].model_copy(update={"seen": program.views[0].seen.model_copy(update={"rmse": 0.0123})})
    changed = program.model_copy(update={"views": (first, *program.views[1:])})
    text = words(Elements(page(report.model_copy(update={"programs": (changed, *report.programs[1:])}))))
    assert "Largest RMSE over seen pixels 0.0123 of 0.01" in text


def test_the_page_says_in_words_what_the_tolerance_lets_a_person_see(elements: Elements) -> None:
    text = words(elements)
    assert (
        "An attentive person who flips between a picture within this tolerance and the truth sees no difference" in text
    )
    assert "no thin or small structure loses more than 25% of its light" in text


def test_the_least_kept_light_of_each_level_is_shown_beside_that_of_box_means(elements: Elements) -> None:
    assert "Level 1 kept light 0.80 box reference 0.40 view superior structures 2" in words(elements)


def test_the_draw_time_stands_with_the_samples_that_are_taken(elements: Elements) -> None:
    assert "Nominal draw, 128² 75.0 ms 400 samples per ray, 120 without empty space" in words(elements)


def test_every_source_format_has_words_of_its_own() -> None:
    assert {reader.name for reader in READERS} == {*get_args(SourceFormat)} - {"auto"}
    assert title_of("nifti") == "a NIfTI volume"


def test_a_package_beyond_the_tolerance_says_in_how_many_views(report: Report) -> None:
    verdict = report.verdict.model_copy(update={"code": "beyond", "failed": 2})
    text = words(Elements(page(report.model_copy(update={"verdict": verdict}))))
    assert "Beyond tolerance in 2 of 3 views" in text


def test_what_was_left_out_stands_there_with_its_reason_and_its_cost(elements: Elements) -> None:
    text = words(elements)
    assert "Left out" in text
    assert "normals scan the scene has no lighting 276 kB" in text


def test_every_step_and_every_level_is_in_the_table(report: Report, elements: Elements) -> None:
    text = words(elements)
    for point in report.programs[0].sweep.points:
        assert point.draw is None or f"{number(point.draw.median)} ({number(point.draw.low, 2)}–" in text
    assert "A step without a time takes more than a tenth of a second." in text
    assert "8-bit target" in text
    assert "early ray termination – – " in text


def test_what_empty_space_saves_stands_in_a_table(elements: Elements) -> None:
    text = words(elements)
    assert "skip table 120 70.0 % 90.0 30.0 (27–36) 3.33 × 0 ✓ within" in text
    assert "both 120 70.0 % 40.0 30.0 (27–36) 3.33 × 0 ✓ within" in text
    assert "skin 0 distance 4³ 12×12×10 70.0 % 1.64 kB" in text
    assert "skin 0 merged 8³ 30.0 % 80 156 plain 4.10 kB" in text
    assert "was read in 1.50 ms" in text


def test_a_picture_that_a_mesh_changes_is_marked(changed_report: Report) -> None:
    verdict = changed_report.verdict
    assert (verdict.passed, verdict.failed, verdict.changed) == (False, 0, ("raycast",))
    text = words(Elements(page(changed_report)))
    assert "What skips empty space changes pictures of raycast." in text
    assert "proxy mesh 200 50.0 % 0 50.0 (45–60) 2.00 × 0.500 ✗ beyond" in text


def test_compressed_forms_stand_with_what_each_loses(elements: Elements) -> None:
    text = words(elements)
    assert "etc2-rgba8unorm 23.0 kB – 38.0 0.00400 0.200 rays through a sample ✗ beyond" in text
    assert "astc-6x6-unorm 41.0 kB 2.50 s 45.0 0.00200 0.100 the whole level, 9 pictures ✓ within" in text
    assert "Uncompressed, level 0 takes 92.2 kB" in text


def test_names_and_reasons_cannot_bring_markup_in(report: Report) -> None:
    hostile = "<script>alert(1)</script>"
    item = PlanItem(name=hostile, kept=False, reason=hostile)
    manifest = report.package.manifest
    (channel,) = manifest.channels
    info = channel.source.info.model_copy(update={"remarks": (hostile,), "unit": hostile})
    channel = channel.model_copy(update={"source": channel.source.model_copy(update={"info": info})})
    manifest = manifest.model_copy(update={"plan": (item,), "name": hostile, "channels": (channel,)})
    hostile_report = report.model_copy(update={"package": report.package.model_copy(update={"manifest": manifest})})
    assert not Elements(page(hostile_report)).all("script")


@pytest.mark.parametrize(
    ("lighting", "compositing", "is_estimate"),
    [("headlight", "emission-absorption", False), ("phong", "emission-absorption", True), ("none", "mida", True)],
)
def test_the_bound_of_a_truth_is_not_certified_where_it_is_an_estimate(
    report: Report, lighting: str, compositing: str, is_estimate: bool
) -> None:
    program = Program.model_construct(name="lit", lighting=lighting, compositing=compositing)
    manifest = report.package.manifest.model_copy(update={"programs": (program,)})
    text = page(report.model_copy(update={"package": report.package.model_copy(update={"manifest": manifest})}))
    assert text.count(", an estimate that is not certified") == 2 * is_estimate


def test_the_same_report_gives_the_same_bytes(report: Report, html: str) -> None:
    assert page(report) == html


def test_plots_take_their_colours_from_the_page(html: str) -> None:
    plots = re.findall(r"<svg .*?</svg>", html, flags=re.DOTALL)
    drawn = [plot for plot in plots if 'viewBox="0 0 24 24"' not in plot]
    # Two forms of each: error against time, error against step, error against size, transfer function.
    assert len(drawn) == 8
    for plot in drawn[:4]:
        assert not re.search(r"#[0-9a-f]{6}\b", plot), "a colour of its own"
        assert "var(--series-1)" in plot


def test_kept_light_is_a_range_where_it_is_uncertain() -> None:
    assert kept_light(seen(0.01, kept=0.91)) == "0.91"
    assert kept_light(seen(0.01, kept=0.685, within=0.296)) == "0.69 to 0.98"


def test_no_kept_light_is_told_where_nothing_was_measured() -> None:
    nothing = {"kept_light": None, "kept_light_at_most": None, "things": 0}
    assert kept_light(seen(0.01, kept=1.0).model_copy(update=nothing)) == "–"
