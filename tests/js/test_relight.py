"""Light of an edited transfer function: a page computes ambient occlusion again, in short steps, and draws with it."""

import base64

import numpy as np
import pytest
from tiny_packages import function
from web_pictures import SIZE, box_from_clip_of, rmse

from volprep.truth.decoded import level_volume
from volprep.truth.path_traced import LitVolume, traced_picture
from volprep_formats.package.parts.light.model import LightModel

SWEEP = """
const { sweeps } = await import("/js/edit/sweep.js");
const [extinction, shape, cellMm, reachMm] = given;
let light;
for (light of sweeps(new Float32Array(extinction), shape, cellMm, reachMm ?? undefined));
return [...light];
"""
SCRIPT = """
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const pack = await openPackage(given[0]);
const gl = new OffscreenCanvas(given[2], given[2]).getContext(given[4]);
const renderer = await createRenderer(gl, pack, { relight: true });
await renderer.ready;
const baked = async () => {
  renderer.draw({ boxFromClip: given[1] });
  return (await renderer.fidelity()).light;
};
const lights = [await baked()];
const picture = () => {
  renderer.draw({ boxFromClip: given[1] });
  let text = "";
  for (const each of new Uint8Array(renderer.readPixels().pixels.buffer)) text += String.fromCharCode(each);
  return btoa(text);
};
// Each step begins in a task of its own, so that frames go on.
let steps = 0;
const later = globalThis.setTimeout;
globalThis.setTimeout = (work, ms, ...more) => later(work, ms, ...more, (steps += ms === undefined));
await renderer.setTransfer({ points: given[3] });
lights.push(await baked());
const unlit = picture();
await renderer.relit;
lights.push(await baked());
const lit = picture();
const said = (await renderer.fidelity()).differs;
globalThis.setTimeout = later;
await renderer.setTransfer(null);
lights.push(await baked());
return { lights, said, unlit, lit, error: gl.getError(), steps };
"""


def swept(browser, server, extinction: np.ndarray, cell_mm: float, reach_mm: float | None = None) -> np.ndarray:
    browser.open(f"{server.url}/")
    shape = list(extinction.shape[::-1])
    return np.reshape(browser.run(SWEEP, extinction.ravel().tolist(), shape, cell_mm, reach_mm), extinction.shape)


def test_sweeps_leave_the_light_that_matter_lets_through(browser, server) -> None:
    """A plate of one layer in empty space: above it half of the sky is behind it."""
    extinction = np.zeros((5, 21, 21))
    extinction[1] = 0.7
    light = swept(browser, server, extinction, 2.0)
    assert light[0, 0, 0] < 1.0
    # Of the 26 directions 9 pass the plate: along its normal, and askew to it along two and three axes.
    lengths = 2.0 * np.sqrt([1.0, 2.0, 3.0])
    behind = [1 / 21, 4 * 4 / 105, 4 * 9 / 280]
    expected = 1.0 - sum(weight * (1.0 - np.exp(-0.7 * mm)) for weight, mm in zip(behind, lengths, strict=True))
    assert light[3, 10, 10] == pytest.approx(expected, abs=1e-5)
    # In the middle of a cell half of its own matter counts: 18 directions leave the plate at once.
    leaving = [2 / 21, 8 * 4 / 105, 8 * 9 / 280]
    own = sum(weight * np.exp(-0.35 * mm) for weight, mm in zip(leaving, lengths, strict=True))
    assert light[1, 10, 10] == pytest.approx(own, abs=1e-4)
    assert swept(browser, server, extinction, 2.0, 2.0)[4, 10, 10] == pytest.approx(1.0, abs=1e-5)
    np.testing.assert_allclose(swept(browser, server, np.zeros((2, 3, 4)), 1.0), 1.0, atol=1e-5)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("editable, baked light", "webgl2"),
        ("editable, light in colour", "webgl2"),
        ("editable, light that turns", "webgl"),
    ],
)
def test_an_edited_function_is_drawn_with_occlusion_of_its_own(browser, server, scene_package, name, kind) -> None:
    package = scene_package(name)
    points = ((250.0, (1.0, 1.0, 1.0), 0.0), (400.0, (1.0, 1.0, 1.0), 0.6))
    edit = [{"value": v, "colour": c, "extinction_per_mm": e} for v, c, e in points]
    matrix = box_from_clip_of(package)[6]
    server.folders["package"] = package.path.parent
    browser.open(f"{server.url}/")
    found = browser.run(SCRIPT, f"/package/{package.path.name}", matrix.T.ravel().tolist(), SIZE, edit, kind)
    assert found["lights"] == ["whole", "edited", "occlusion", "whole"]
    assert "light: occlusion of the edited function, computed on this device" in found["said"]
    assert found["error"] == 0
    # Cells of 1.5 mm: 35 layers are read, and then 26 directions are swept.
    assert found["steps"] >= 35 + 26
    lit, unlit = (
        np.frombuffer(base64.b64decode(found[name]), "<f4").reshape(SIZE, SIZE, 4) for name in ("lit", "unlit")
    )
    volume = level_volume(package, 0)
    model = LightModel(kind="occlusion")
    scan = LitVolume(volume.stored, volume.grid, volume.slope, volume.intercept, function(*points), model)
    truth = traced_picture(scan, matrix, (SIZE, SIZE), 64)
    seen = truth.rgba[..., 3] > 0.5
    errors = [rmse(each[seen, :3], truth.rgba[seen, :3]) for each in (lit, unlit)]
    # 0.12 was measured. It was 0.31 with light sampled at the 6 x 9 x 12 texels, which lie outside of the blobs mostly;
    # with finer cells 0.32, and with texels at half of the resolution 0.11.
    assert errors[0] < 0.25 * errors[1], errors
