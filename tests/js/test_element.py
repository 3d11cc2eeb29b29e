"""The custom element: a package in a page by one line, for eyes, hands, keys and screen readers."""

import io
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from every_kind import single_file
from npm_package import npm_package
from PIL import Image
from web_server import WebServer

PAGE = """<!doctype html><html lang=en><meta charset=utf-8><title>volume</title><link rel=icon href='data:,'>
<style>body { margin: 0; background: #fff } volume-viewer { width: 300px; height: 200px }
volume-viewer::part(button) { background: rgb(0, 60, 0) }</style>
<main><h1 style="font-size: 16px">Head</h1>
<volume-viewer id=one src="/package/p.volpkg" controls measuring label="A head" background="#808080"
  poster="/package/p.volpkg/preview.png"></volume-viewer></main>
<script type=module src="/js/element.js"></script></html>"""
START = """
const one = document.getElementById("one");
const next = (type, target = one) => new Promise((resolve) => target.addEventListener(type, resolve, { once: true }));
const frame = () => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
const told = (type, ms) => Promise.race([next(type), new Promise((resolve) => setTimeout(() => resolve(null), ms))]);
"""


@pytest.fixture(scope="module")
def page(browser: Browser, tmp_path_factory, scene_package) -> Browser:
    """A page with the element, loaded."""
    folder: Path = tmp_path_factory.mktemp("element")
    (folder / "index.html").write_text(PAGE)
    js = Path(__file__).parents[2] / "formats" / "js"
    axe = npm_package("axe-core", "4.10.3") / "node_modules" / "axe-core"
    package = scene_package("lit, skips by distance")
    single_file(package.path)
    with WebServer({"js": js, "page": folder, "package": package.path.parent, "axe": axe}) as server:
        browser.open(f"{server.url}/page/index.html")
        browser.run(START + 'while (one.renderer?.level !== 0) await told("levelchange", 50); await frame();')
        yield browser


def shown(page: Browser) -> np.ndarray:
    left, top = page.run(START + "const { left, top } = one.getBoundingClientRect(); return [left, top]")
    image = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))
    return image[int(top) + 60 : int(top) + 190, int(left) : int(left) + 300]


def test_one_line_shows_the_volume_over_the_background(page) -> None:
    picture = shown(page)
    assert (picture == 128).all(axis=-1).mean() > 0.2
    assert (picture != 128).any(axis=-1).mean() > 0.05
    found = page.run(START + "return [one.shadowRoot.querySelector('img').hidden, one.package.name]")
    assert found == [True, "p.volpkg"]


@pytest.mark.long
def test_attributes_are_followed_and_wrong_ones_are_told(page) -> None:
    script = (
        START
        + """
    const look = async () => {
      await frame();
      one.stage.draw();
      return Array.from(one.renderer.readPixels().pixels);
    };
    const apart = (a, b) => a.length !== b.length || a.some((each, i) => Math.abs(each - b[i]) > 0.02);
    const whole = await look();
    one.setAttribute("view", "superior");
    const above = await look();
    one.setAttribute("clip", "0 0 0 1 1 0.5");
    // On a busy machine it takes a while.
    let cut = await look();
    while (!apart(above, cut)) cut = await look();
    one.removeAttribute("clip");
    one.setAttribute("function", "core");
    while (one.renderer.program !== "core") await new Promise((resolve) => setTimeout(resolve, 20));
    const wrong = [];
    const values = { view: "sideways", function: "none", background: "reddish", clip: "1 2" };
    for (const [name, value] of Object.entries(values)) {
      const error = next("error");
      one.setAttribute(name, value);
      wrong.push((await error).detail.code);
    }
    const failed = next("error");
    one.setAttribute("src", "/package/nothing.volpkg");
    wrong.push((await failed).detail.code);
    for (const name of ["view", "function", "clip"]) one.removeAttribute(name);
    one.setAttribute("background", "#808080");
    const events = [];
    for (const type of ["load", "progress", "levelchange"]) {
      one.addEventListener(type, ({ detail }) => events.push([type, detail]));
    }
    one.setAttribute("src", "/package/p.volpkg");
    while (one.renderer?.level !== 0) await new Promise((resolve) => setTimeout(resolve, 20));
    const again = await look();
    const kinds = [...new Set(events.map(([type]) => type))].sort();
    const last = events.filter(([type]) => type === "progress").pop()[1];
    const differ = { moved: apart(whole, above), cut: apart(above, cut), same: !apart(whole, again) };
    return { ...differ, wrong, kinds, all: last.loaded === last.total };
    """
    )
    assert page.run(script) == {
        "moved": True,
        "cut": True,
        "same": True,
        "wrong": ["VP7081", "VP7081", "VP7081", "VP7081", "VP4001"],
        "kinds": ["levelchange", "load", "progress"],
        "all": True,
    }


