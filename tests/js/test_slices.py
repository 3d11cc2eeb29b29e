"""Slices across the patient's axes, letters of directions, and windows of transfer functions."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from phantom_scene import seen_phantom
from scipy.ndimage import map_coordinates

JS = Path(__file__).parents[2] / "formats" / "js"
OPEN = """
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const gl = new OffscreenCanvas(16, 16).getContext("webgl2");
const renderer = await createRenderer(gl, await openPackage("/package/p.volpkg"));
await renderer.ready;
"""
AXES = {"axial": ((0, 1), (1, 1), 2), "coronal": ((0, 1), (2, -1), 1), "sagittal": ((1, 1), (2, -1), 0)}
"""Axes of LPS to the right and down, with their signs, and the axis across."""


@pytest.fixture
def page(browser, server, scene_package):
    def run(name: str, script: str, *given: object):
        server.folders["package"] = scene_package(name).path.parent
        browser.open(f"{server.url}/")
        return browser.run(OPEN + script, *given)

    return run


def test_slices_have_the_values_of_the_scan_where_the_patient_has_them(page, scene_package) -> None:
    script = """
    const found = [];
    for (const [plane, at] of given[0]) {
      const slice = await renderer.slice({ plane, at, size: 40 });
      found.push({ ...slice, values: Array.from(slice.values, (each) => (Number.isNaN(each) ? null : each)) });
    }
    const error = gl.getError();
    renderer.dispose();
    return { found, error };
    """
    wanted = [("axial", 0.4), ("coronal", 0.5), ("sagittal", 0.7)]
    answer = page("half floats", script, wanted)
    manifest = scene_package("half floats").manifest
    grid, volume = manifest.grid, seen_phantom(manifest).astype(float)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * grid.extent_mm_zyx[::-1]
    world = corners @ np.array(grid.direction).T + grid.corner_mm_xyz
    low, high = world.min(axis=0), world.max(axis=0)
    assert answer["error"] == 0
    for (plane, share), found in zip(wanted, answer["found"], strict=True):
        (x, sign_x), (y, sign_y), across = AXES[plane]
        place = np.zeros((found["height"], found["width"], 3))
        rows, columns = np.mgrid[: found["height"], : found["width"]] + 0.5
        place[..., x] = (low[x] if sign_x > 0 else high[x]) + sign_x * columns * found["pixel_mm"]
        place[..., y] = (low[y] if sign_y > 0 else high[y]) + sign_y * rows * found["pixel_mm"]
        place[..., across] = low[across] + share * (high[across] - low[across])
        assert found["position_mm"] == pytest.approx(place[0, 0, across])
        box = (place - grid.corner_mm_xyz) @ np.array(grid.direction)
        at = box[..., ::-1] / grid.spacing_mm_zyx - 0.5
        expected = map_coordinates(volume, np.moveaxis(at, -1, 0), order=1, mode="nearest")
        values = np.array([np.nan if each is None else each for each in found["values"]]).reshape(expected.shape)
        margin = 1e-3
        inside = ((box > margin) & (box < np.array(grid.extent_mm_zyx[::-1]) - margin)).all(axis=-1)
        assert inside.sum() > 200
        assert np.abs(values - expected)[inside].max() < 1.0
        assert np.isnan(
            values[((box < -margin) | (box > np.array(grid.extent_mm_zyx[::-1]) + margin)).any(axis=-1)]
        ).all()


@pytest.mark.long
def test_shaders_that_read_no_values_have_no_slices(page) -> None:
    assert page("classified voxels", "const found = await renderer.slice(); renderer.dispose(); return found;") is None


def test_a_window_moves_the_points_of_a_function_and_is_an_event(page, scene_package) -> None:
    script = """
    let [events, calls] = [0, 0];
    renderer.addEventListener("change", () => events++);
    renderer.onchange = () => calls++;
    const before = renderer.points;
    await renderer.setWindow({ level: 300, width: 100 });
    const after = renderer.points;
    const codes = [];
    for (const window of [{ level: 300, width: 0 }, { level: NaN, width: 3 }]) {
      await renderer.setWindow(window).catch(({ code }) => codes.push(code));
    }
    await renderer.setWindow(null);
    const back = renderer.points;
    const same = renderer.package.programs.length;
    renderer.dispose();
    return { before, after, back, codes, events, calls, same };
    """
    found = page("editable", script)
    before, after = ([each["value"] for each in found[key]] for key in ("before", "after"))
    assert (after[0], after[-1]) == (250, 350)
    assert np.allclose(np.interp(before, (before[0], before[-1]), (250, 350)), after)
    assert found["back"] == found["before"]
    assert found["codes"] == ["VP7020", "VP7020"]
    assert found["events"] == found["calls"] == 2
    assert found["same"] == len({each.transfer for each in scene_package("editable").manifest.level_programs})


def test_letters_scale_and_grey_values_are_those_of_radiologists() -> None:
    script = f"""
    const {{ edges, lengthText, roundLength }} = await import("{JS}/element/annotations.js");
    const {{ grey }} = await import("{JS}/draw/slices.js");
    const views = {{ front: [[0, 1, 0], [0, 0, 1]], left: [[-1, 0, 0], [0, 0, 1]], above: [[0, 0, -1], [0, -1, 0]] }};
    const letters = Object.entries(views).map(([name, [forward, up]]) => [name, edges({{ forward, up }})]);
    const lengths = [0.07, 1, 4.9, 73, 200, 0.00021].map((each) => lengthText(roundLength(each)));
    const pixels = [...grey({{ values: [0, 40, 240, 999, NaN] }}, {{ level: 40, width: 400 }})];
    console.log(JSON.stringify({{ letters: Object.fromEntries(letters), lengths, pixels }}));
    """
    command = ["node", "--input-type=module", "-e", script]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout)
    # Right, left, upper and lower edge.
    assert found["letters"] == {
        "front": ["L", "R", "H", "F"],
        "left": ["P", "A", "H", "F"],
        "above": ["R", "L", "A", "P"],
    }
    assert found["lengths"] == ["50 µm", "1 mm", "2 mm", "50 mm", "200 mm", "0.2 µm"]
    greys = [102, 128, 255, 255]
    assert found["pixels"] == [each for value in greys for each in (value, value, value, 255)] + [0, 0, 0, 0]


def test_borders_of_visible_segments_are_drawn_in_their_colours() -> None:
    script = f"""
    const {{ outline }} = await import("{JS}/draw/slices.js");
    const segments = [{{ name: "a", tint: [1, 0, 0] }}, {{ name: "b", visible: false }}];
    const labels = [{{ segments: [] }}, {{ segments: ["a"] }}, {{ segments: ["b"] }}];
    const renderer = {{ segments, package: {{ manifest: {{ segments: {{ segments, labels }} }} }} }};
    const slice = {{ width: 5, height: 4, labels: [0, 1, 1, 1, 0, 1, 1, 1, 1, 2, 1, 1, 1, 1, 2, 0, 1, 1, 1, 0] }};
    const pixels = outline(new Uint8ClampedArray(80), slice, renderer);
    console.log(JSON.stringify(slice.labels.map((_, i) => [...pixels.subarray(4 * i, 4 * i + 4)])));
    """
    command = ["node", "--input-type=module", "-e", script]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout)
    # The edge of the picture is no border of a segment.
    drawn = [[0, 1, 0, 1, 0], [1, 0, 0, 1, 0], [1, 0, 0, 1, 0], [0, 1, 0, 1, 0]]
    expected = [[255, 0, 0, 255] if each else [0, 0, 0, 0] for row in drawn for each in row]
    assert found == expected


def test_slices_have_the_labels_of_the_segments(page, scene_package) -> None:
    script = """
    const slice = await renderer.slice({ size: 42, labels: true });
    const none = await renderer.slice({ size: 4 });
    renderer.dispose();
    return { ...slice, values: null, labels: Array.from(slice.labels), none: none.labels };
    """
    found = page("segments", script)
    package = scene_package("segments")
    segments = package.manifest.segments
    labels = np.array(found["labels"]).reshape(found["height"], found["width"])
    volumes = {each.name: each.volume_ml for each in segments.segments}
    assert found["none"] is None
    assert len(np.unique(labels)) > 2
    assert labels.max() < len(segments.labels)
    named = {name for label in np.unique(labels) for name in segments.labels[label].segments or ()}
    assert named <= set(volumes)
    assert len(named) > 1
