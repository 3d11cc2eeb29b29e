"""The notebook widget in a real JupyterLab in headless Chromium, and as nbconvert keeps it.

JupyterLab is no requirement of volprep: it is taken from the path, with a kernel that finds volprep in the environment
of the tests.
"""

import json
import os
import shutil
import socket
import subprocess
import sysconfig
import time
from collections.abc import Iterator
from pathlib import Path

import anywidget
import pytest
from browser import Browser

CELLS = (
    """import numpy as np
import volprep
z, y, x = np.ogrid[:24, :24, :24]
ball = (255 * np.exp(-((z - 14) ** 2 + (y - 10) ** 2 + (x - 12) ** 2) / 40)).astype(np.uint8)
widget = volprep.show(ball, view="left")
widget""",
    "print('python sees', repr(widget.view))",
)
WAIT = """
const wait = async (test) => {
  for (let turn = 0; turn < 500; turn++) {
    const found = await test();
    if (found) return found;
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  throw new Error(`waited in vain for ${test}`);
};
const { jupyterapp: app } = window;
const viewer = () => document.querySelector("volume-viewer");
const told = () => [...document.querySelectorAll(".jp-OutputArea-output")].map((each) => each.textContent).join("");
const run = async (text) => {
  app.shell.currentWidget.content.activeCell.model.sharedModel.setSource(text);
  await app.commands.execute("notebook:run-cell");
};
"""


@pytest.fixture(scope="module")
def lab(tmp_path_factory) -> tuple[Path, dict[str, str], Path]:
    """The program, its settings and a folder with a notebook."""
    program = shutil.which("jupyter-lab")
    if program is None:
        pytest.skip("no jupyter-lab on the path: pip install jupyterlab into an environment of its own")
    python = Path(program).read_text(encoding="utf-8").splitlines()[0].removeprefix("#!")
    folder: Path = tmp_path_factory.mktemp("lab")
    kernel = folder / "share" / "kernels" / "volprep"
    kernel.mkdir(parents=True)
    begin = f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})"
    command = [python, "-c", f"{begin}; from ipykernel.kernelapp import launch_new_instance as go; go()"]
    spec = {"argv": [*command, "-f", "{connection_file}"], "display_name": "volprep", "language": "python"}
    (kernel / "kernel.json").write_text(json.dumps(spec))
    cells = [
        {"cell_type": "code", "execution_count": None, "id": f"c{i}", "metadata": {}, "outputs": [], "source": source}
        for i, source in enumerate(CELLS)
    ]
    named = {"kernelspec": {"display_name": "volprep", "language": "python", "name": "volprep"}}
    notebook = {"cells": cells, "metadata": named, "nbformat": 4, "nbformat_minor": 5}
    (folder / "ball.ipynb").write_text(json.dumps(notebook))
    paths = f"{folder / 'share'}:{Path(anywidget.__file__).resolve().parents[4] / 'share' / 'jupyter'}"
    return Path(program), {**os.environ, "JUPYTER_PATH": paths, "HOME": str(folder)}, folder


@pytest.fixture(scope="module")
def page(lab, browser: Browser) -> Iterator[Browser]:
    """JupyterLab with the open notebook, all of whose cells were run."""
    program, environment, folder = lab
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = ["--no-browser", f"--port={port}", "--IdentityProvider.token=t", "--allow-root"]
    words += [f"--ServerApp.root_dir={folder}", "--LabApp.expose_app_in_browser=True", "--LabApp.news_url=None"]
    quiet = subprocess.DEVNULL
    with subprocess.Popen([program, *words], env=environment, stdout=quiet, stderr=quiet) as server:
        try:
            for _ in range(600):
                with socket.socket() as there:
                    if there.connect_ex(("127.0.0.1", port)) == 0:
                        break
                time.sleep(0.1)
            browser.open(f"http://127.0.0.1:{port}/lab/tree/ball.ipynb?token=t&reset")
            browser.run(
                f"{WAIT.replace('const { jupyterapp: app } = window;', '')} await wait(() => window.jupyterapp)"
            )
            browser.run(f"{WAIT} await wait(() => app.shell.currentWidget?.sessionContext?.session?.kernel)")
            browser.run(
                f"{WAIT} await wait(() => app.shell.currentWidget.sessionContext.session.kernel.status === 'idle')"
            )
            browser.run(f"{WAIT} await app.commands.execute('notebook:run-all-cells')")
            yield browser
        finally:
            server.terminate()


def test_the_widget_draws_in_jupyterlab_and_both_sides_follow(page) -> None:
    page.run(f"{WAIT} await wait(() => viewer()?.renderer?.level === 0)")
    found = page.run(
        WAIT
        + """
    const { stage } = viewer();
    const forward = () => stage.orbit.camera.forward;
    const { pixels } = (stage.draw(), viewer().renderer.readPixels());
    await wait(() => told().includes("python sees 'left'"));
    const first = forward()[0];
    const canvas = viewer().shadowRoot.querySelector("canvas");
    await wait(() => viewer().shadowRoot.querySelector("[role=toolbar]"));
    canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft", bubbles: true }));
    while (!told().includes("by hand ''")) await run("print('by hand', repr(widget.view))");
    await run("widget.slices = True");
    const slices = () => document.querySelectorAll(".volprep-slices .slice canvas[aria-label]");
    await wait(() => slices().length === 3);
    const height = slices()[0].clientHeight;
    await run("widget.view = 'superior'");
    await wait(() => forward()[2] < -0.999);
    const said = viewer().shadowRoot.querySelector("[role=status]").textContent;
    return { seen: pixels.some((each) => each > 0.2), first, said, height };
    """
    )
    assert found["seen"]
    assert found["first"] == -1
    assert found["height"] == 240
    assert "VP" not in found["said"]


def test_nbconvert_keeps_a_picture_with_words(lab) -> None:
    program, environment, folder = lab
    command = [program.with_name("jupyter-nbconvert"), "--to", "html", "--execute", "ball.ipynb", "--output", "page"]
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True, timeout=300)
    text = (folder / "page.html").read_text(encoding="utf-8")
    assert "data:image/png;base64," in text
    assert "Not validated." in text
