"""The custom element, which pages are made of, shows slow pictures part by part, and no frame is worse than before."""

import base64
from itertools import pairwise

import numpy as np
import pytest

from volprep.truth.metrics import picture_error

SCRIPT = """
const [path, kind, side, frameMs, turn] = given;
document.body.innerHTML = "";
await import("/js/element.js");
const one = document.createElement("volume-viewer");
one.style.cssText = `display: block; width: ${side}px; height: ${side}px`;
one.options = { frameMs };
document.body.append(one);
const failed = new Promise((_, reject) => one.addEventListener("error", ({ detail }) => reject(detail)));
const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
await Promise.race([failed, (async () => {
  one.open(path);
  while (!one.renderer) await wait(5);
})()]);
const frames = [], levels = [];
const read = () => {
  const { width, pixels } = renderer.readPixels();
  const bytes = new Uint8Array(pixels.buffer);
  let text = "";
  for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));
  return [width, btoa(text)];
};
const { stage, renderer } = one;
let at = 0, isWatched = !turn;
const present = renderer.present.bind(renderer);
renderer.present = (how) => {
  present(how);
  at = performance.now();
  if (renderer.moving || !isWatched) return;
  frames.push(read());
  levels.push(renderer.level);
};
const rest = async () => {
  while (!at || performance.now() - at < 1000) await wait(20);
};
await renderer.ready;
if (turn) {
  for (let n = 0; n < 3 || !renderer.slow; n++) {
    stage.orbit.turn(0.3, 0.1);
    stage.moving();
    await wait(30);
  }
  isWatched = true;
}
await rest();
const count = frames.length;
stage.redraw();
await wait(200);
const again = frames.length;
stage.draw();
const whole = read();
const finished = renderer.inside.last.quality;
const error = stage.gl.getError();
one.remove();
return { count, again, frames: frames.slice(0, count), levels, whole, finished, error };
"""


def _pixels(shown) -> np.ndarray:
    width, text = shown
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(-1, width, 4)


def _shown(browser, server, package, *, side: int, frame_ms: float, turn: bool):
    server.folders["package"] = package.path.parent
    browser.open(f"{server.url}/")
    return browser.run(SCRIPT, f"/package/{package.path.name}", "", side, frame_ms, turn)


def check_better_and_better(said) -> None:
    whole = _pixels(said["whole"])
    assert said["error"] == 0
    assert said["finished"] == {"step": 1, "scale": 1}
    frames = [_pixels(each) for each in said["frames"] if each[0] == whole.shape[1]]
    assert whole[..., 3].max() > 0.3
    assert np.array_equal(frames[-1], whole)
    errors = [picture_error(each, whole.astype(np.float64)) for each in frames]
    for worse, better in pairwise(errors):
        assert better.rmse <= worse.rmse
        assert better.ssim_black >= worse.ssim_black


@pytest.mark.long
@pytest.mark.parametrize("name", ["slabs", "two passes"])
def test_a_picture_at_rest_comes_part_by_part_after_the_camera_moved(browser, server, scene_package, name) -> None:
    said = _shown(browser, server, scene_package(name), side=96, frame_ms=0.001, turn=True)
    # A coarse picture and nine parts, one in each frame; then a picture that is finished is only shown again.
    assert said["count"] >= 10
    assert said["again"] == said["count"] + 1
    check_better_and_better(said)


@pytest.mark.long
def test_slabs_come_part_by_part_from_the_first_picture_on_and_from_level_to_level(
    browser, server, scene_package
) -> None:
    said = _shown(browser, server, scene_package("slabs"), side=96, frame_ms=0.001, turn=False)
    assert said["count"] > 5
    assert said["levels"] == sorted(said["levels"], reverse=True)
    check_better_and_better(said)


@pytest.mark.long
def test_a_picture_that_is_fast_comes_at_once(browser, server, scene_package) -> None:
    said = _shown(browser, server, scene_package("two passes"), side=96, frame_ms=60000, turn=False)
    assert said["count"] <= 4
    check_better_and_better(said)
