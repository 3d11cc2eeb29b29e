"""The page in a browser: it draws, is turned, says how wrong it is, measures, and tells what goes wrong."""

import json
import re
import shutil

import numpy as np
import pytest
from phantom_scene import write_phantom_scene
from scene_builds import built
from view_page import drag, opened, picture, press, served, text_of
from web_scenes import build_scene

from volprep.plan.device_files import read_devices
from volprep.truth.camera import standard_views
from volprep_formats.grid import Grid
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.progress import Silent

STEP_OF_8_BITS = 1 / 255


@pytest.fixture(scope="module")
def page(browser, phantom):
    """The browser, with the page of the phantom."""
    with served(phantom.package) as server:
        assert opened(browser, server.url) == "ready"
        yield browser


def middle_row(drawn: np.ndarray) -> float:
    """Row of the middle of what is seen."""
    weights = drawn[..., 3].sum(axis=1)
    return float((np.arange(len(weights)) * weights).sum() / weights.sum())


def turn_back(page) -> None:
    page.run("document.getElementById('picture').shadowRoot.querySelector('[part=button]').click()")


def test_the_page_draws_the_package_and_asks_nobody_else(page, phantom) -> None:
    drawn = picture(page)
    assert drawn.shape[0] > 100
    assert 0.05 < (drawn[..., 3] > 0.05).mean() < 0.9
    assert drawn[..., 3].max() > 0.8
    asked = page.run("return performance.getEntriesByType('resource').map((each) => new URL(each.name).origin)")
    assert set(asked) == {page.run("return location.origin")}
    assert text_of(page, "title") == phantom.report.package.manifest.name
    assert page.console == []


