"""A volume in scenes of three.js: light is mixed as light, whatever is behind it and whatever is drawn into."""

import base64
import io
from typing import Any

import numpy as np
import pytest
from npm_package import npm_package
from PIL import Image
from web_pictures import TWO_STEPS, rmse

from volprep_formats.package.reader import Package

SIZE = 40
STEP = 1 / 255

BEGIN = """
const THREE = await import("three");
const { loadVolume } = await import("volpkg/three");
window.THREE = THREE;
window.begin = async (settings = {}, size = 40) => {
  const canvas = document.createElement("canvas");
  const renderer = new THREE.WebGLRenderer({ canvas, preserveDrawingBuffer: true, ...settings });
  renderer.setSize(size, size, false);
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(30, 1, 1, 5000);
  const volume = await loadVolume(renderer, "head.volpkg", { frameMs: Infinity });
  await volume.renderer.ready;
  scene.add(volume);
  camera.position.z = 2.5 * volume.radius;
  camera.updateMatrixWorld();
  const packed = (list) => {
    const bytes = new Uint8Array(list.buffer);
    return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  };
  const gl = renderer.getContext();
  const raw = (scene_ = scene, camera_ = camera) => {
    renderer.setRenderTarget(null);
    renderer.render(scene_, camera_);
    const pixels = new Uint8Array(size * size * 4);
    gl.readPixels(0, 0, size, size, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  };
  const shown = (...all) => packed(raw(...all));
  const plane = (z, colour, more = {}) => {
    const material = new THREE.MeshBasicMaterial({ color: new THREE.Color(...colour), ...more });
    const made = new THREE.Mesh(new THREE.PlaneGeometry(1000, 1000), material);
    made.position.z = z;
    scene.add(made);
    return made;
  };
  const without = (make) => {
    scene.remove(volume);
    const found = make();
    scene.add(volume);
    return found;
  };
  // The largest difference of two lists of bytes, in steps of 255.
  const apart = (one, other) => one.reduce((most, each, i) => Math.max(most, Math.abs(each - other[i])), 0);
  return { canvas, renderer, scene, camera, volume, packed, gl, raw, shown, plane, without, apart };
};
"""


@pytest.fixture(scope="module")
def package(scene_package) -> Package:
    return scene_package("lit, skips by distance")


@pytest.fixture(scope="module")
def page(browser, server, package):
    """A page with three.js that draws the package; many scenes share it."""
    server.folders["three"] = npm_package("three", "0.187.0") / "node_modules" / "three"
    server.folders["head.volpkg"] = package.path
    browser.open(f"{server.url}/")
    browser.run(BEGIN)
    return browser


@pytest.fixture(scope="module")
def picture(page) -> np.ndarray:
    """The volume alone, in a target of floats: premultiplied linear RGBA."""
    script = """
    const { renderer, scene, camera, packed } = await begin();
    const target = new THREE.WebGLRenderTarget(40, 40, { type: THREE.FloatType });
    renderer.setClearColor(0, 0);
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    const found = new Float32Array(40 * 40 * 4);
    renderer.readRenderTargetPixels(target, 0, 0, 40, 40, found);
    return packed(found);
    """
    return np.frombuffer(base64.b64decode(page.run(script)), "<f4").reshape(SIZE, SIZE, 4)[::-1]


def pixels(text: str) -> np.ndarray:
    """[H, W, 4] of 0 to 1, row 0 on top."""
    return np.frombuffer(base64.b64decode(text), np.uint8).reshape(SIZE, SIZE, 4)[::-1] / 255


