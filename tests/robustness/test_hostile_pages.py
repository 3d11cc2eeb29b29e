"""Foreign text in any field of any page stays text: no script runs, nothing navigates, nothing is requested."""

from collections.abc import Callable, Iterator

import pytest
from browser import Browser
from every_field import filled
from every_kind import write_segments
from firefox import Firefox
from hostile_text import ATTACKS, made_hostile
from phantom_scene import write_phantom_scene
from scene_builds import built
from view_page import READY, served
from web_server import WebServer
from widget_page import module_served, open_widget

import volprep
from volprep.batch import page as batch_page
from volprep.batch.records import JobRecord
from volprep.lab.ablation.page import ablation_page
from volprep.lab.ablation.records import Ablation
from volprep.lab.curves.page import curves_page
from volprep.lab.curves.records import CurvesReport
from volprep.lab.stress.records import StressReport
from volprep.lab.stress.study import stress_page
from volprep.lab.studies import ABLATION, CURVES
from volprep.report.page import page as report_page
from volprep.validation.results.report import Report
from volprep.view.export import write_page_file
from volprep.view.site import shown_with
from volprep_formats.progress import Silent


def _report(text: str) -> str:
    return report_page(filled(Report, text), (ABLATION, CURVES))


def _batch(text: str) -> str:
    built_job = filled(JobRecord, text)
    return batch_page.page([built_job, built_job.model_copy(update={"outcome": "failed"})])


PAGES: dict[str, Callable[[str], str]] = {
    "report": _report,
    "ablation": lambda text: ablation_page(filled(Ablation, text)),
    "curves": lambda text: curves_page(filled(CurvesReport, text)),
    "stress": lambda text: stress_page(filled(StressReport, text)),
    "batch": _batch,
}
"""Pages that templates make, by name: their text with one text in every field of their record."""
ELEMENTS = """
await new Promise((resolve) => setTimeout(resolve, 100));
const names = (each) => [...each.attributes].map((one) => one.name).join(" ");
return {
  elements: [...document.querySelectorAll("*")].map((each) => `${each.tagName} ${names(each)}`),
  attacked: window.attacked ?? null,
  address: location.href,
};
"""


BROWSERS = ("browser", pytest.param("firefox", marks=pytest.mark.long))
KINDS = {
    "maximum": lambda folder: write_phantom_scene(folder, "gles3", "box", more='[render]\ncompositing = "maximum"\n'),
    "segments": write_segments,
}


@pytest.fixture
def outside() -> Iterator[WebServer]:
    """A server that no page may ask for anything."""
    with WebServer() as server:
        yield server
    assert server.asked == []


@pytest.mark.parametrize("opened", BROWSERS, indirect=True)
@pytest.mark.parametrize("name", PAGES)
def test_foreign_text_in_every_field_of_a_report_stays_text(opened, outside, tmp_path, name) -> None:
    make, page = PAGES[name], tmp_path / "page.html"

    def elements_with(text: str) -> dict[str, object]:
        page.write_text(make(text), encoding="utf-8")
        opened.open(page.as_uri())
        return opened.run(ELEMENTS)

    plain = elements_with("name")
    assert len(plain["elements"]) > 50
    assert (plain["attacked"], plain["address"]) == (None, page.as_uri())
    for attack in ATTACKS:
        assert elements_with(attack.format(url=outside.url)) == plain, attack


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("opened", BROWSERS, indirect=True)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("attack", range(len(ATTACKS)))
def test_foreign_text_in_every_field_of_a_package_stays_text(opened, outside, tmp_path, kind, attack) -> None:
    package = built(KINDS[kind](tmp_path), tmp_path / "p.volpkg").path
    text = ATTACKS[attack].format(url=outside.url)
    assert made_hostile(package, text) > 20
    one_file = tmp_path / "one.html"
    write_page_file(shown_with(package, None, tmp_path / "none"), one_file, Silent())
    with served(package) as server:
        for address in (one_file.as_uri(), server.url):
            opened.open(address)
            assert opened.run(READY) == "ready", opened.run("return document.getElementById('problem').innerText")
            assert text[:4] in opened.run("return document.getElementById('title').innerText")
            _require_untouched(opened, address)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("attack", range(len(ATTACKS)))
def test_foreign_text_in_every_field_stays_text_in_a_notebook(browser, outside, tmp_path, attack) -> None:
    package = built(KINDS["maximum"](tmp_path), tmp_path / "p.volpkg").path
    made_hostile(package, ATTACKS[attack].format(url=outside.url))
    widget = volprep.show(package)
    with module_served(widget, tmp_path) as server:
        open_widget(browser, widget, server)
        _require_untouched(browser, f"{server.url}/esm/index.html")


def _require_untouched(opened: Browser | Firefox, address: str) -> None:
    found = opened.run(ELEMENTS)
    assert (found["attacked"], found["address"].rstrip("/")) == (None, address.rstrip("/"))
