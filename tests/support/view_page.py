"""The page of volprep view in a browser: opened, waited for, and looked at."""

import base64
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from browser import Browser

from volprep.validation.folder import default_report_path
from volprep.view.server import ViewServer
from volprep.view.site import make_site, shown_with
from volprep_formats.package.digest import manifest_sha256

PHONE = {"width": 390, "height": 844, "deviceScaleFactor": 0.5, "mobile": True}
READY = """
for (let turn = 0; turn < 400; turn++) {
  if (!document.getElementById("problem").hidden) return "problem";
  if (window.volprep) { await window.volprep.stage.renderer.ready; return "ready"; }
  await new Promise((resolve) => setTimeout(resolve, 50));
}
return "nothing";
"""
_FRAME = """
await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
const { stage } = window.volprep;
stage.renderer.interacting(false);
await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
// A slow picture comes part by part, and with its last part in full quality.
while (stage.renderer.slow && stage.renderer.inside?.last?.quality.step !== 1)
  await new Promise((resolve) => requestAnimationFrame(resolve));
const { width, height, pixels } = stage.renderer.readPixels();
let text = "";
const bytes = new Uint8Array(pixels.buffer);
for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));
return { width, height, pixels: btoa(text) };
"""


@contextmanager
def served(package: Path, devices: Path | None = None) -> Iterator[ViewServer]:
    """Serve the page of a package."""
    site = make_site(shown_with(package, None, default_report_path(package)), takes_devices=devices is not None)
    with ViewServer(site, manifest_sha256(package), devices=devices) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05})
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


def opened(browser: Browser, url: str) -> str:
    """Open the page on a small screen; return "ready", or "problem" if it shows one."""
    browser.open(url, PHONE)
    return str(browser.run(READY))


def picture(browser: Browser) -> np.ndarray:
    """What is drawn at full quality, [H, W, 4] premultiplied linear."""
    found: Any = browser.run(_FRAME)
    return np.frombuffer(base64.b64decode(found["pixels"]), "<f4").reshape(found["height"], found["width"], 4)


def text_of(browser: Browser, element: str) -> str:
    """The text that people see of an element."""
    return str(browser.run("return document.getElementById(given[0]).innerText", element))


def drag(browser: Browser, start: tuple[int, int], end: tuple[int, int]) -> None:
    """Drag the mouse from one point of the screen to another."""
    middle = ((start[0] + end[0]) // 2, (start[1] + end[1]) // 2)
    moves = [("mousePressed", start), ("mouseMoved", middle), ("mouseMoved", end), ("mouseReleased", end)]
    for kind, (x, y) in moves:
        browser.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)


def press(browser: Browser, key: str, **more: object) -> None:
    """Press a key."""
    for kind in ("keyDown", "keyUp"):
        browser.send("Input.dispatchKeyEvent", type=kind, key=key, code=key, **more)