def linear(encoded: np.ndarray) -> np.ndarray:
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def encoded(light: np.ndarray) -> np.ndarray:
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def over(picture: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """What is shown of the picture in front of encoded colours."""
    return encoded(picture[..., :3] + (1 - picture[..., 3:]) * linear(behind))


SCENES = """
const { renderer, scene, camera, volume, shown, plane, without, packed } = await begin();
const noise = Uint8Array.from({ length: 40 * 40 * 4 }, (_, i) => (i % 4 === 3 ? 255 : (i * 7919) % 256));
const photograph = new THREE.DataTexture(noise, 40, 40);
photograph.colorSpace = THREE.SRGBColorSpace;
photograph.needsUpdate = true;
const found = {};
const both = (name) => (found[name] = [shown(), without(shown)]);
for (const [name, background] of Object.entries({
  black: new THREE.Color(0), grey: new THREE.Color(0.2, 0.2, 0.2), white: new THREE.Color(1, 1, 1), photograph,
})) {
  scene.background = background;
  both(name);
}
const glass = plane(-2 * volume.radius, [1, 0.3, 0.1], { transparent: true, opacity: 0.5 });
both("glass");
return found;
"""


def test_light_is_mixed_as_light_on_every_background(page, picture) -> None:
    found = page.run(SCENES)
    assert set(found) == {"black", "grey", "white", "photograph", "glass"}
    assert 0.1 < picture[..., 3].mean() < 0.9
    for name, (with_volume, without) in found.items():
        wanted = over(picture, pixels(without)[..., :3])
        assert np.abs(pixels(with_volume)[..., :3] - wanted).max() < 1.5 * STEP, name
    # What was blended after it was encoded is elsewhere.
    naive = pixels(found["grey"][1])[..., :3] * (1 - picture[..., 3:]) + encoded(picture[..., :3])
    assert rmse(naive, over(picture, pixels(found["grey"][1])[..., :3])) > 5 * STEP


def test_volumes_before_each_other_are_mixed_in_their_order(page) -> None:
    script = """
    const { renderer, scene, camera, volume, shown, packed } = await begin();
    const other = volume.clone();
    other.rotation.z = 1;
    scene.add(other);
    const target = new THREE.WebGLRenderTarget(40, 40, { type: THREE.FloatType });
    const alone = (each) => {
      for (const one of [volume, other]) one.visible = one === each;
      renderer.setClearColor(0, 0);
      renderer.setRenderTarget(target);
      renderer.render(scene, camera);
      const found = new Float32Array(40 * 40 * 4);
      renderer.readRenderTargetPixels(target, 0, 0, 40, 40, found);
      renderer.setRenderTarget(null);
      return packed(found);
    };
    const found = [alone(volume), alone(other)];
    volume.visible = other.visible = true;
    scene.background = new THREE.Color(0.2, 0.2, 0.2);
    for (const order of [1, -1]) {
      other.renderOrder = order;
      found.push(shown());
    }
    return found;
    """
    *alone, before, behind = page.run(script)
    one, other = (np.frombuffer(base64.b64decode(text), "<f4").reshape(SIZE, SIZE, 4)[::-1] for text in alone)
    grey = np.full(3, 0.2)
    for text, (back, front) in ((before, (one, other)), (behind, (other, one))):
        light = back[..., :3] + (1 - back[..., 3:]) * grey
        wanted = encoded(front[..., :3] + (1 - front[..., 3:]) * light)
        assert np.abs(pixels(text)[..., :3] - wanted).max() < 2.5 * STEP
    assert np.abs(pixels(before) - pixels(behind)).max() > 20 * STEP


@pytest.mark.long
def test_the_canvas_shows_what_effect_composer_shows(page) -> None:
    script = """
    const { EffectComposer } = await import("three/addons/postprocessing/EffectComposer.js");
    const { RenderPass } = await import("three/addons/postprocessing/RenderPass.js");
    const { OutputPass } = await import("three/addons/postprocessing/OutputPass.js");
    const { renderer, scene, camera, volume, raw, plane, apart, gl } = await begin();
    plane(-2 * volume.radius, [0.9, 0.5, 0.2]);
    const bright = plane(-1.9 * volume.radius, [6, 5, 4]);
    bright.scale.set(0.005, 1, 1);
    const composer = new EffectComposer(renderer);
    composer.setSize(40, 40);
    composer.addPass(new RenderPass(scene, camera));
    composer.addPass(new OutputPass());
    const most = {};
    for (const name of ["No", "Linear", "Reinhard", "Cineon", "ACESFilmic", "AgX", "Neutral"]) {
      renderer.toneMapping = THREE[`${name}ToneMapping`];
      composer.render();
      const composed = new Uint8Array(40 * 40 * 4);
      gl.readPixels(0, 0, 40, 40, gl.RGBA, gl.UNSIGNED_BYTE, composed);
      most[name] = apart(raw(), composed);
    }
    return most;
    """
    most = page.run(script)
    assert len(most) == 7
    assert max(most.values()) <= 3, most


@pytest.mark.long
def test_a_transparent_canvas_is_mixed_with_the_colour_of_its_page(page, picture) -> None:
    script = """
    const { canvas, renderer, camera, scene } = await begin({ alpha: true, antialias: true });
    renderer.toneMapping = given[1];
    document.body.style.background = given[0];
    document.body.replaceChildren(canvas);
    canvas.style.display = "block";
    renderer.render(scene, camera);
    await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
    """
    for colour in ("#808080", "white"):
        page.run(script, colour, 0)
        shown = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))[:SIZE, :SIZE] / 255
        page_colour = np.full(3, 1.0 if colour == "white" else 128 / 255)
        assert np.abs(shown - over(picture, page_colour)).max() < 2.5 * STEP
    # React Three Fiber's default is ACES; where nothing of the volume is, the page keeps its colour.
    page.run(script, "#808080", 4)
    shown = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))[:SIZE, :SIZE] / 255
    assert np.abs(shown[picture[..., 3] == 0] - 128 / 255).max() < 1.5 * STEP
    page.run('document.body.style.background = "black"; document.body.replaceChildren();')