def test_the_first_view_shows_the_whole_volume_upright_as_the_standard_view_does(page, phantom) -> None:
    zoom, zoomed, matrix = page.run(
        "const { orbit } = window.volprep.stage; const { zoom } = orbit; const zoomed = orbit.boxFromClip(1);"
        "orbit.zoom = 1; const matrix = orbit.boxFromClip(1); orbit.zoom = zoom; return [zoom, zoomed, matrix]"
    )
    grid: Grid = phantom.report.package.manifest.levels[0].grid
    camera = standard_views(grid, "orthographic")["anterior-left"].box_from_clip(grid, aspect=1.0)
    assert np.allclose(np.reshape(matrix, (4, 4)).T, camera, atol=1e-9)
    # The box fills the picture, which is wider than high or not.
    corners = np.array([[x, y, z, 1] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * [*grid.extent_mm_zyx[::-1], 1]
    seen = corners @ np.linalg.inv(np.reshape(zoomed, (4, 4)).T).T
    assert zoom > 1
    assert 0.85 < np.abs(seen[:, :2] / seen[:, 3:]).max() < 1


@pytest.mark.long
def test_a_drag_a_key_and_the_wheel_turn_and_zoom_and_reset_takes_it_back(page) -> None:
    turn_back(page)
    first = picture(page)
    drag(page, (150, 250), (230, 280))
    turned = picture(page)
    assert np.abs(turned - first).max() > 0.2
    press(page, "ArrowLeft")
    assert np.abs(picture(page) - turned).max() > 0.02
    turn_back(page)
    assert np.array_equal(picture(page), first)
    page.send("Input.dispatchMouseEvent", type="mouseWheel", x=150, y=250, deltaX=0, deltaY=-300)
    assert (picture(page)[..., 3] > 0.05).sum() > 1.2 * (first[..., 3] > 0.05).sum()
    press(page, "0")
    assert np.array_equal(picture(page), first)


@pytest.mark.long
def test_two_fingers_move_and_zoom(page) -> None:
    turn_back(page)
    first = picture(page)
    for kind, points in (
        ("touchStart", [(150, 250), (230, 250)]),
        ("touchMove", [(110, 300), (270, 300)]),
        ("touchEnd", []),
    ):
        touches = [{"x": x, "y": y, "id": index} for index, (x, y) in enumerate(points)]
        page.send("Input.dispatchTouchEvent", type=kind, touchPoints=touches)
    found = picture(page)
    assert (found[..., 3] > 0.05).sum() > 1.5 * (first[..., 3] > 0.05).sum()
    rows = [
        float((np.arange(len(each)) * each[..., 3].sum(axis=1)).sum() / each[..., 3].sum()) for each in (first, found)
    ]
    assert rows[1] > rows[0] + 10


def test_the_error_of_the_step_and_level_is_that_of_the_report(page, phantom) -> None:
    turn_back(page)
    points = phantom.report.programs[0].sweep.points
    nominal = next(point for point in points if point.level == 0 and point.step_ratio == 1)
    assert f"{nominal.total.rmse:.3g}" in text_of(page, "error").replace("·10⁻", "e-")
    page.run("const s = document.getElementById('step'); s.value = 4; s.dispatchEvent(new Event('input'))")
    assert page.run("return window.volprep.stage.renderer.step") == pytest.approx(2 * phantom.report.step_mm)
    twice = next(point for point in points if point.level == 0 and point.step_ratio == 2)
    assert f"{twice.total.rmse:.3g}" in text_of(page, "error").replace("·10⁻", "e-")
    page.run("const s = document.getElementById('step'); s.value = 0; s.dispatchEvent(new Event('input'))")


@pytest.mark.long
def test_another_transfer_function_and_a_cut_change_the_picture(page) -> None:
    turn_back(page)
    first = picture(page)
    change = """
      const element = document.getElementById(given[0]) ?? document.querySelector(given[0]);
      element.value = given[1];
      element.dispatchEvent(new Event(given[2]));
      await new Promise((resolve) => setTimeout(resolve, 500));
      await window.volprep.stage.renderer.ready;
    """
    page.run(change, "transfer", "core", "change")
    core = picture(page)
    assert np.abs(core - first).max() > 0.2
    assert "core" in page.run("return document.getElementById('transfer').value")
    page.run(change, "transfer", "shell", "change")
    assert np.array_equal(picture(page), first)
    page.run(change, "#cut-box input", 140, "input")
    cut = picture(page)
    assert 0 < cut[..., 3].sum() < 0.9 * first[..., 3].sum()
    page.run("document.getElementById('cut-reset').click(); await new Promise((done) => setTimeout(done, 500))")
    assert np.array_equal(picture(page), first)


def test_two_points_of_the_volume_have_a_distance(page) -> None:
    script = """
    const inside = document.getElementById("picture").shadowRoot;
    const canvas = inside.querySelector("canvas");
    const said = () => inside.querySelector("[role=status]").textContent;
    const told = async (before) => {
      while (said() === before) await new Promise((resolve) => setTimeout(resolve, 20));
      return said();
    };
    document.getElementById("ruler").click();
    while (!inside.querySelector("[part=marks]")) await new Promise((resolve) => setTimeout(resolve, 20));
    const { left, top, width, height } = canvas.getBoundingClientRect();
    const lines = [said()];
    for (const y of [0.45, 0.55]) {
      for (const type of ["pointerdown", "pointerup"]) {
        const at = { clientX: left + width / 2, clientY: top + y * height, button: 3, pointerType: "mouse" };
        canvas.dispatchEvent(new PointerEvent(type, at));
      }
      lines.push(await told(lines[lines.length - 1]));
    }
    const marks = inside.querySelectorAll("circle").length;
    document.getElementById("ruler").click();
    for (let turn = 0; turn < 400 && inside.querySelector("circle"); turn++)
      await new Promise((resolve) => setTimeout(resolve, 25));
    return { lines, marks, left: inside.querySelectorAll("circle").length };
    """
    turn_back(page)
    found = page.run(script)
    _, one, both = found["lines"]
    assert re.fullmatch(r"value \S+, \S+, \S+, \S+ mm, voxel \d+, \d+, \d+, depth ± \S+ mm", one)
    assert re.match(r"\d\S* mm between the points, ± \S+ mm; value", both)
    assert (found["marks"], found["left"]) == (2, 0)


LINKED = """
document.getElementById("slices").open = true;
const frame = document.getElementById("frame");
const wait = async (test) => {
  for (let turn = 0; turn < 200 && !test(); turn++) await new Promise((resolve) => setTimeout(resolve, 25));
};
await wait(() => frame.classList.contains("four"));
const [axial, coronal, sagittal] = document.querySelectorAll(".slice");
const told = () => [axial, coronal, sagittal].map((each) => each.querySelector("canvas").getAttribute("aria-label"));
const settled = async (before) => {
  await wait(() => told().join() !== before.join());
  await new Promise((resolve) => setTimeout(resolve, 100));
};
const mm = (text) => Number(/at (-?[\\d.]+) mm/.exec(text.replace("\u2212", "-"))[1]);
const press = (box, x, y, dx = 0) => {
  const { left, top, width, height } = box.getBoundingClientRect();
  const at = { clientX: left + x * width, clientY: top + y * height, pointerId: 1, buttons: 1, bubbles: true };
  box.setPointerCapture = () => {};
  box.dispatchEvent(new PointerEvent("pointerdown", at));
  if (dx) box.dispatchEvent(new PointerEvent("pointermove", { ...at, movementX: dx, movementY: 0 }));
  box.dispatchEvent(new PointerEvent("pointerup", { ...at, clientX: at.clientX + dx, buttons: 0 }));
};
const first = told().map(mm);
let before = told();
press(axial, 0.45, 0.4);
await settled(before);
const clicked = told().map(mm);
const crossed = [coronal, sagittal].map((each) => each.querySelector(".across").style.top);
before = told();
axial.dispatchEvent(new WheelEvent("wheel", { deltaY: 100, cancelable: true }));
await settled(before);
const scrolled = told().map(mm);
const wide = Number(document.getElementById("slice-width").value);
press(coronal, 0.5, 0.5, 40);
const after = Number(document.getElementById("slice-width").value);
document.getElementById("slices").open = false;
await wait(() => !frame.classList.contains("four"));
return { first, clicked, scrolled, narrower: after - wide, crossed, left: document.querySelectorAll(".slice").length };
"""


def test_a_click_in_a_slice_moves_the_others(page) -> None:
    found = page.run(LINKED)
    first, clicked, scrolled = (np.array(found[key]) for key in ("first", "clicked", "scrolled"))
    assert clicked[0] == first[0]
    assert (clicked[1:] != first[1:]).all()
    assert scrolled[0] > clicked[0]
    assert (scrolled[1:] == clicked[1:]).all()
    assert found["narrower"] != 0
    assert all(float(each.removesuffix("px")) > 0 for each in found["crossed"])
    assert found["left"] == 0


AT_A_SLICE = """
const { stage } = window.volprep;
const wait = async (test) => {
  for (let turn = 0; turn < 400 && !test(); turn++) await new Promise((resolve) => setTimeout(resolve, 25));
};
for (const id of ["slices", "cut"]) document.getElementById(id).open = true;
await wait(() => document.getElementById("frame").classList.contains("four"));
const told = () => document.querySelector(".slice canvas").getAttribute("aria-label");
const planes = [];
const setClip = stage.renderer.setClip.bind(stage.renderer);
stage.renderer.setClip = (clip) => {
  planes.push(clip?.planes[0]);
  return setClip(clip);
};
const [axial] = [...document.querySelectorAll("#cut-plane button")].filter((each) => each.textContent === "axial");
axial.click();
await wait(() => planes.length === 1);
const first = told();
document.querySelector(".slice").dispatchEvent(new WheelEvent("wheel", { deltaY: 100, cancelable: true }));
await wait(() => planes.length === 2);
const pressed = axial.getAttribute("aria-pressed");
const depth = document.querySelector("#cut-plane input");
const before = told();
Object.assign(depth, { value: 40 }).dispatchEvent(new Event("input"));
await wait(() => told() !== before);
const slices = [first, before, told()];
const canvas = document.querySelector(".slice canvas");
const wheel = { deltaY: -200, ctrlKey: true, cancelable: true, clientX: 100, clientY: 300 };
document.querySelector(".slice").dispatchEvent(new WheelEvent("wheel", wheel));
const zoomed = [canvas.style.transform, document.getElementById("slice-zoom").value];
document.getElementById("cut-reset").click();
await wait(() => planes.at(-1) === undefined);
stage.renderer.setClip = setClip;
for (const id of ["slices", "cut"]) document.getElementById(id).open = false;
return { planes: planes.slice(0, 2), slices, zoomed, pressed };
"""


@pytest.mark.long
def test_a_cut_at_a_slice_moves_with_it_and_slices_zoom(page, phantom) -> None:
    found = page.run(AT_A_SLICE)
    grid: Grid = phantom.report.package.manifest.levels[0].grid
    places = [float(re.search(r"at (\S+) mm", each.replace("\u2212", "-"))[1]) for each in found["slices"]]
    assert places[1] != places[0]
    assert places[2] > places[1]
    for plane, place in zip(found["planes"], places, strict=False):
        # A point of the plane in box millimetres lies on the slice, and what is below it stays.
        normal = np.array(plane[:3])
        world = grid.world_from_box @ [*(-plane[3] * normal), 1]
        assert world[2] == pytest.approx(place, abs=0.6)
        assert np.array(grid.direction)[2] @ normal == pytest.approx(-1)
    assert found["pressed"] == "true"
    assert "scale(2)" in found["zoomed"][0]
    assert float(found["zoomed"][1]) == 2


def test_a_histogram_lies_under_the_transfer_function(page) -> None:
    points = page.run(
        "const counts = () => document.querySelector('.curve .counts');"
        "for (let turn = 0; turn < 400 && !counts(); turn++) await new Promise((done) => setTimeout(done, 25));"
        "return counts()?.getAttribute('points')"
    )
    heights = np.array([float(each.split(",")[1]) for each in points.split()])
    floor = heights[0]
    assert heights.min() < floor - 50
    # Each value that the phantom does not have leaves a gap, and the tallest is as high as the curve.
    assert len(np.unique(heights)) > 5


def test_points_are_listed_saved_and_loaded(page) -> None:
    found = page.run(
        """
        const { stage } = window.volprep;
        const list = () => [...document.querySelectorAll("#points-list li")].map((each) => each.textContent);
        const file = document.getElementById("points-file");
        const load = async (text, isDone) => {
          const files = new DataTransfer();
          files.items.add(new File([text], "p.json"));
          file.files = files.files;
          file.dispatchEvent(new Event("change"));
          for (let turn = 0; turn < 400 && !isDone(); turn++) await new Promise((resolve) => setTimeout(resolve, 25));
        };
        const point = { position_mm: [0, 1, 2], uncertainty_mm: 0.25, level: 0, value: 7, segments: null };
        const other = { ...point, position_mm: [3, 5, 2] };
        await load(JSON.stringify({ format: "volpkg-points", version: 1, points: [point, other] }),
          () => list()[1]?.startsWith("5.00"));
        const lines = list();
        const shown = !document.getElementById("points").hidden;
        await load("{}", () => !document.getElementById("problem").hidden);
        const problem = document.getElementById("problem").textContent;
        document.getElementById("problem").hidden = true;
        const saved = new Promise((resolve) => {
          const made = URL.createObjectURL;
          URL.createObjectURL = (blob) => {
            URL.createObjectURL = made;
            blob.text().then(resolve);
            return made.call(URL, blob);
          };
        });
        document.getElementById("points-save").click();
        const text = await saved;
        stage.points = [];
        document.getElementById("ruler").click();
        document.getElementById("ruler").click();
        return { lines, shown, problem, text, left: list() };
        """
    )
    assert found["shown"]
    assert len(found["lines"]) == 2
    assert found["lines"][1].startswith("5.00 ± 0.500 mm from point 1; value 7")
    assert "VP7085" in found["problem"]
    record = json.loads(found["text"])
    assert [each["position_mm"] for each in record["points"]] == [[0, 1, 2], [3, 5, 2]]
    assert record["distances"] == [{"from": 0, "to": 1, "mm": 5, "uncertainty_mm": 0.5}]
    assert found["left"] == []


def test_the_picture_is_saved_as_a_png_of_what_is_seen(page) -> None:
    turn_back(page)
    size = page.run(
        "const bitmap = await createImageBitmap(await window.volprep.stage.picture());"
        "const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);"
        "const context = canvas.getContext('2d'); context.drawImage(bitmap, 0, 0);"
        "const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);"
        "const reds = data.filter((_, at) => at % 4 === 0);"
        "return [bitmap.width, bitmap.height, reds.reduce((most, each) => Math.max(most, each)), data[0]]"
    )
    assert size[:2] == list(picture(page).shape[1::-1])
    assert size[2] > 200
    assert size[3] == 0


def test_what_was_decided_and_left_out_stands_beside_the_picture(page, phantom) -> None:
    page.run("document.getElementById('contents').open = true")
    told = text_of(page, "contents-body")
    for item in phantom.report.package.manifest.plan:
        assert item.reason in told


def test_all_controls_have_names_and_can_be_reached_by_keys(page) -> None:
    page.run("for (const part of document.querySelectorAll('#cut, #cut details')) part.open = true")
    nodes = page.send("Accessibility.getFullAXTree")["nodes"]
    roles = {"button", "combobox", "slider", "checkbox", "textbox", "spinbutton", "application", "link"}
    controls = [node for node in nodes if node["role"]["value"] in roles and not node["ignored"]]
    assert len(controls) > 15
    assert [node for node in controls if not node.get("name", {}).get("value")] == []
    order = page.run(
        "return [...document.querySelectorAll('a, button, select, input, summary, canvas, [tabindex]')]"
        ".filter((each) => each.tabIndex > 0).length"
    )
    assert order == 0  # the order of the page is that of its keys


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_has_contrast_in_light_and_in_dark(page, scheme) -> None:
    page.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    ratios = page.run("""
      const light = (text) => {
        const parts = text.match(/[\\d.]+/g).slice(0, 3).map((each) => each / 255);
        return parts.map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
      };
      const of = (text) => { const [r, g, b] = light(text); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
      const behind = (element) => {
        for (let at = element; at; at = at.parentElement) {
          const colour = getComputedStyle(at).backgroundColor;
          if (!/rgba\\(0, 0, 0, 0\\)|transparent/.test(colour)) return colour;
        }
        return "rgb(255, 255, 255)";
      };
      const texts = "a, p, h1, h2, h3, label, legend, dt, dd, button, select, summary, output, .why";
      return [...document.querySelectorAll(texts)]
        .filter((each) => each.innerText && !each.disabled && !each.closest("[hidden]"))
        .map((each) => [of(getComputedStyle(each).color), of(behind(each)), each.innerText.slice(0, 30)])
        .map(([a, b, text]) => [(Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), text]);
    """)
    page.send("Emulation.setEmulatedMedia", features=[])
    assert len(ratios) > 30
    assert [each for each in ratios if each[0] < 4.5] == []


def test_nothing_sticks_out_of_a_narrow_screen(page) -> None:
    widths = page.run("return [document.documentElement.scrollWidth, document.documentElement.clientWidth]")
    assert widths[0] <= widths[1]


@pytest.mark.long
def test_a_device_is_measured_and_what_it_sends_agrees_with_validation(browser, phantom, tmp_path) -> None:
    with served(phantom.package, tmp_path / "devices") as server:
        assert opened(browser, server.url) == "ready"
        told = browser.run(
            """
            document.getElementById("measure").closest("details").open = true;
            document.querySelector("#measure button.main").click();
            const done = () => /Sent to volprep|VP\\d{4}/.test(document.getElementById("measure").innerText);
            while (!done()) await new Promise((resolve) => setTimeout(resolve, 100));
            return document.getElementById("measure").innerText;
            """,
            timeout=80,
        )
    assert "VP" not in told
    (record,) = read_devices(tmp_path / "devices", phantom.report.package.manifest_sha256)
    assert record.seconds < 61
    assert "SwiftShader" in record.device.gpu
    assert {probe.name for probe in record.probes} >= {"timer queries", "R8 3D linear"}
    for measured, proved in zip(record.programs, phantom.report.programs, strict=True):
        assert [view.view for view in measured.views] == [view.view for view in proved.views]
        for view, other in zip(measured.views, proved.views, strict=True):
            assert abs(view.rmse - other.total.rmse) < STEP_OF_8_BITS
        by_place = {(point.level, point.step_mm): point for point in proved.sweep.points}
        assert len(measured.points) + len(record.left_out) >= len(by_place)
        assert len(measured.points) > 0
        for point in measured.points:
            total = by_place[point.level, point.step_mm].total
            assert abs(point.rmse - total.rmse) < STEP_OF_8_BITS
            assert abs(point.seen_rmse - total.seen_rmse) < STEP_OF_8_BITS
            assert 0 < point.fastest_ms <= point.draw_ms <= point.slowest_ms
            assert point.steady or "*" in told
        picture = phantom.report.package.manifest.picture(measured.transfer)
        told_bytes = {each.level: each.cost.upload_bytes for each in picture.drawings}
        assert {each.level: each.upload_bytes for each in measured.levels} == told_bytes
        assert {each.form for each in measured.levels} == {"ray-casting, r16float 3D texture"}
        assert [each.size for each in measured.sizes] == [48, 96, 192][: len(measured.sizes)]
        assert len(measured.sizes) > 1 or "pixels: no time" in " ".join(record.left_out)


def test_a_damaged_package_is_told_of_with_code_and_remedy(browser, phantom, tmp_path) -> None:
    package = tmp_path / "phantom.volpkg"
    shutil.copytree(phantom.package, package)
    for path in (package / "textures").glob("volume-*"):
        data = bytearray(path.read_bytes())
        data[-1] ^= 1
        path.write_bytes(data)
    with served(package) as server:
        assert opened(browser, server.url) == "problem"
        told = text_of(browser, "problem")
    assert "VP4009" in told
    assert "Copy the package again, or build it again." in told
    assert browser.run("return document.getElementById('problem').getAttribute('role')") == "alert"


@pytest.mark.long
def test_a_package_in_one_file_is_read_by_ranges(browser, phantom, tmp_path) -> None:
    package = tmp_path / "phantom.volpkg.zip"
    names = [MANIFEST, *(record.path for record in phantom.report.package.manifest.files)]
    with package.open("wb") as file:
        write_single_file(phantom.package, names, file, Silent())
    with served(package) as server:
        assert opened(browser, server.url) == "ready"
        assert picture(browser)[..., 3].max() > 0.5
        parts = "return performance.getEntriesByType('resource').filter((each) => /zip$/.test(each.name)).length"
        assert browser.run(parts) >= 2


def test_a_browser_without_webgl_is_told_so(browser, phantom) -> None:
    script = "HTMLCanvasElement.prototype.getContext = () => null"
    added = browser.send("Page.addScriptToEvaluateOnNewDocument", source=script)["identifier"]
    try:
        with served(phantom.package) as server:
            assert opened(browser, server.url) == "problem"
            assert "VP7041" in text_of(browser, "problem")
    finally:
        browser.send("Page.removeScriptToEvaluateOnNewDocument", identifier=added)


@pytest.mark.long
def test_without_a_report_the_page_draws_and_says_how_to_get_one(browser, phantom, tmp_path) -> None:
    package = tmp_path / "alone.volpkg"
    shutil.copytree(phantom.package, package)
    with served(package) as server:
        assert opened(browser, server.url) == "ready"
        assert picture(browser)[..., 3].max() > 0.5
        assert "volprep validate" in text_of(browser, "error")
        assert "volprep validate" in browser.run("return document.getElementById('measure').textContent")
        settings = json.loads(browser.run("return (await fetch('view.json')).text()"))
    assert settings["report"] is None


def test_a_package_without_such_a_light_has_no_control_for_it(page) -> None:
    assert not page.run("return document.getElementById('light').checkVisibility()")


@pytest.mark.long
@pytest.mark.parametrize("name", ["light that turns, in a mosaic", "light with a place"])
def test_a_light_is_moved_and_put_back(browser, tmp_path, name) -> None:
    package = build_scene(name, tmp_path)
    with served(package.path) as server:
        assert opened(browser, server.url) == "ready"
        before = picture(browser)
        assert browser.run("return document.getElementById('light').checkVisibility()")
        browser.run("""
            const around = document.getElementById("light-around");
            around.value = 150;
            around.dispatchEvent(new Event("input"));
        """)
        assert text_of(browser, "light-around-text") == ("150°" if "turns" in name else "150°, behind")
        assert np.abs(picture(browser) - before).max() > 0.1
        browser.run("document.getElementById('light-reset').click()")
        np.testing.assert_array_equal(picture(browser), before)


@pytest.mark.long
def test_a_surface_says_at_which_value_it_is_and_its_light_is_never_within_the_volume(browser, tmp_path) -> None:
    package = build_scene("shadow map", tmp_path)
    grid = package.manifest.grid
    manifest = json.loads((package.path / MANIFEST).read_text())
    # In front of the middle of the side that is nearest to it: at this distance the corners are farther away.
    middle_xyz = np.array(grid.extent_mm_zyx[::-1]) / 2
    near = middle_xyz - 1.2 * np.eye(3)[middle_xyz.argmin()] * middle_xyz.min()
    for program in manifest["programs"]:
        program["light"]["place_mm_xyz"] = (grid.world_from_box @ [*near, 1.0])[:3].tolist()
    (package.path / MANIFEST).write_text(json.dumps(manifest))
    with served(package.path) as server:
        assert opened(browser, server.url) == "ready"
        assert "where the value is 800" in text_of(browser, "function")
        assert "height: opacity of the pixel" in text_of(browser, "function")
        before = picture(browser)
        # The light goes once around, and on its way is nearer than the corners of the volume are.
        browser.run("""
            const around = document.getElementById("light-around");
            for (let angle = -180; angle <= 180; angle += 5) {
              around.value = angle;
              around.dispatchEvent(new Event("input"));
              await new Promise((resolve) => setTimeout(resolve));
            }
        """)
        assert browser.run("return document.getElementById('problem').hidden")
        assert np.abs(picture(browser) - before).max() > 0.1


@pytest.mark.long
def test_levels_for_previews_are_told_where_levels_are_listed(browser, tmp_path) -> None:
    scene = write_phantom_scene(tmp_path)
    text = scene.read_text(encoding="utf-8").replace("coarsest_longest_axis = 16", "coarsest_longest_axis = 4")
    scene.write_text(text, encoding="utf-8")
    manifest = built(scene, tmp_path / "p.volpkg").manifest
    levels, marked = manifest.levels, manifest.previews
    assert 0 < len(marked) < len(levels)
    with served(tmp_path / "p.volpkg") as server:
        opened(browser, server.url)
        browser.run("document.getElementById('contents').open = true")
        assert text_of(browser, "contents-body").count("(for previews)") == len(marked)
        options = browser.run("return [...document.getElementById('level').options].map((each) => each.textContent)")
    told = [text for text in options if text.endswith(", for previews")]
    assert [int(text.partition(":")[0]) for text in told] == sorted(marked)


@pytest.mark.parametrize("opened", ["browser", pytest.param("firefox", marks=pytest.mark.long)], indirect=True)
def test_the_report_shows_its_pictures_from_the_disk_and_its_policy_stops_nothing(opened, phantom) -> None:
    opened.open((phantom.report_folder / "index.html").as_uri())
    widths = opened.run("""
        for (const each of document.images) each.loading = "eager";
        while (![...document.images].every((each) => each.complete)) await new Promise((done) => setTimeout(done, 20));
        return [...document.images].map((each) => each.naturalWidth);
    """)
    assert len(widths) > 30
    assert min(widths) > 0
