"""A volume in a scene of three.js: its camera, what is opaque, render targets, colour space and tone mapping."""

import base64
import io
import re
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from npm_package import npm_package
from PIL import Image
from web_pictures import TWO_STEPS, rmse

from volprep.render.renderer import Renderer
from volprep.truth.camera import Camera
from volprep_formats.package.reader import Package

VERSION = "0.187.0"
JS = Path(__file__).parents[2] / "formats" / "js"
SIZE = 60


@pytest.fixture(scope="module")
def package(scene_package) -> Package:
    return scene_package("lit, skips by distance")


@pytest.fixture
def page(browser, server, package):
    """The page with three.js, and the package beside it under the name of the README."""
    server.folders["three"] = npm_package("three", VERSION) / "node_modules" / "three"
    server.folders["head.volpkg"] = package.path
    browser.open(f"{server.url}/")
    return browser


def camera_of(package: Package, distance: float) -> np.ndarray:
    """Matrix of the README's camera: 30° high, in front of the patient, so many radii away."""
    grid = package.manifest.grid
    extent_xyz = np.array(grid.extent_mm_zyx[::-1])
    centre = grid.corner_mm_xyz + np.array(grid.direction) @ (extent_xyz / 2)
    away = distance * float(np.linalg.norm(extent_xyz)) / 2
    eye = centre - [0.0, away, 0.0]
    height = 2 * away * np.tan(np.radians(15))
    camera = Camera(tuple(eye.tolist()), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), height, away, "perspective")
    return camera.box_from_clip(grid, 1.0)


def reference(package: Package, matrix: np.ndarray) -> np.ndarray:
    with Renderer(package) as renderer:
        return renderer.render(matrix, (SIZE, SIZE))


def encoded(light: np.ndarray) -> np.ndarray:
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def _screenshots(page) -> Iterator[np.ndarray]:
    """What the canvas shows, as long as it may take a busy machine to draw it."""
    end = time.monotonic() + 20
    while time.monotonic() < end:
        yield np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))[:SIZE, :SIZE] / 255
        time.sleep(0.1)


LINES = re.findall(r"^```js\n(.*?)^```$", (JS / "README.md").read_text(), re.MULTILINE | re.DOTALL)


def test_the_lines_of_the_readme_show_the_volume(page, package) -> None:
    lines = next(each for each in LINES if "volpkg/three" in each)
    assert len([line for line in lines.splitlines() if line]) <= 10
    script = """
    window.innerWidth = window.innerHeight = 60;
    await import(URL.createObjectURL(new Blob([given[0]], { type: "text/javascript" })));
    """
    page.run(script, lines)
    picture = reference(package, camera_of(package, 4))
    assert picture[..., 3].max() > 0.5
    wanted = encoded(picture[..., :3])
    # The lines do not say when they have drawn.
    assert any(rmse(shown, wanted) < TWO_STEPS for shown in _screenshots(page))


BEGIN = """
const THREE = await import("three");
const { loadVolume } = await import("volpkg/three");
const canvas = document.createElement("canvas");
const renderer = new THREE.WebGLRenderer({ canvas, preserveDrawingBuffer: true, ...given[0] });
renderer.setSize(60, 60, false);
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(30, 1, 1, 5000);
const volume = await loadVolume(renderer, "head.volpkg");
await volume.renderer.ready;
scene.add(volume);
camera.position.z = 4 * volume.radius;
const packed = (list) => {
  const bytes = new Uint8Array(list.buffer);
  return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
};
const target = new THREE.WebGLRenderTarget(60, 60, { type: THREE.FloatType });
const linear = () => {
  renderer.setRenderTarget(target);
  renderer.clear();
  renderer.render(scene, camera);
  const pixels = new Float32Array(60 * 60 * 4);
  renderer.readRenderTargetPixels(target, 0, 0, 60, 60, pixels);
  renderer.setRenderTarget(null);
  return packed(pixels);
};
const shown = () => {
  renderer.render(scene, camera);
  const gl = renderer.getContext();
  const pixels = new Uint8Array(60 * 60 * 4);
  gl.readPixels(0, 0, 60, 60, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return packed(Float32Array.from(pixels, (each) => each / 255));
};
const plane = (z, colour) => {
  const material = new THREE.MeshBasicMaterial({ color: new THREE.Color(...colour) });
  const made = new THREE.Mesh(new THREE.PlaneGeometry(1000, 1000), material);
  made.position.z = z;
  scene.add(made);
  return made;
};
"""