NINE = """
const nine = (volume, look) => {
  const found = [];
  for (let n = 0; n < 9; n++) found.push(look(0.7 * n, Math.sin(n)));
  return found;
};
const aim = (camera, volume, angle, height, distance = 4) => {
  camera.position.set(Math.sin(angle), height, Math.cos(angle)).normalize().multiplyScalar(distance * volume.radius);
  camera.lookAt(0, 0, 0);
  camera.updateMatrixWorld();
};
"""


@pytest.mark.long
def test_every_kind_of_depth_gives_the_same_picture_in_nine_views(page) -> None:
    script = (
        NINE
        + """
    const found = {};
    let wanted;
    for (const [name, settings] of Object.entries({
      plain: {}, logarithmic: { logarithmicDepthBuffer: true }, reversed: { reversedDepthBuffer: true },
    })) {
      const { renderer, scene, camera, volume, raw, plane, apart } = await begin(settings);
      const wall = plane(0, [0.1, 0.2, 0.3], { side: THREE.DoubleSide });
      const veil = new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.9 });
      const after = new THREE.Mesh(new THREE.SphereGeometry(0.3 * volume.radius), veil);
      after.position.set(0, 0, 2 * volume.radius);
      scene.add(after);
      const views = nine(volume, (angle, height) => (aim(camera, volume, angle, height), raw()));
      wanted ??= views;
      found[name] = Math.max(...views.map((each, i) => apart(each, wanted[i])));
      // A camera for a whole landscape.
      camera.near = 1e-2 * volume.radius;
      camera.far = camera.near * 1e8;
      camera.updateProjectionMatrix();
      const far = nine(volume, (angle, height) => (aim(camera, volume, angle, height), raw()));
      // 24 bits of plain depth are one part in 1e5 there.
      const wrong = (each, i) => each.filter((one, n) => Math.abs(one - wanted[i][n]) > 6).length / each.length;
      found[`${name}, far`] = far.map(wrong);
      renderer.dispose();
    }
    return found;
    """
    )
    found = page.run(script)
    assert found["plain"] == 0
    assert found["logarithmic"] <= 3
    assert found["reversed"] <= 3
    for name in ("plain, far", "logarithmic, far", "reversed, far"):
        assert max(found[name]) < 0.02, (name, found[name])


