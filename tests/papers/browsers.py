"""How long a page takes for a package's picture, in Chromium on the machine's own driver (thesis, table 7)."""

import base64
import math
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tests.benchmarks.drawing_time import honest_ms
from volprep.truth.camera import standard_views
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.reader import Package

from .bench import ALONE, Bench, View, rmse
from .record import Cell, Measured, PaperTable
from .volumes import Volume

if TYPE_CHECKING:
    from browser import Browser
    from web_server import WebServer

_SUPPORT = Path(__file__).parents[1] / "support"
_JS = Path(__file__).parents[2] / "formats" / "js"
_ROUNDS, _ROUND_S, _MOST_PICTURES = 2, 1.0, 1000
"""The system counts a process's time in hundredths of a second."""
_OPEN = """
const [url] = given;
const { createRenderer, openPackage } = await import("/js/volpkg.js");
const gl = new OffscreenCanvas(1, 1).getContext("webgl2");
const renderer = await createRenderer(gl, await openPackage(url), { level: 0 });
await renderer.ready;
window.opened = { gl, renderer };
const names = gl.getExtension("WEBGL_debug_renderer_info");
return gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
"""
_SIZE = """
const [height, width] = given;
const { gl } = window.opened;
const texture = gl.createTexture();
gl.bindTexture(gl.TEXTURE_2D, texture);
gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
const target = gl.createFramebuffer();
gl.bindFramebuffer(gl.FRAMEBUFFER, target);
gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
window.target = { target, viewport: [0, 0, width, height] };
"""
_DRAW = """
const [boxFromClip, pictures, [height, width]] = given;
const { gl, renderer } = window.opened;
const pixels = new Uint8Array(4 * width * height);
for (let n = 0; n < pictures; n++) {
  renderer.draw({ boxFromClip, ...window.target });
  gl.bindFramebuffer(gl.FRAMEBUFFER, window.target.target);
  // Reading waits until the driver has finished.
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
}
return btoa(pixels.reduce((text, byte) => text + String.fromCharCode(byte), ""));
"""


class Page:
    """A page with the renderer of formats/js. Use `page`."""

    def __init__(self, browser: "Browser", server: "WebServer") -> None:
        self._browser, self._server = browser, server
        self.driver = ""

    def open(self, package: Package) -> None:
        """Show a package, and note what draws."""
        self._server.folders["package"] = package.path.parent
        self._browser.open(f"{self._server.url}/")
        self.driver = self._browser.run(_OPEN, f"/package/{package.path.name}")

    def measured(self, view: View, box_from_clip: Float64Array, truth: Float64Array) -> Measured:
        """Time a picture of what is open and compare it with the truth."""
        matrix = box_from_clip.T.ravel().tolist()
        self._browser.run(_SIZE, *view.shape_hw)

        # The first compiles the shader.
        wall_s, _ = [self._spent_s(matrix, 1) for _ in range(2)][-1]
        pictures = math.ceil(min(_MOST_PICTURES, _ROUND_S / wall_s))
        spent = [self._spent_s(matrix, pictures) for _ in range(_ROUNDS)]
        ms = min(honest_ms(self.driver, wall_s * 1000, cpu_s * 1000) / pictures for wall_s, cpu_s in spent)
        return Measured(ms, rmse(self._picture(view, matrix), truth))

    def _spent_s(self, matrix: list[float], pictures: int) -> tuple[float, float]:
        """Draw so many pictures; return the seconds of the clock on the wall and of the processor."""
        wall, cpu = time.perf_counter(), self._cpu_s()
        self._browser.run(_DRAW, matrix, pictures, (1, 1), timeout=600.0)
        return time.perf_counter() - wall, self._cpu_s() - cpu

    def _picture(self, view: View, matrix: list[float]) -> Float32Array:
        """Return a picture with few pixels, [H, W, 4], row 0 on top."""
        self._browser.run(_SIZE, *view.small_hw)
        text = self._browser.run(_DRAW, matrix, 1, view.small_hw)
        pixels = np.frombuffer(base64.b64decode(text), np.uint8).reshape(*view.small_hw, 4)
        return pixels[::-1].astype(np.float32) / np.float32(255)

    def _cpu_s(self) -> float:
        """Seconds that all processes of the browser have had."""
        import psutil

        first = psutil.Process(self._browser.process_id)
        times = [process.cpu_times() for process in (first, *first.children(recursive=True))]
        return sum(each.user + each.system for each in times)


@contextmanager
def page() -> Iterator[Page | None]:
    """Open a browser on the machine's own driver; None where there is none with WebGL 2."""
    sys.path.append(str(_SUPPORT))
    from browser import Browser, chromium
    from web_server import WebServer

    if chromium() is None or not _JS.is_dir():
        yield None
        return
    with (
        tempfile.TemporaryDirectory() as folder,
        WebServer({"js": _JS}) as server,
        Browser(Path(folder), "gl-egl") as browser,
    ):
        has_webgl = browser.run('return new OffscreenCanvas(1, 1).getContext("webgl2") !== null')
        yield Page(browser, server) if has_webgl else None


_LIGHTS = {"no light": "", "lit": 'lighting = "headlight"\n'}
_NATIVE = "native"


def native_and_browser(bench: Bench, scans: dict[Volume, str], pixels: int) -> PaperTable | None:
    """Draw packages of scans, each with its look, with both; None where there is no browser."""
    rows: dict[str, list[Cell]] = {}
    with page() as opened:
        if opened is None:
            print("thesis, table 7: left out, no Chromium with WebGL 2 is here", flush=True)
            return None
        for volume, look in scans.items():
            for light in _LIGHTS.values():
                package = bench.package(volume, look, render=f"step_voxels = 0.5\n{light}", more=ALONE)
                view = View(standard_views(package.manifest.levels[0].grid)["anterior-left"], (pixels, pixels))
                with bench.renderer(package) as renderer:
                    camera = view.camera.box_from_clip(renderer.level.grid, view.aspect)
                    native = bench.measured(renderer, package, volume, view)
                opened.open(package)
                found = opened.measured(view, camera, bench.truth(package, volume, view))
                rows.setdefault(f"{_NATIVE}: {bench.driver}", []).append(native)
                rows.setdefault(f"Chromium, WebGL 2: {opened.driver}", []).append(found)
    return PaperTable(
        f"Table 7: a browser against a native program, {pixels}² pixels",
        ("", *(f"{volume.word}, {light}" for volume in scans for light in _LIGHTS)),
        tuple((name, *cells) for name, cells in rows.items()),
        "The same package, drawn by the renderer of volprep and by formats/js in a page. The thesis has two devices, "
        "four browsers and three pictures of each scan.",
    )


def about_browsers(table: PaperTable | None) -> str:
    """Say what of the thesis' finding holds."""
    if table is None:
        return ""
    native, browser = ([cell for cell in row if isinstance(cell, Measured)] for row in table.rows)
    shares = [there.ms / here.ms for here, there in zip(native, browser, strict=True)]
    same = max(shares) < 1.15
    return (
        f" Table 7: a browser takes {min(shares):.2f} to {max(shares):.2f} of the time of a native program; that both "
        f"run at the same speed {'holds' if same else 'does not hold here'}."
    )