def test_it_turns_by_itself_and_numbers_that_are_none_are_told(page) -> None:
    script = (
        START
        + """
    const wrong = [];
    const clips = ["0 0 0 1 1 -0.5", "0 0 0.6 1 1 0.5", "0 0 0 1 1 x"];
    const values = [["auto-rotate", "fast"], ...clips.map((each) => ["clip", each])];
    for (const [name, value] of values) {
      const error = told("error", 5000);
      one.setAttribute(name, value);
      wrong.push((await error)?.detail.code);
      one.removeAttribute(name);
    }
    const forward = () => one.stage.orbit.camera.forward;
    const before = forward();
    one.setAttribute("auto-rotate", "90");
    while (forward().every((each, i) => Math.abs(each - before[i]) < 0.05)) await frame();
    one.removeAttribute("auto-rotate");
    await frame();
    const stopped = forward();
    await frame();
    const still = forward().every((each, i) => each === stopped[i]);
    one.stage.look();
    return { wrong, still };
    """
    )
    assert page.run(script) == {"wrong": ["VP7081"] * 4, "still": True}


@pytest.mark.long
def test_keys_turn_it_and_enter_reads_out_what_is_in_the_middle(page) -> None:
    script = (
        START
        + """
    const canvas = one.shadowRoot.querySelector("canvas");
    const press = (key) => canvas.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
    while (!one.shadowRoot.querySelector("[role=toolbar]")) await new Promise((resolve) => setTimeout(resolve, 20));
    const before = one.stage.orbit.camera.forward;
    press("ArrowLeft");
    const after = one.stage.orbit.camera.forward;
    press("0");
    const picks = [];
    one.addEventListener("pick", ({ detail }) => picks.push(detail));
    const { left, top, width, height } = canvas.getBoundingClientRect();
    for (let y = 0.3; y < 0.8; y += 0.05) {
      const at = { clientX: left + 0.5 * width, clientY: top + y * height };
      const picked = next("pick");
      // As an event that was not trusted it captures no pointer.
      const click = (type) => canvas.dispatchEvent(new PointerEvent(type, { ...at, button: 3, pointerType: "mouse" }));
      click("pointerdown");
      click("pointerup");
      await picked;
    }
    const entered = next("pick");
    press("Enter");
    await entered;
    const status = one.shadowRoot.querySelector("[role=status]").textContent;
    const marks = one.shadowRoot.querySelectorAll("circle").length;
    const turned = before.some((each, i) => Math.abs(each - after[i]) > 1e-3);
    return { turned, picks: picks.filter(Boolean).length, status, marks };
    """
    )
    found = page.run(script)
    assert found["turned"]
    assert found["picks"] > 1
    assert "mm" in found["status"]
    # A mark at each point: of the clicks that hit, and of the key.
    assert found["marks"] == found["picks"]


@pytest.mark.long
def test_bytes_are_drawn_wherever_the_element_is_put(page) -> None:
    """As in JupyterLab, which attaches an element after it was made, and moves it."""
    script = (
        START
        + """
    const bytes = new Uint8Array(await (await fetch("/package/p.volpkg.zip")).arrayBuffer());
    const made = document.createElement("volume-viewer");
    const drawn = async () => {
      const late = performance.now() + 15_000;
      while (made.renderer?.level !== 0 && performance.now() < late) await told("nothing", 50);
      return made.renderer?.level ?? null;
    };
    made.open(bytes.slice());
    document.body.append(made);
    const found = [await drawn()];
    document.querySelector("main").append(made);
    found.push(await drawn());
    made.remove();
    return found;
    """
    )
    assert page.run(script) == [0, 0]