def test_a_clip_keeps_what_is_opaque_in_front(page) -> None:
    script = (
        NINE
        + """
    const { scene, camera, volume, raw, plane, apart } = await begin();
    plane(0, [0.1, 0.2, 0.3], { side: THREE.DoubleSide });
    const look = () => nine(volume, (angle, height) => (aim(camera, volume, angle, height), raw()));
    const before = look();
    const extent = [...volume.renderer.grid.extent_mm_zyx].reverse();
    await volume.renderer.setClip({ box: [[0, 0, 0], extent] });
    const boxed = look();
    await volume.renderer.setClip(null);
    const open = look();
    const most = (views) => Math.max(...views.map((each, i) => apart(each, before[i])));
    return [most(boxed), most(open)];
    """
    )
    boxed, opened = page.run(script)
    assert boxed <= 1
    assert opened == 0


def test_views_of_an_array_camera_are_those_of_their_own(page) -> None:
    script = """
    const { renderer, scene, camera, volume, raw, plane, apart } = await begin();
    plane(0, [0.1, 0.2, 0.3], { side: THREE.DoubleSide });
    const eyes = [-0.3, 0.3].map((x) => {
      const eye = new THREE.PerspectiveCamera(30, 0.5, 1, 5000);
      eye.position.set(x * volume.radius, 0, 4 * volume.radius);
      eye.updateMatrixWorld();
      return eye;
    });
    const both = new THREE.ArrayCamera(eyes);
    both.position.z = 4 * volume.radius;
    both.projectionMatrix.copy(camera.projectionMatrix);
    both.updateMatrixWorld();
    const veil = new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.5 });
    const last = new THREE.Mesh(new THREE.PlaneGeometry(9, 9), veil);
    last.position.z = volume.radius;
    scene.add(last);
    const found = [];
    for (let view = 0; view < 9; view++) {
      volume.rotation.set(Math.sin(view), 0.7 * view, 0);
      eyes.forEach((eye, i) => (eye.viewport = new THREE.Vector4(20 * i, 0, 20, 40)));
      renderer.setViewport(0, 0, 40, 40);
      const together = raw(scene, both);
      const alone = new Uint8Array(together.length);
      eyes.forEach((eye, i) => {
        eye.viewport = undefined;
        renderer.setViewport(20 * i, 0, 20, 40);
        const half = raw(scene, eye);
        for (let n = 0; n < half.length; n++) if (Math.floor(((n / 4) % 40) / 20) === i) alone[n] = half[n];
      });
      found.push([apart(together, alone), new Set(alone).size]);
    }
    return found;
    """
    found = page.run(script)
    assert len(found) == 9
    for most, colours in found:
        assert colours > 20
        assert most <= 1


def test_a_canvas_without_pixels_is_no_error(page) -> None:
    script = """
    const { renderer, raw, apart } = await begin();
    const before = raw();
    renderer.setSize(0, 0, false);
    raw();
    renderer.setSize(40, 40, false);
    return apart(raw(), before);
    """
    assert page.run(script) == 0


def test_what_three_can_ask_of_an_object_is_followed_or_noted_once(page) -> None:
    script = """
    const { renderer, scene, camera, volume, raw, plane, without, apart } = await begin();
    const found = {};
    const empty = without(raw);
    const whole = raw();
    found.drawn = apart(whole, empty);
    volume.layers.set(3);
    found.layers = apart(raw(), empty);
    volume.layers.set(0);
    volume.material.opacity = 0;
    found.opacity = apart(raw(), empty);
    volume.material.opacity = 1;
    // Cut by planes of three.js, in the world, as by those of the volume itself, in box millimetres.
    const extent = [...volume.renderer.grid.extent_mm_zyx].reverse();
    const up = volume.renderer.grid.direction[2][2];
    await volume.renderer.setClip({ planes: [[0, 0, up, -0.5 * up * extent[2]]] });
    const cut = raw();
    await volume.renderer.setClip(null);
    found.cut = apart(cut, whole);
    const half = new THREE.Plane(new THREE.Vector3(0, 1, 0), 0);
    for (const kind of ["global", "local"]) {
      renderer.clippingPlanes = kind === "global" ? [half] : [];
      renderer.localClippingEnabled = true;
      volume.material.clippingPlanes = kind === "local" ? [half] : null;
      raw();
      await new Promise((resolve) => setTimeout(resolve, 50));
      while (volume.renderer.inside.drawn.clip.key[0] === "0") await new Promise((resolve) => setTimeout(resolve, 20));
      found[kind] = apart(raw(), cut);
    }
    volume.material.clippingPlanes = null;
    const all = apart(raw(), whole);
    scene.fog = new THREE.Fog(0xffffff, 1, 2);
    scene.background = new THREE.Color(1, 1, 1);
    found.fog = Math.min(...raw());
    scene.fog = null;
    scene.background = null;
    // A clone beside it is the same picture, moved.
    const other = volume.clone();
    volume.position.x = -1e4;
    scene.add(other);
    const copied = apart(raw(), whole);
    volume.material.clipIntersection = true;
    volume.material.clippingPlanes = [half, half];
    other.visible = false;
    volume.position.x = 0;
    raw();
    raw();
    found.notes = volume.notes.length;
    other.dispose();
    volume.material.clippingPlanes = null;
    return { ...found, all, copied };
    """
    found = page.run(script)
    assert found.pop("drawn") > 100
    assert found.pop("cut") > 100
    assert found.pop("notes") == 1
    assert found.pop("fog") == 255
    assert found.pop("local") <= 1
    assert found.pop("global") <= 1
    assert set(found) == {"layers", "opacity", "all", "copied"}
    assert max(found.values()) <= 1, found


