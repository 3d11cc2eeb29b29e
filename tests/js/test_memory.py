"""How much memory a page takes while a large texture comes: little more than the texture itself."""

import threading
from pathlib import Path

import numpy as np
import psutil
import pytest
from tiny_packages import function, tiny_package
from web_server import WebServer

JS = Path(__file__).parents[2] / "formats" / "js"
SIDE = 384
MOST = 1.2
"""Of JavaScript and of the GPU's process, for each byte of the texture."""
DRAW = """
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const gl = new OffscreenCanvas(16, 16).getContext("webgl2");
const renderer = (window.renderer = await createRenderer(gl, await openPackage(given[0])));
await renderer.ready;
renderer.draw({ boxFromClip: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] });
renderer.readPixels();
return renderer.textureBytes;
"""


def sealed(folder: Path, codes: np.ndarray) -> Path:
    """A package of one level, of which a page believes that it is sealed."""
    tiny_package(folder, codes, function((20.0, (1, 0.2, 0.1), 0.0), (200.0, (1, 0.2, 0.1), 0.01)))
    manifest = folder / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"state": "draft"', '"state": "sealed"'))
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("large")
    codes = (np.indices((SIDE, 1, SIDE), np.uint16).sum(0) % 200).astype(np.uint8)
    sealed(folder / "small.volpkg", np.ascontiguousarray(codes[:8, :, :8]))
    sealed(folder / "large.volpkg", np.ascontiguousarray(np.broadcast_to(codes, (SIDE, SIDE, SIDE))))
    return folder


def gpu_bytes(processes: list[psutil.Process]) -> int:
    """Memory of the browser's process that draws, shared pages in part."""
    found = [each for each in processes if "--type=gpu-process" in each.cmdline()]
    assert len(found) == 1
    return found[0].memory_full_info().pss


def test_the_peak_is_a_fifth_above_the_texture_at_most(browser, folder) -> None:
    def heap() -> int:
        browser.send("HeapProfiler.collectGarbage")
        used = browser.send("Runtime.getHeapUsage")
        return used["usedSize"] + used["backingStorageSize"]

    with WebServer({"js": JS, "package": folder}) as server:
        browser.open(f"{server.url}/")
        browser.run(DRAW, "/package/small.volpkg")
        processes = psutil.Process(browser.process_id).children(recursive=True)
        before, gpu_before = heap(), gpu_bytes(processes)
        peak, ended = [gpu_before], threading.Event()

        def watch() -> None:
            while not ended.wait(0.01):
                peak[0] = max(peak[0], gpu_bytes(processes))

        thread = threading.Thread(target=watch)
        thread.start()
        try:
            texture = browser.run(DRAW, "/package/large.volpkg", timeout=240.0)
        finally:
            ended.set()
            thread.join()
        after = heap()
        browser.run("window.renderer.dispose(); return 0")
    assert texture > SIDE**3
    assert (max(peak[0], gpu_bytes(processes)) - gpu_before + after - before) / texture < MOST


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
        found = browser.run(script, "/package/large.volpkg", timeout=240.0)
    assert found["sent"] >= SIDE**3
    assert found["most"] <= 1 << 20
    # What is probed is small; the volume has a size that does not change.
    assert found["mutable"] <= 4 * SIDE