def run(page, script: str, **settings: object) -> list[np.ndarray]:
    texts = page.run(BEGIN + script, settings)
    return [np.frombuffer(base64.b64decode(text), "<f4").reshape(SIZE, SIZE, 4)[::-1] for text in texts]


def test_a_render_target_gets_premultiplied_linear_light(page, package) -> None:
    (found,) = run(page, "renderer.setClearColor(0, 0); return [linear()];")
    picture = reference(package, camera_of(package, 4))
    assert rmse(found[..., :3], picture[..., :3]) < TWO_STEPS


@pytest.mark.long
@pytest.mark.parametrize("reversed_depth", [False, True])
def test_what_is_opaque_hides_what_is_behind_it_and_shows_through(page, package, reversed_depth) -> None:
    script = """
    const before = plane(2 * volume.radius, [0.1, 0.2, 0.3]);
    const hidden = linear();
    before.position.z = 0;
    const middle = linear();
    before.position.z = -2 * volume.radius;
    return [hidden, middle, linear()];
    """
    hidden, middle, behind = run(page, script, reversedDepthBuffer=reversed_depth)
    colour = np.array([0.1, 0.2, 0.3])
    assert np.abs(hidden[..., :3] - colour).max() < 2e-3
    matrix = camera_of(package, 4)
    whole = reference(package, matrix)
    assert rmse(behind[..., :3], whole[..., :3] + (1 - whole[..., 3:]) * colour) < TWO_STEPS
    # The far plane moved to the plane: depth is hyperbolic, so its clip coordinate is found by way of the box.
    grid = package.manifest.grid
    centre = np.append(np.array(grid.extent_mm_zyx[::-1]) / 2, 1.0)
    clip = np.linalg.inv(matrix) @ centre
    depth = clip[2] / clip[3]
    nearer = np.eye(4)
    nearer[2, 2:] = (depth + 1) / 2, (depth - 1) / 2
    half = reference(package, matrix @ nearer)
    assert rmse(half, whole) > TWO_STEPS
    assert rmse(middle[..., :3], half[..., :3] + (1 - half[..., 3:]) * colour) < TWO_STEPS


@pytest.mark.long
def test_the_canvas_gets_the_tone_mapping_and_the_colour_space_of_the_renderer(page, package) -> None:
    script = """
    const plain = shown();
    renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    const linearly = shown();
    renderer.toneMapping = THREE.ReinhardToneMapping;
    renderer.toneMappingExposure = 2;
    return [plain, linearly, shown()];
    """
    plain, linearly, mapped = run(page, script)
    picture = reference(package, camera_of(package, 4))[..., :3]
    assert rmse(plain[..., :3], encoded(picture)) < TWO_STEPS
    assert rmse(linearly[..., :3], picture) < TWO_STEPS
    assert rmse(mapped[..., :3], 2 * picture / (1 + 2 * picture)) < TWO_STEPS


@pytest.mark.long
def test_a_scene_around_it_is_drawn_as_without_it(page) -> None:
    script = """
    scene.remove(volume);
    const box = new THREE.Mesh(new THREE.TorusKnotGeometry(8, 3), new THREE.MeshNormalMaterial());
    const blue = new THREE.MeshBasicMaterial({ color: 0x4080c0, transparent: true, opacity: 0.4 });
    const glass = new THREE.Mesh(new THREE.SphereGeometry(14), blue);
    scene.add(box, glass);
    const alone = shown();
    scene.add(volume);
    volume.position.x = 1e4;
    shown();
    volume.position.x = 0;
    const together = shown();
    scene.remove(volume);
    const after = shown();
    volume.dispose();
    return [alone, together, after, shown()];
    """
    alone, together, after, disposed = run(page, script)
    assert alone.max() > 0.5
    assert rmse(alone, together) > TWO_STEPS
    assert np.array_equal(alone, after)
    assert np.array_equal(alone, disposed)