def test_only_what_changed_is_drawn(page) -> None:
    script = """
    const { renderer, scene, camera, volume, raw, plane, gl } = await begin();
    plane(-2 * volume.radius, [0.5, 0.5, 0.5]);
    const others = [volume.clone(), volume.clone()];
    others[0].position.x = 0.3 * volume.radius;
    others[1].position.x = -0.3 * volume.radius;
    others.forEach((each, i) => (each.renderOrder = 4 + i));
    scene.add(...others);
    const counts = { scene: 0, volume: 0 };
    const render = renderer.render.bind(renderer);
    renderer.render = (...all) => (counts.scene++, render(...all));
    const draw = volume.renderer.draw.bind(volume.renderer);
    volume.renderer.draw = (...all) => (counts.volume++, draw(...all));
    const frame = () => {
      counts.scene = counts.volume = 0;
      raw();
      return [counts.scene, counts.volume];
    };
    const found = { first: frame(), still: frame() };
    camera.position.x += 1;
    found.moved = frame();
    others[0].position.x += 1;
    found.one = frame();
    volume.renderer.setStep(2 * volume.renderer.step);
    found.step = frame();
    volume.renderer.setStep();
    camera.position.x += 1;
    frame();
    // An app that draws on demand is told when to draw again.
    const changed = (each) => new Promise((resolve) => each.addEventListener("change", resolve));
    await Promise.all([volume, ...others].map(changed));
    return found;
    """
    found = page.run(script)
    assert found == {"first": [2, 3], "still": [1, 0], "moved": [2, 3], "one": [1, 1], "step": [1, 3]}


@pytest.mark.long
def test_motion_is_drawn_coarser_and_then_in_full(page) -> None:
    script = """
    const { loadVolume } = await import("volpkg/three");
    const { renderer, scene, camera, raw, apart } = await begin();
    const volume = await loadVolume(renderer, "head.volpkg", { frameMs: 0.001 });
    await volume.renderer.ready;
    scene.clear();
    scene.add(volume);
    const full = raw();
    const widths = [];
    for (let i = 0; i < 12; i++) {
      camera.position.x = i % 2;
      camera.updateMatrixWorld();
      raw();
      widths.push(volume.renderer.inside.last.quality.scale);
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
    camera.position.x = 0;
    camera.updateMatrixWorld();
    const coarse = apart(raw(), full);
    await new Promise((resolve) => volume.addEventListener("change", resolve));
    return { least: Math.min(...widths), coarse, after: apart(raw(), full) };
    """
    found: dict[str, Any] = page.run(script)
    assert found["least"] < 0.5
    assert found["coarse"] > TWO_STEPS * 255
    assert found["after"] == 0


