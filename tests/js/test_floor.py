"""What ships runs on the oldest browsers that it is for: iOS 15 and Chrome 90.

Syntax is compared by esbuild, and the language's objects by the compiler of types, which knows those of 2021 alone
(tsconfig.json, tests/js/test_words.py). Interfaces of browsers are taken away, and packages are drawn without them.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from command_line import ended
from npm_package import npm_package
from web_pictures import TWO_STEPS, box_from_clip_of, drawn_by_reference, rmse

from volprep_formats.runtime import runtime_modules, sent_modules

TARGET = ("chrome90", "safari15")
REMOVED = Path(__file__).with_name("old_browser.mjs")


USUAL = {"at", "with", "from", "try", "union", "difference", "intersection", "transfer"}
"""Names that other things have as well: the browser test finds those."""


def removed_names() -> list[str]:
    """Names of the interfaces that old_browser.mjs takes away."""
    return sorted(set(re.findall(r'^  \[.*, "(\w+)"\],$', REMOVED.read_text(), re.MULTILINE)))


def test_no_module_needs_a_newer_language(tmp_path) -> None:
    esbuild = npm_package("esbuild", "0.25.0") / "node_modules" / "esbuild" / "bin" / "esbuild"
    for name, text in runtime_modules().items():
        (tmp_path / name).write_text(text)
    made = {}
    for target in (",".join(TARGET), "esnext"):
        out = tmp_path / target
        # Chrome 90 has optional chaining, but for a call with a spread argument, which nothing here has.
        options = [f"--target={target}", "--supported:optional-chain=true", f"--outdir={out}", "--log-level=error"]
        command = [esbuild, *sorted(tmp_path.glob("*.js")), *options]
        done = ended(command, timeout=60)
        assert done.returncode == 0, done.stderr
        made[target] = {path.name: path.read_text() for path in out.glob("*.js")}
    old, new = made.values()
    # What esbuild would have to write otherwise.
    assert [name for name in old if old[name] != new[name]] == []
    assert not [name for name, text in new.items() if re.search(r"\?\.\((?:[^()]*,\s*)?\.\.\.", text)]


def test_no_module_names_what_is_taken_away() -> None:
    banned = set(removed_names()) - USUAL
    used = {
        (name, each)
        for name, text in sent_modules().items()
        for each in re.findall(r"[.\s(](\w+)\(", text)
        if each in banned
    }
    assert used == set()


@pytest.fixture
def old(browser, server):
    """A page of a browser without what the floor lacks."""
    browser.open(f"{server.url}/")
    taken = browser.run('return (await import("/support/old_browser.mjs")).taken')
    assert {"any", "throwIfAborted", "hasOwn", "at", "structuredClone"} <= set(taken)
    yield browser
    browser.open(f"{server.url}/")


SCRIPT = """
const [url, kind, matrix, more] = given;
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const canvas = Object.assign(document.createElement("canvas"), { width: 48, height: 48 });
const gl = canvas.getContext(kind);
const pack = await openPackage(url);
const renderer = await createRenderer(gl, pack);
await renderer.ready;
if (more.clip) await renderer.setClip(more.clip);
renderer.draw({ boxFromClip: matrix });
const { pixels } = renderer.readPixels();
const hit = await renderer.pick(24, 24, { opacity: 0.05 });
const { level } = renderer;
renderer.dispose();
pack.close();
return { level, hit: hit !== null, pixels: Array.from(pixels) };
"""


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("name", "kind"),
    [("lit mosaic, skips by distance", "webgl"), ("bricks", "webgl2"), ("two passes on OpenGL ES 2", "webgl2")],
)
def test_the_oldest_browsers_draw_the_picture(old, server, scene_package, name, kind) -> None:
    package = scene_package(name)
    server.folders["package"] = package.path.parent
    matrix = box_from_clip_of(package)[6]
    found = old.run(SCRIPT, "/package/p.volpkg", kind, matrix.T.ravel().tolist(), {})
    assert found["level"] == 0
    assert found["hit"]
    (wanted,) = drawn_by_reference(package, [matrix])
    assert rmse(np.array(found["pixels"]).reshape(48, 48, 4), wanted) < TWO_STEPS


def test_a_device_without_half_floats_says_what_that_costs(browser, server, scene_package) -> None:
    package = scene_package("lit mosaic, skips by distance")
    server.folders["package"] = package.path.parent
    browser.open(f"{server.url}/")
    script = """
    const { openPackage, createRenderer } = await import("/js/volpkg.js");
    const gl = document.createElement("canvas").getContext("webgl");
    const get = gl.getExtension.bind(gl);
    gl.getExtension = (name) => (/half_float/.test(name) ? null : get(name));
    const renderer = await createRenderer(gl, await openPackage("/package/p.volpkg"));
    const { notes } = renderer;
    renderer.dispose();
    return notes;
    """
    notes = browser.run(script)
    assert [each for each in notes if "RGBA8" in each and "half floats" in each and "\\n" not in each]
