"""How much memory a page takes while a large texture comes: little more than the texture itself."""

import json
import threading
from pathlib import Path

import numpy as np
import psutil
import pytest
from browser import Browser
from tiny_packages import ES2, ES3, FOUR_CHANNELS, function, tiny_package
from web_server import WebServer

from volprep_formats.package.profile import DeviceProfile

JS = Path(__file__).parents[2] / "formats" / "js"
SIDE = 384
MOST = 1.2
"""Of JavaScript and of the GPU's process, for each byte of the texture."""
DRAW = """
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const gl = new OffscreenCanvas(16, 16).getContext(given[1]);
const renderer = (window.renderer = await createRenderer(gl, await openPackage(given[0])));
await renderer.ready;
renderer.draw({ boxFromClip: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] });
renderer.readPixels();
return renderer.textureBytes;
"""


PROFILES = {"webgl2": ES3, "webgl": ES2}


def sealed(folder: Path, codes: np.ndarray, profile: DeviceProfile) -> Path:
    """A package of one level, of which a page believes that it is sealed."""
    shell = function((20.0, (1, 0.2, 0.1), 0.0), (200.0, (1, 0.2, 0.1), 0.01))
    tiny_package(folder, codes, shell, profile, packing=FOUR_CHANNELS)
    manifest = folder / "manifest.json"
    record = json.loads(manifest.read_text())
    manifest.write_text(json.dumps(record | {"state": "sealed", "stages": []}))
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("large")
    codes = (np.indices((SIDE, 1, SIDE), np.uint16).sum(0) % 200).astype(np.uint8)
    whole = np.ascontiguousarray(np.broadcast_to(codes, (SIDE, SIDE, SIDE)))
    for kind, profile in PROFILES.items():
        sealed(folder / f"{kind}-small.volpkg", np.ascontiguousarray(codes[:8, :, :8]), profile)
        sealed(folder / f"{kind}-large.volpkg", whole, profile)
    return folder


def gpu_bytes(processes: list[psutil.Process]) -> int:
    """Memory of the browser's process that draws, shared pages in part."""
    found = [each for each in processes if "--type=gpu-process" in each.cmdline()]
    assert len(found) == 1
    return found[0].memory_full_info().pss


@pytest.mark.long
@pytest.mark.parametrize("kind", PROFILES)
def test_the_peak_is_a_fifth_above_the_texture_at_most(browser, folder, kind) -> None:
    # What the browser does beside only adds to it: one of three is enough.
    assert any(peak_share(browser, folder, kind) < MOST for _ in range(3))


def peak_share(browser: Browser, folder: Path, kind: str) -> float:
    """Memory that a large texture takes while it comes, in its own bytes."""

    def heap() -> int:
        browser.send("HeapProfiler.collectGarbage")
        used = browser.send("Runtime.getHeapUsage")
        return used["usedSize"] + used["backingStorageSize"]

    with WebServer({"js": JS, "package": folder}) as server:
        browser.open(f"{server.url}/")
        browser.run(DRAW, f"/package/{kind}-small.volpkg", kind)
        processes = psutil.Process(browser.process_id).children(recursive=True)
        before, gpu_before = heap(), gpu_bytes(processes)
        peak, ended = [gpu_before], threading.Event()

        def watch() -> None:
            while not ended.wait(0.01):
                peak[0] = max(peak[0], gpu_bytes(processes))

        thread = threading.Thread(target=watch)
        thread.start()
        try:
            texture = browser.run(DRAW, f"/package/{kind}-large.volpkg", kind, timeout=240.0)
        finally:
            ended.set()
            thread.join()
        after = heap()
        last = gpu_bytes(processes)
        browser.run("window.renderer.dispose(); return 0")
    assert texture > SIDE**3
    return float((max(peak[0], last) - gpu_before + after - before) / texture)


@pytest.mark.long
def test_no_more_than_a_slab_is_on_its_way(browser, folder) -> None:
    script = """
    const { openPackage, createRenderer } = await import("/js/volpkg.js");
    const gl = new OffscreenCanvas(16, 16).getContext("webgl2");
    const real = { image: gl.texSubImage3D.bind(gl), status: gl.getSyncParameter.bind(gl) };
    const made = gl.texImage3D.bind(gl);
    let [waiting, most, sent, mutable] = [0, 0, 0, 0];
    gl.texImage3D = (...all) => {
      mutable = Math.max(mutable, all[3] * all[4] * all[5]);
      made(...all);
    };
    gl.texSubImage3D = (...all) => {
      waiting += all.at(-1).byteLength;
      sent += all.at(-1).byteLength;
      most = Math.max(most, waiting);
      real.image(...all);
    };
    gl.getSyncParameter = (sync, name) => {
      const found = real.status(sync, name);
      if (found === gl.SIGNALED) waiting = 0;
      return found;
    };
    const renderer = await createRenderer(gl, await openPackage(given[0]));
    await renderer.ready;
    renderer.dispose();
    return { most, sent, mutable };
    """
    with WebServer({"js": JS, "package": folder}) as server:
        browser.open(f"{server.url}/")
        found = browser.run(script, "/package/webgl2-large.volpkg", timeout=240.0)
    assert found["sent"] >= SIDE**3
    assert found["most"] <= 1 << 20
    # What is probed is small; the volume has a size that does not change.
    assert found["mutable"] <= 4 * SIDE


@pytest.mark.long
def test_a_texture_whose_size_may_change_is_drawn_after_each_slab(browser, folder) -> None:
    script = """
    const { openPackage, createRenderer } = await import("/js/volpkg.js");
    const gl = new OffscreenCanvas(16, 16).getContext("webgl");
    const real = { image: gl.texSubImage2D.bind(gl), draw: gl.drawArrays.bind(gl), read: gl.readPixels.bind(gl) };
    let [waiting, most, sent, drawn] = [0, 0, 0, false];
    gl.texSubImage2D = (...all) => {
      waiting += all.at(-1).byteLength;
      sent += all.at(-1).byteLength;
      most = Math.max(most, waiting);
      drawn = false;
      real.image(...all);
    };
    gl.drawArrays = (...all) => {
      drawn = true;
      real.draw(...all);
    };
    gl.readPixels = (...all) => {
      if (drawn) waiting = 0;
      real.read(...all);
    };
    const renderer = await createRenderer(gl, await openPackage(given[0]));
    await renderer.ready;
    renderer.dispose();
    return { most, sent, error: gl.getError() };
    """
    with WebServer({"js": JS, "package": folder}) as server:
        browser.open(f"{server.url}/")
        found = browser.run(script, "/package/webgl-large.volpkg", timeout=240.0)
    assert found["sent"] >= SIDE**3
    # A slab, and a little that is not worth drawing.
    assert found["most"] <= (1 << 20) + 8192
    assert found["error"] == 0
