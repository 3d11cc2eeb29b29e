"""A page finishes slow pictures part by part, and no frame is worse than the one before it."""

import base64
from itertools import pairwise

import numpy as np
import pytest
from web_pictures import box_from_clip_of

from volprep.truth.metrics import picture_error

SIDE = 96
SCRIPT = """
const [path, matrix, side, budget] = given;
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const gl = new OffscreenCanvas(side, side).getContext("webgl2");
const pack = await openPackage(path);
const renderer = await createRenderer(gl, pack, { frameMs: 0.001, level: 0 });
await renderer.ready;
const read = () => {
  const { pixels } = renderer.readPixels();
  const bytes = new Uint8Array(pixels.buffer);
  let text = "";
  for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));
  return btoa(text);
};
renderer.interacting(true);
for (let n = 0; n < 100 && !renderer.slow; n++) {
  renderer.draw({ boxFromClip: matrix });
  await new Promise((resolve) => setTimeout(resolve, 50));
}
renderer.interacting(false);
const slow = renderer.slow;
const finishing = await renderer.finishing({ boxFromClip: matrix, width: side, height: side, budgetMs: budget });
const frames = [], shares = [];
do {
  shares.push(finishing.step());
  frames.push(read());
} while (shares[shares.length - 1] < 1);
renderer.draw({ boxFromClip: matrix });
const whole = read(), error = gl.getError();
renderer.dispose();
pack.close?.();
return { slow, frames, shares, whole, error };
"""


def _pixels(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(SIDE, SIDE, 4)


@pytest.mark.long
@pytest.mark.parametrize("name", ["lit, skips by distance", "meshes", "slabs", "two passes", "slices across the view"])
def test_no_frame_is_worse_than_the_one_before_it(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    server.folders["package"] = package.path.parent
    browser.open(f"{server.url}/")
    matrix = box_from_clip_of(package)[6].T.ravel().tolist()
    said = browser.run(SCRIPT, f"/package/{package.path.name}", matrix, SIDE, 0)
    assert said["slow"]
    assert said["error"] == 0
    # Nothing fits into a budget of 0: one tile in each step, after the coarse picture.
    assert said["shares"][0] == 0.0
    assert len(said["shares"]) == 1 + 9
    whole = _pixels(said["whole"])
    frames = [_pixels(each) for each in said["frames"]]
    assert whole[..., 3].max() > 0.3
    assert np.abs(frames[0] - whole).max() > 0.02
    assert np.array_equal(frames[-1], whole)
    errors = [picture_error(each, whole.astype(np.float64)) for each in frames]
    for worse, better in pairwise(errors):
        assert better.rmse <= worse.rmse
        assert better.ssim_black >= worse.ssim_black
    assert errors[-1].ssim_black > 0.999


@pytest.mark.long
def test_a_large_budget_finishes_the_picture_in_few_frames(browser, server, scene_package) -> None:
    package = scene_package("slabs")
    server.folders["package"] = package.path.parent
    browser.open(f"{server.url}/")
    matrix = box_from_clip_of(package)[6].T.ravel().tolist()
    said = browser.run(SCRIPT, f"/package/{package.path.name}", matrix, SIDE, 60000)
    # The first tile alone is measured; then at most twice as many as are drawn.
    assert len(said["shares"]) <= 5