def test_a_raycaster_hits_what_is_seen(page) -> None:
    script = """
    const { camera, volume, raw } = await begin();
    raw();
    const cast = () => {
      const raycaster = new THREE.Raycaster();
      raycaster.setFromCamera(new THREE.Vector2(0.025, -0.025), camera);
      return raycaster.intersectObject(volume)[0];
    };
    const hit = cast();
    const picked = await volume.renderer.pick(20.5, 20.5);
    const ray = hit.point.clone().sub(camera.position);
    volume.scale.setScalar(0.5);
    volume.position.set(1, 2, 3);
    volume.updateMatrixWorld();
    const small = cast();
    const place = small && volume.worldToLocal(small.point.clone());
    volume.layers.set(5);
    return {
      distance: Math.abs(hit.distance - ray.length()),
      same: Math.hypot(...hit.position_mm.map((each, i) => each - picked.position_mm[i])) / picked.uncertainty_mm,
      value: hit.value - picked.value,
      facing: hit.normal.dot(ray.applyQuaternion(volume.quaternion.clone().invert())),
      inside: place.length() < volume.radius,
      unseen: cast() === undefined,
    };
    """
    found = page.run(script)
    assert found.pop("distance") < 1e-3
    assert found.pop("same") < 0.1
    assert abs(found.pop("value")) < 1.0
    assert found.pop("facing") < 0
    assert found == {"inside": True, "unseen": True}


def test_volumes_that_overlap_say_so(page) -> None:
    script = """
    const { scene, volume, raw } = await begin();
    const other = volume.clone();
    const size = volume.renderer.grid.extent_mm_zyx[2];
    scene.add(other);
    const notes = [];
    for (const share of [1.001, 0.9]) {
      other.position.x = share * size;
      scene.updateMatrixWorld();
      raw();
      notes.push([...volume.notes, ...other.notes].filter((each) => each.includes("overlap")).length);
    }
    other.dispose();
    return notes;
    """
    assert page.run(script) == [0, 2]


SCRIPT_LOST = """
const { canvas, renderer, volume, plane, gl, raw, apart } = await begin();
const warned = [];
const warn = console.warn;
console.warn = (...words) => warned.push(words.join(" "));
plane(0, [0.2, 0.4, 0.6]);
plane(-2 * volume.radius, [0.6, 0.1, 0.1], { transparent: true });
const before = raw();
const event = (name) => new Promise((resolve) => canvas.addEventListener(name, resolve, { once: true }));
const loses = gl.getExtension("WEBGL_lose_context");
const [lost, restored] = [event("webglcontextlost"), event("webglcontextrestored")];
loses.loseContext();
await lost;
await new Promise((resolve) => setTimeout(resolve, 10));
const changed = new Promise((resolve) => volume.addEventListener("change", resolve));
loses.restoreContext();
await restored;
await changed;
await volume.renderer.ready;
const after = raw();
console.warn = warn;
const errors = gl.getError();
volume.dispose();
renderer.dispose();
return { off: apart(before, after), seen: Math.max(...before), errors, warned };
"""


def test_a_context_that_was_lost_comes_back_with_what_is_behind_the_volume(page) -> None:
    found = page.run(SCRIPT_LOST)
    assert found == {"off": 0, "seen": 255, "errors": 0, "warned": []}


SCRIPT_GIVEN = """
const { openPackage } = await import("volpkg");
const { loadVolume } = await import("volpkg/three");
const { renderer, volume } = await begin();
const refused = async (given) => loadVolume(given, "head.volpkg").catch(({ code, message }) => [code, message]);
const other = await loadVolume(renderer, await openPackage("head.volpkg"));
const same = other.radius === volume.radius && other.renderer.level >= 0;
const found = [same, ...(await Promise.all([null, document.createElement("canvas")].map(refused)))];
for (const each of [volume, other, renderer]) each.dispose();
return found;
"""


def test_an_open_package_is_drawn_and_other_renderers_are_refused(page) -> None:
    same, *refused = page.run(SCRIPT_GIVEN)
    assert same
    assert [code for code, _ in refused] == ["VP7018", "VP7018"]
    assert all("loadVolume needs a THREE.WebGLRenderer" in message for _, message in refused)
