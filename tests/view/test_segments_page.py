"""The page of a scan with its segments: a list with volumes, and names under the resting mouse."""

import re
import subprocess
from pathlib import Path

import pytest
from view_page import opened, served, text_of
from web_scenes import build_scene

from volprep_formats.package.reader import Package

ROOT = Path(__file__).parents[2]
_PLACES = """
const canvas = window.volprep.stage.gl.canvas;
const { left, top, width, height } = canvas.getBoundingClientRect();
const found = [];
for (const [x, y] of [[0.5, 0.5], [0.42, 0.5], [0.6, 0.5], [0.01, 0.01]]) {
  const hit = await window.volprep.stage.renderer.pick(x * canvas.width, y * canvas.height);
  found.push([left + x * width, top + y * height, hit?.segments ?? []]);
}
return found;
"""
_HOVERED = """
const note = document.querySelector(".hovered");
await new Promise((resolve) => setTimeout(resolve, 300));
for (let turn = 0; note.hidden && turn < given[0]; turn++) await new Promise((resolve) => setTimeout(resolve, 20));
return note.hidden ? "" : note.textContent;
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Package:
    return build_scene("segments", tmp_path_factory.mktemp("segments"))


def _move(browser, x: float, y: float, **more: object) -> None:
    browser.send("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y, button="none", buttons=0, **more)


_OPEN = """
const cards = ["segments", "look", "slices"].map((id) => document.getElementById(id));
const open = () => cards.filter((card) => card.open).map((card) => card.id);
const first = open();
for (const id of ["slices", "cut"]) document.getElementById(id).open = true;
for (let turn = 0; turn < 400 && !document.querySelector(".four"); turn++)
  await new Promise((resolve) => setTimeout(resolve, 25));
await new Promise((resolve) => setTimeout(resolve, 100));
const { top } = document.getElementById("frame").getBoundingClientRect();
return { first, then: open(), screens: document.documentElement.scrollHeight / innerHeight, top };
"""


@pytest.fixture
def page(browser, package):
    with served(Path(package.path)) as server:
        assert opened(browser, server.url) == "ready"
        yield browser


@pytest.mark.long
def test_the_mouse_names_the_segments_that_it_rests_on(page, package) -> None:
    titles = {each.name: each.title or each.name for each in package.manifest.segments.segments}
    seen: set[str] = set()
    for x, y, names in page.run(_PLACES):
        _move(page, x, y)
        expected = " and ".join(titles[name] for name in names)
        assert page.run(_HOVERED, 100 if expected else 5) == expected
        seen.add(expected)
    assert len(seen) > 2
    assert "" in seen
    assert page.console == []


@pytest.mark.long
def test_a_moving_or_pressed_mouse_names_nothing(page) -> None:
    x, y, names = page.run(_PLACES)[0]
    assert names
    _move(page, x, y)
    assert page.run(_HOVERED, 100)
    page.send("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", buttons=1, clickCount=1)
    assert page.run("return document.querySelector('.hovered').hidden")
    page.send("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, button="left", buttons=0, clickCount=1)


def test_the_list_has_the_volume_of_every_segment(page, package) -> None:
    told = text_of(page, "segments-body")
    segments = package.manifest.segments.segments
    assert all((each.title or each.name) in told for each in segments)
    volumes = [float(each) for each in re.findall(r"(\S+) ml", told)]
    assert volumes == pytest.approx([each.volume_ml for each in segments], rel=0.01)


def test_the_ruler_says_titles() -> None:
    script = f"""import {{ words }} from "{ROOT}/formats/js/element/ruler.js";
    const hit = {{ value: 1, segments: ["a", "b"], position_mm: [1, 2, 3], voxel: [4, 5, 6], uncertainty_mm: 0.5 }};
    console.log(words(hit, [{{ name: "a", title: "Liver" }}, {{ name: "b" }}]));"""
    done = subprocess.run(["node", "--input-type=module", "-e", script], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("Liver and b: value 1, ")


def test_switching_a_segment_leaves_no_word_of_loading(page) -> None:
    changed = """
    const { renderer } = window.volprep.stage;
    await renderer.setSegment(renderer.segments[0].name, { visible: false });
    const [viewer] = document.querySelectorAll("volume-viewer");
    return [renderer.segments[0].visible, viewer.shadowRoot.textContent];
    """
    visible, text = page.run(changed)
    assert not visible
    assert "loading" not in text


def test_on_a_telephone_what_is_touched_is_not_scrolled_below_the_picture(page) -> None:
    page.send("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=1, mobile=True)
    places = """
    const field = document.querySelector("#segments-body input");
    field.scrollIntoView();
    const bottom = document.querySelector(".frame").getBoundingClientRect().bottom;
    return [window.scrollY, field.getBoundingClientRect().top - bottom];
    """
    scrolled, below = page.run(places)
    page.send("Emulation.clearDeviceMetricsOverride")
    assert scrolled > 0
    assert below >= 0


_SEARCHED = """
const { segmentControls } = await import(new URL("page/segments.js", document.baseURI));
const segments = Array.from({ length: 9 }, (_, i) => ({ name: `organ-${i}`, volume_ml: 1 }));
const renderer = { setSegments: async () => {} };
segmentControls({ gl: window.volprep.stage.gl, renderer }, { segments: { segments } }, () => {});
const field = document.querySelector("#segments-body input[type=search]");
return ["7", "spleen"].map((text) => {
  field.value = text;
  field.dispatchEvent(new Event("input"));
  return document.querySelector("#segments-body").innerText.split("\\n").filter((line) => /rgan|egment/.test(line));
});
"""


def test_a_search_that_finds_no_segment_says_so(page) -> None:
    assert page.run(_SEARCHED) == [["organ-7"], ["No segment has this in its name."]]


def test_a_phone_shows_one_card_at_a_time_on_three_screens(page) -> None:
    found = page.run("scrollTo(0, document.body.scrollHeight);" + _OPEN)
    assert found["first"] == ["segments"]
    assert found["then"] == ["slices"]
    assert found["screens"] < 3
    assert 0 <= found["top"] < 100