def test_letters_a_scale_bar_and_the_fidelity_are_shown_on_request(page) -> None:
    script = (
        START
        + """
    const found = () => [...one.shadowRoot.querySelectorAll("[part=annotations] text")].map((each) => each.textContent);
    const text = () => one.shadowRoot.querySelector("[part=fidelity]")?.textContent ?? "";
    const before = [found(), text()];
    one.setAttribute("annotations", "");
    one.setAttribute("fidelity", "");
    one.setAttribute("view", "anterior");
    one.package.manifest.pictures[0].drawings[0].fidelity = { rmse: 0.004 };
    while (!found().length || !/stated/.test(text())) await new Promise((resolve) => setTimeout(resolve, 20));
    const after = [found(), text()];
    for (const name of ["annotations", "fidelity", "view"]) one.removeAttribute(name);
    const left = () => one.shadowRoot.querySelectorAll("[part=annotations], [part=fidelity]").length;
    for (const late = performance.now() + 5000; left() && performance.now() < late; ) await frame();
    return { before, after, left: left() };
    """
    )
    found = page.run(script)
    assert found["before"] == [[], ""]
    letters, fidelity = found["after"]
    assert letters[:4] == ["L", "R", "H", "F"]
    assert letters[4].endswith(" mm")
    assert "error 0.004 against the scan" in fidelity
    assert found["left"] == 0


def test_axe_finds_nothing_to_object_to(page) -> None:
    script = (
        START
        + """
    if (!window.axe) {
      const script = document.createElement("script");
      script.src = "/axe/axe.min.js";
      const loaded = next("load", script);
      document.head.append(script);
      await loaded;
    }
    const { violations } = await axe.run(document);
    return violations.map(({ id, nodes }) => [id, nodes.map((each) => each.html)]);
    """
    )
    assert page.run(script) == []


def test_parts_are_styled_by_the_page_and_what_is_removed_is_freed(page) -> None:
    script = (
        START
        + """
    const button = one.shadowRoot.querySelector("button");
    const colour = getComputedStyle(button).backgroundColor;
    const { renderer, package: pack } = one;
    const parent = one.parentNode;
    one.remove();
    const freed = [renderer.textureBytes, pack.signal.aborted, one.renderer];
    parent.append(one);
    while (one.renderer?.level !== 0) await new Promise((resolve) => setTimeout(resolve, 20));
    return { colour, freed };
    """
    )
    assert page.run(script) == {"colour": "rgb(0, 60, 0)", "freed": [0, True, None]}


NARROW = """
const viewer = document.createElement("volume-viewer");
viewer.style.cssText = "width: 100%; height: 300px";
for (const each of ["controls", "measuring", "annotations", "fidelity"]) viewer.toggleAttribute(each, true);
document.body.prepend(viewer);
viewer.setAttribute("src", "/package/p.volpkg");
while (viewer.renderer?.level !== 0) await told("levelchange", 50);
await viewer.renderer.ready;
await frame();
const canvas = viewer.shadowRoot.querySelector("canvas");
const point = (x, y) => {
  const { left, top, width, height } = canvas.getBoundingClientRect();
  const at = { clientX: left + x * width, clientY: top + y * height, pointerId: 1, isPrimary: true, bubbles: true };
  canvas.dispatchEvent(new PointerEvent("pointerdown", at));
  canvas.dispatchEvent(new PointerEvent("pointerup", at));
  return next("pick", viewer);
};
await point(0.5, 0.5);
await point(0.55, 0.5);
await frame();
const rect = (each) => each.getBoundingClientRect();
const texts = ["status", "fidelity", "tools"].map((each) => viewer.shadowRoot.querySelector(`[part=${each}]`));
const marks = [...viewer.shadowRoot.querySelectorAll("[part=annotations] text, [part=annotations] path")];
const meet = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1;
const found = [...marks, ...texts].flatMap((one, i, all) =>
  all.slice(i + 1).filter((other) => texts.includes(other) && meet(rect(one), rect(other))).map((other) =>
    `${one.textContent.slice(0, 20)} / ${other.part}`));
const outside = [...marks, ...texts].filter((each) => rect(each).left < 0 || rect(each).right > innerWidth);
const said = texts.every((each) => each.textContent.length > 20);
viewer.remove();
return { found, outside: outside.length, said };
"""


def test_on_a_phone_no_text_of_the_tools_lies_over_another(page) -> None:
    page.send("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=1, mobile=True)
    try:
        found = page.run(START + NARROW)
    finally:
        page.send("Emulation.clearDeviceMetricsOverride")
    assert found == {"found": [], "outside": 0, "said": True}
