"""Frames of a time series in a page: shown by number or time, kept on the GPU, and asked for ahead."""

import pytest
from scene_builds import built
from time_series import moving, write_series
from web_pictures import box_from_clip_of

from volprep_formats.package.reader import Package

BEGIN = """
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const gl = new OffscreenCanvas(24, 24).getContext("webgl2");
const pack = await openPackage("/package/series.volpkg");
const asked = [];
const { stream } = pack;
pack.stream = (path, options) => (asked.push(path), stream.call(pack, path, options));
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Package:
    folder = tmp_path_factory.mktemp("series")
    return built(write_series(folder, moving(4)), folder / "series.volpkg")


@pytest.fixture
def run(browser, server, package):
    server.folders["package"] = package.path.parent
    browser.open(f"{server.url}/")
    matrix = box_from_clip_of(package)[6].T.ravel().tolist()
    return lambda script: browser.run(BEGIN + script, matrix)


@pytest.mark.parametrize(("options", "again"), [("{}", 0), ("{ frameBytes: 0 }", 4)])
def test_frames_that_are_shown_again_are_still_on_the_gpu(run, options: str, again: int) -> None:
    script = f"""
    const renderer = await createRenderer(gl, pack, {options});
    await renderer.ready;
    const round = async () => {{
      asked.length = 0;
      for (const frame of [0, 1, 2, 3]) await renderer.setFrame(frame);
      return asked.filter((path) => path.includes("volume")).length;
    }};
    await round();
    return round();
    """
    assert run(script) == again


def test_the_textures_that_are_kept_have_no_more_bytes_than_the_app_allows(run, package) -> None:
    volume = next(each for each in package.manifest.textures if each.role == "volume")
    size = volume.shape_zyx[0] * volume.shape_zyx[1] * volume.shape_zyx[2]
    script = """
    const renderer = await createRenderer(gl, pack, { frameBytes: BYTES, level: 0 });
    await renderer.ready;
    const before = renderer.textureBytes;
    for (const frame of [1, 2, 3, 0]) await renderer.setFrame(frame);
    return renderer.textureBytes - before;
    """
    assert run(script.replace("BYTES", "1e9")) > 2 * size
    assert 0 < run(script.replace("BYTES", str(int(1.5 * size)))) <= 1.5 * size


def test_a_time_shows_the_frame_that_was_taken_before_it(run) -> None:
    script = """
    const renderer = await createRenderer(gl, pack);
    await renderer.ready;
    const shown = [];
    for (const seconds of [-1, 0, 0.039, 0.04, 0.1, 9]) {
      await renderer.setFrame({ seconds });
      shown.push(renderer.frame);
    }
    return shown;
    """
    assert run(script) == [0, 0, 0, 1, 2, 3]


def test_the_files_of_the_next_frame_are_asked_for_ahead(run, server) -> None:
    script = """
    const renderer = await createRenderer(gl, pack, { level: 0 });
    await renderer.ready;
    await renderer.setFrame(1);
    await new Promise((resolve) => setTimeout(resolve, 200));
    return performance.getEntriesByType("resource").map(({ name }) => name);
    """
    names = run(script)
    assert any("frame2/" in name for name in names)
    assert not any("frame3/" in name for name in names)


def test_the_element_has_an_attribute_for_the_frame(run) -> None:
    script = """
    await import("/js/element.js");
    const viewer = document.createElement("volume-viewer");
    viewer.setAttribute("frame", "2");
    document.body.append(viewer);
    const loaded = new Promise((resolve) => viewer.addEventListener("load", resolve, { once: true }));
    viewer.setAttribute("src", "/package/series.volpkg");
    await loaded;
    const until = async (frame) => {
      while (viewer.renderer.frame !== frame) await new Promise((resolve) => setTimeout(resolve, 10));
    };
    await until(2);
    viewer.setAttribute("frame", "3");
    await until(3);
    const failed = new Promise((resolve) => viewer.addEventListener("error", ({ detail }) => resolve(detail.code)));
    viewer.setAttribute("frame", "4");
    const code = await failed;
    viewer.remove();
    return code;
    """
    assert run(script) == "VP5018"
