"""The notebook widget: its module in a browser with a model as anywidget gives one, its traits, its still picture."""

import base64
import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from PIL import Image
from traitlets import TraitError
from web_server import WebServer
from widget_page import START, module_served, open_widget

import volprep
from volprep.library.notebook.widget import VolumeWidget, captioned
from volprep_formats.package.reader import Package

SAMPLES = Path(__file__).parents[2] / "formats" / "samples"
PARALLEL = {"forward": [0, 0, 1], "up": [0, 0, 2]}


def ball() -> np.ndarray:
    z, y, x = np.mgrid[:24, :24, :24]
    return (255 * np.exp(-((z - 14) ** 2 + (y - 10) ** 2 + (x - 12) ** 2) / 40)).astype(np.uint8)


@pytest.fixture(scope="module")
def widget() -> VolumeWidget:
    return volprep.show(ball(), spacing_mm_zyx=(1.0, 1.0, 2.0), editable=True)


@pytest.fixture(scope="module")
def server(widget, tmp_path_factory) -> Iterator[WebServer]:
    with module_served(widget, tmp_path_factory.mktemp("esm")) as serving:
        yield serving


@pytest.fixture(scope="module")
def notebook(widget, server, browser: Browser) -> Browser:
    """A page in which anywidget would have rendered the widget."""
    open_widget(browser, widget, server)
    return browser


def test_the_module_imports_nothing_and_exports_render(widget, server) -> None:
    text = str(widget._esm)
    assert "import(" not in text
    assert "import.meta" not in text
    assert text.rstrip().endswith(".widget;")


@pytest.mark.long
def test_both_sides_follow_view_clip_and_points(notebook) -> None:
    script = (
        START
        + """
    const { stage } = viewer();
    const first = pixels(viewer());
    const seen = {};
    model.tell("view", "superior");
    seen.view = apart(first, pixels(viewer())) > 0.05;
    await wait(() => model.get("camera")?.forward[2] === -1);
    // By hand: keys as people press them.
    const canvas = viewer().shadowRoot.querySelector("canvas");
    await wait(() => viewer().shadowRoot.querySelector("[role=toolbar]"));
    canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft", bubbles: true }));
    await wait(() => model.get("view") === "" && Math.abs(model.get("camera").forward[2]) < 0.9999);
    const turned = pixels(viewer());
    const camera = model.get("camera");
    model.tell("view", "left");
    await wait(() => model.get("camera").forward[0] === -1);
    seen.moved = apart(turned, pixels(viewer())) > 0.05;
    model.tell("camera", camera);
    seen.back = model.get("view") === "" && apart(turned, pixels(viewer())) < 0.01;
    model.tell("view", "left");
    const whole = pixels(viewer());
    model.tell("clip", [0, 0, 0, 1, 1, 0.5]);
    await wait(() => apart(whole, pixels(viewer())) > 0.05);
    viewer().setAttribute("clip", "0 0 0 1 1 0.25");
    await wait(() => model.get("clip")?.[5] === 0.25);
    viewer().removeAttribute("clip");
    await wait(() => model.get("clip") === null && apart(whole, pixels(viewer())) < 0.01);
    model.tell("points", [{ value: 0, colour: [1, 0, 0], extinction_per_mm: 1 }]);
    await wait(() => apart(whole, pixels(viewer())) > 0.3);
    model.tell("points", null);
    await wait(() => apart(whole, pixels(viewer())) < 0.01);
    const before = model.get("error");
    model.tell("function", "nothing");
    await wait(() => model.get("error"));
    return { seen, before, error: model.get("error"), name: model.get("function") };
    """
    )
    found = notebook.run(script)
    assert found["seen"] == {"view": True, "moved": True, "back": True}
    assert found["before"] == ""
    assert found["error"].startswith("VP7081")


def test_the_widget_draws_what_the_element_draws_and_leaves_nothing(notebook, server, widget) -> None:
    drawn = notebook.run(START + 'model.tell("view", "anterior"); viewer().style.maxWidth = "300px"; return null')
    script = START + 'await wait(() => viewer().shadowRoot.querySelector("canvas").clientWidth === 300);'
    drawn = notebook.run(script + "return pixels(viewer())")
    left = notebook.run("clean(); return [document.body.children.length, [...model.heard['change:view']].length]")
    assert left == [0, 0]
    notebook.open(f"{server.url}/esm/index.html")
    script = (
        START
        + """
    await import("/js/element.js");
    const made = document.createElement("volume-viewer");
    Object.assign(made.style, { width: "300px" });
    made.setAttribute("view", "anterior");
    made.setAttribute("controls", "");
    document.body.append(made);
    await made.open(bytes(given[0]));
    await wait(() => made.renderer.level === 0);
    return pixels(made);
    """
    )
    element = notebook.run(script, base64.b64encode(widget.package).decode())
    assert len(drawn) == len(element) == 4 * 300 * 225
    assert max(drawn) > 0.2
    np.testing.assert_allclose(drawn, element, atol=1e-6)


