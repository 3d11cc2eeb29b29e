"""The notebook widget in a page, with a model as anywidget gives one."""

import base64
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from browser import Browser
from web_server import WebServer

from volprep.library.notebook.widget import VolumeWidget

ROOT = Path(__file__).parents[2]
PAGE = "<!doctype html><meta charset=utf-8><link rel=icon href='data:,'><body style='margin: 0'></body>"
START = """
const wait = async (test) => {
  for (let turn = 0; turn < 300; turn++) {
    if (await test()) return true;
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
  throw new Error(`waited in vain for ${test}: ${window.model?.state.error}`);
};
const bytes = (text) => Uint8Array.from(atob(text), (each) => each.charCodeAt(0));
const pixels = (viewer) => {
  viewer.stage.still();
  viewer.stage.draw();
  return Array.from(viewer.renderer.readPixels().pixels);
};
const viewer = () => document.querySelector("volume-viewer");
const apart = (a, b) => a.reduce((most, each, i) => Math.max(most, Math.abs(each - b[i])), 0);
"""
MODEL = """
class Model {
  constructor(state) { this.state = state; this.heard = {}; this.saved = []; }
  get(name) { return this.state[name]; }
  set(name, value) { this.state[name] = value; this.saved.push(name); }
  save_changes() {}
  send({ wanted }) {
    setTimeout(() => this.heard["msg:custom"]?.forEach((act) => act({ given: wanted }, [this.state[wanted]])));
  }
  on(event, act) { (this.heard[event] ??= new Set()).add(act); }
  off(event, act) { this.heard[event].delete(act); }
  tell(name, value) { this.state[name] = value; this.heard[`change:${name}`]?.forEach((act) => act()); }
}
const state = given[0];
for (const name of ["package", "picture"]) state[name] = new DataView(bytes(state[name]).buffer);
window.model = new Model(state);
const { default: widget } = await import("/esm/widget.js");
window.clean = widget.render({ model, el: document.body });
await wait(() => viewer().renderer?.level === 0 && model.get("level") === 0);
"""


@contextmanager
def module_served(widget: VolumeWidget, folder: Path) -> Iterator[WebServer]:
    """Serve the module of the widget, written to a folder, and an empty page."""
    (folder / "widget.js").write_text(str(widget._esm), encoding="utf-8")
    (folder / "index.html").write_text(PAGE)
    with WebServer({"esm": folder, "js": ROOT / "formats" / "js"}) as serving:
        yield serving


def open_widget(browser: Browser, widget: VolumeWidget, server: WebServer) -> None:
    """Open a page in which anywidget would have rendered the widget, and wait for its picture."""
    state: dict[str, Any] = {name: value for name, value in widget.get_state().items() if not name.startswith("_")}
    state["package"] = widget.package
    del state["kept"]
    for name in ("package", "picture"):
        state[name] = base64.b64encode(bytes(state[name])).decode()
    state.pop("layout", None), state.pop("tabbable", None), state.pop("tooltip", None)
    browser.open(f"{server.url}/esm/index.html")
    browser.run(START + MODEL, json.loads(json.dumps(state)))
