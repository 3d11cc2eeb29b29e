"""When a page shows a first picture, on a network of a given speed."""

from typing import Any

from browser import Browser

LATENCY_MS = 40
_WATCH = """
for (const kind of ["WebGLRenderingContext", "WebGL2RenderingContext"]) {
  const { prototype } = window[kind];
  const real = prototype.drawArrays;
  prototype.drawArrays = function (...given) {
    real.apply(this, given);
    if (window.firstPicture || !(this.canvas instanceof HTMLCanvasElement)) return;
    if (this.getParameter(this.FRAMEBUFFER_BINDING)) return;
    const { drawingBufferWidth: width, drawingBufferHeight: height } = this;
    const pixel = new Uint8Array(4);
    this.readPixels(width >> 1, height >> 1, 1, 1, this.RGBA, this.UNSIGNED_BYTE, pixel);
    if (pixel[0] + pixel[1] + pixel[2] === 0) return;
    const entries = performance.getEntriesByType("resource");
    window.firstPicture = { ms: performance.now(), files: entries.map(({ name }) => new URL(name).pathname) };
  };
}
"""
_WAIT = """
while (!window.firstPicture) await new Promise((resolve) => setTimeout(resolve, 10));
return window.firstPicture;
"""


def first_picture(browser: Browser, url: str, mbit_s: float, timeout: float = 120.0) -> Any:
    """Open a page; give the milliseconds until something is seen in its middle, and the files it had by then."""
    watching = browser.send("Page.addScriptToEvaluateOnNewDocument", source=_WATCH)["identifier"]
    speed = {"latency": LATENCY_MS, "downloadThroughput": mbit_s * 1e6 / 8, "uploadThroughput": mbit_s * 1e6 / 8}
    browser.send("Network.emulateNetworkConditions", offline=False, **speed)
    try:
        browser.open(url)
        return browser.run(_WAIT, timeout=timeout)
    finally:
        free = {"latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
        browser.send("Network.emulateNetworkConditions", offline=False, **free)
        browser.send("Page.removeScriptToEvaluateOnNewDocument", identifier=watching)