def test_a_cell_has_slices_with_one_crosshair_and_a_box_for_each_segment(browser, tmp_path) -> None:
    widget = volprep.show(SAMPLES / "segments.volpkg.zip")
    widget.width = 120
    script = (
        START
        + """
    document.head.append(Object.assign(document.createElement("style"), { textContent: given[0] }));
    const whole = pixels(viewer());
    const boxes = [...document.querySelectorAll(".volprep-segments input")];
    boxes[0].click();
    await wait(() => apart(whole, pixels(viewer())) > 0.05);
    const hidden = model.get("segments");
    model.tell("segments", {});
    await wait(() => boxes[0].checked && apart(whole, pixels(viewer())) < 0.01);
    model.tell("slices", true);
    const told = () => [...document.querySelectorAll(".slice canvas")].map((each) => each.getAttribute("aria-label"));
    await wait(() => told().length === 3 && told().every(Boolean));
    const before = told();
    document.querySelector(".slice").dispatchEvent(new WheelEvent("wheel", { deltaY: 100, cancelable: true }));
    await wait(() => told()[0] !== before[0]);
    const others = [before, told()].map((each) => each.slice(1).join());
    model.tell("slices", false);
    const left = document.querySelectorAll(".slice").length;
    model.tell("segments", { nobody: { visible: false } });
    await wait(() => model.get("error"));
    return { hidden, names: boxes.map((each) => each.name), others, left, error: model.get("error") };
    """
    )
    with module_served(widget, tmp_path) as serving:
        open_widget(browser, widget, serving)
        found = browser.run(script, widget._css)
    names = [segment.name for segment in Package.open(SAMPLES / "segments.volpkg.zip").manifest.segments.segments]
    assert found["names"] == names
    assert found["hidden"] == {names[0]: {"visible": False}}
    assert found["others"][0] == found["others"][1]
    assert found["left"] == 0
    assert "nobody" in found["error"]


def test_programs_that_run_nothing_show_a_picture_with_words(widget) -> None:
    data, metadata = widget._repr_mimebundle_()
    assert data["application/vnd.jupyter.widget-view+json"]["model_id"] == widget.model_id
    assert data["text/plain"] == metadata["image/png"]["alt"] == widget.label
    assert "Not validated." in widget.label
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(data["image/png"]))))
    preview = np.asarray(Image.open(io.BytesIO(widget.picture)))
    np.testing.assert_array_equal(picture[: preview.shape[0]], preview)
    assert (picture[preview.shape[0] :] < 100).any()


def test_the_state_of_a_notebook_holds_the_package_only_if_it_is_told_to_keep_it(widget, monkeypatch) -> None:
    state = widget.get_state()
    assert len(widget.package) > 1000
    assert max(len(value) for value in state.values() if isinstance(value, bytes)) < len(widget.package)
    assert widget.package not in state.values()
    sent = []
    monkeypatch.setattr(widget, "send", lambda *message: sent.append(message))
    widget._answer(widget, {"wanted": "package"}, [])
    widget._answer(widget, {"wanted": "passwd"}, [])
    assert sent == [({"given": "package"}, [widget.package])]
    kept = VolumeWidget({}, keep=True, package=widget.package)
    assert kept.get_state()["kept"] == widget.package


def test_the_words_are_those_of_the_report_beside_a_package(tmp_path) -> None:
    volprep.build_package(ball()[4::4, 4::4, ::4], tmp_path / "ball.volpkg")
    report = volprep.validate_package(tmp_path / "ball.volpkg", size=16)
    shown = volprep.show(tmp_path / "ball.volpkg", view="left")
    assert f"Validation {'passed' if report.verdict.passed else 'failed'}: RMSE " in shown.label
    assert shown.view == "left"
    assert volprep.show(volprep.open_package(tmp_path / "ball.volpkg")).package == shown.package
    with pytest.raises(volprep.VolprepError, match="spacing_mm_zyx is for arrays"):
        volprep.show(tmp_path / "ball.volpkg", spacing_mm_zyx=(1.0, 1.0, 1.0))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("view", "sideways"),
        ("clip", [0, 0, 0, 1, 1]),
        ("points", [{"value": 1}]),
        ("camera", PARALLEL),
        ("background", "pink"),
    ],
)
def test_wrong_values_are_refused_in_python(widget, name, value) -> None:
    before = getattr(widget, name)
    with pytest.raises(TraitError):
        setattr(widget, name, value)
    assert getattr(widget, name) == before


def test_points_begin_as_those_of_the_function(widget) -> None:
    (points,) = widget.functions.values()
    widget.points = points
    assert widget.points == points
    widget.points = None


def test_a_preview_that_is_too_large_damaged_or_no_png_is_not_unpacked() -> None:
    file = io.BytesIO()
    Image.new("RGB", (8, 8)).save(file, "PNG")
    sound = file.getvalue()
    assert captioned(sound, "words") is not None
    large = sound[:16] + (14_000).to_bytes(4, "big") * 2 + sound[24:]
    for picture in (large, sound[:40], sound[:20], b"GIF89a" + bytes(60)):
        assert captioned(picture, "words") is None
