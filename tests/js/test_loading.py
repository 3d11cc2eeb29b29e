"""Levels come the coarsest first, a later request replaces an earlier one, moving pictures keep their time."""

import json
from pathlib import Path

import pytest
from command_line import ended
from web_pictures import box_from_clip_of
from web_server import WebServer

from volprep_formats.package.reader import Package

JS = Path(__file__).parents[2] / "formats" / "js"


@pytest.fixture(scope="module")
def package(scene_package) -> Package:
    return scene_package("half floats")


BEGIN = """
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const gl = new OffscreenCanvas(24, 24).getContext("webgl2");
const pack = await openPackage("/package/p.volpkg");
"""


@pytest.fixture
def run(browser, server, package):
    server.folders["package"] = package.path.parent
    browser.open(f"{server.url}/")
    matrix = box_from_clip_of(package)[6].T.ravel().tolist()
    return lambda script: browser.run(BEGIN + script, matrix)


def test_the_coarsest_level_is_drawn_first_and_every_finer_one_as_it_comes(run) -> None:
    script = """
    const renderer = await createRenderer(gl, pack);
    const levels = [renderer.level];
    const opaque = [];
    const show = () => {
      renderer.draw({ boxFromClip: given[0] });
      opaque.push(Math.max(...renderer.readPixels().pixels) > 0.1);
    };
    show();
    renderer.onchange = () => (levels.push(renderer.level), show());
    await renderer.ready;
    return { levels, opaque };
    """
    assert run(script) == {"levels": [2, 1, 0], "opaque": [True, True, True]}


def test_the_first_picture_needs_no_byte_of_a_finer_level(browser, package) -> None:
    script = """
    const renderer = await createRenderer(gl, pack);
    const { level } = renderer;
    renderer.dispose();
    pack.close();
    return [level, renderer.textureBytes];
    """
    folders = {"js": JS, "package": package.path.parent}
    with WebServer(folders, stall_after=0, stall_only="volume-scan-1") as server:
        browser.open(f"{server.url}/")
        assert browser.run(BEGIN + script, timeout=10) == [2, 0]


def test_a_later_request_takes_the_place_of_an_earlier_one(run) -> None:
    script = """
    const renderer = await createRenderer(gl, pack);
    const first = renderer.setLevel(0);
    const second = renderer.setProgram("core");
    const third = renderer.setLevel(1);
    return [await first, await second, await third, renderer.level, renderer.program];
    """
    assert run(script) == [False, False, True, 1, "core"]


def test_impossible_requests_are_refused_with_a_code(run) -> None:
    script = """
    const renderer = await createRenderer(gl, pack);
    await renderer.ready;
    const code = async (work) => {
      try {
        await work();
      } catch (error) {
        return error.code;
      }
    };
    return [
      await code(() => renderer.setLevel(7)),
      await code(() => renderer.setProgram("nothing")),
      await code(() => renderer.setStep(-1)),
      await code(() => renderer.setPoint(3)),
      await code(() => renderer.setClip({ planes: [[1, 2, 3]] })),
      await code(() => renderer.draw({ boxFromClip: given[0], viewport: [0, 0, 1e6, 4] })),
      renderer.level,
    ];
    """
    assert run(script) == ["VP5018", "VP5018", "VP5019", "VP5018", "VP7019", "VP5009", 0]


def test_what_is_no_context_no_package_and_no_clip_is_refused_with_a_code(run) -> None:
    script = """
    const refused = async (work) => {
      try {
        await work();
      } catch (error) {
        return [error.code, error.message];
      }
    };
    const renderer = await createRenderer(gl, pack);
    const drawing = document.createElement("canvas").getContext("2d");
    return [
      await refused(() => createRenderer(null, pack)),
      await refused(() => createRenderer(drawing, pack)),
      await refused(() => createRenderer(gl, "/package")),
      await refused(() => createRenderer(gl, Promise.resolve(pack))),
      await refused(() => openPackage(undefined)),
      await refused(() => renderer.setClip({ box: [0, 0, 0, 9, 9, 9] })),
      await refused(() => renderer.setClip({ low: [0, 0, 0], high: [9, 9, 9] })),
    ];
    """
    found = run(script)
    codes = ["VP7010", "VP7010", "VP7017", "VP7017", "VP7017", "VP7019", "VP7019"]
    assert [code for code, _ in found] == codes
    messages = " ".join(message for _, message in found)
    assert messages.count("needs a WebGL context, but this page has none") == 2
    assert messages.count("at most 12, a box being six") == 2


def test_a_signal_ends_the_wait_for_the_first_picture(browser, package) -> None:
    script = """
    const ends = async (where) => {
      const stop = new AbortController();
      const signals = { [where]: { signal: stop.signal } };
      const pack = await openPackage("/package/p.volpkg", signals.open);
      const made = createRenderer(gl, pack, signals.create);
      setTimeout(() => stop.abort(), 100);
      return made.then(() => "drawn", (error) => error.name);
    };
    return [await ends("open"), await ends("create")];
    """
    folders = {"js": JS, "package": package.path.parent}
    with WebServer(folders, stall_after=0, stall_only="volume-scan") as server:
        browser.open(f"{server.url}/")
        assert browser.run(BEGIN + script) == ["AbortError", "AbortError"]


def test_what_is_disposed_of_loads_nothing_again(run) -> None:
    script = """
    const renderer = await createRenderer(gl, pack);
    await renderer.ready;
    renderer.dispose();
    return [await renderer.setLevel(1), await renderer.setProgram("core"), renderer.level, renderer.textureBytes];
    """
    assert run(script) == [False, False, -1, 0]


@pytest.mark.long
def test_a_coarser_step_and_fewer_pixels_are_used_only_while_the_camera_moves(run) -> None:
    script = """
    const renderer = await createRenderer(gl, pack, { frameMs: 0.001 });
    await renderer.ready;
    const draw = () => (renderer.draw({ boxFromClip: given[0] }), renderer.readPixels().width);
    const widths = [draw()];
    renderer.interacting(true);
    for (let i = 0; i < 20; i++) {
      await new Promise((resolve) => setTimeout(resolve, 20));
      draw();
    }
    widths.push(draw());
    renderer.interacting(false);
    widths.push(draw());
    return widths;
    """
    # No picture is drawn in a microsecond: the coarsest way is taken, 0.35 of 24 pixels.
    assert run(script) == [24, 9, 24]


def test_the_quality_follows_the_time_that_pictures_take() -> None:
    script = f"""
    const {{ Pace }} = await import("{JS}/draw/motion_quality.js");
    const pace = new Pace({{ texImage3D: null }}, 25);
    const found = [];
    for (const [full, times] of [[10, 1], [60, 1], [1000, 1], [10, 40]]) {{
      for (let i = 0; i < times; i++) {{
        const {{ step, scale }} = pace.quality;
        pace.took(full * scale * scale / step, pace.quality);
      }}
      found.push([pace.quality.step, pace.quality.scale]);
    }}
    console.log(JSON.stringify(found));
    """
    done = ended(["node", "--input-type=module", "-e", script], timeout=60)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == [[1, 1], [2, 0.8], [4, 0.35], [1, 1]]
