"""Damaged, truncated and hostile packages: a message with a code, never a blank, never a hang."""

import json
import os
import shutil
import time
from pathlib import Path
from typing import Any

import pytest
from browser import Browser, PageError
from command_line import ended
from web_pictures import box_from_clip_of, drawn_in_page
from web_server import WebServer

from volprep_formats.package.reader import Package
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.progress import Silent

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def package(scene_package) -> Package:
    return scene_package("meshes on OpenGL ES 2")


@pytest.fixture
def copy(package, tmp_path) -> Path:
    return Path(shutil.copytree(package.path, tmp_path / "copy.volpkg"))


@pytest.fixture(scope="module")
def zipped(package) -> Path:
    target = package.path.parent / "p.volpkg.zip"
    names = ["manifest.json", *(each.path for each in package.manifest.files)]
    with target.open("wb") as file:
        write_single_file(package.path, names, file, Silent())
    return target


def opened(browser: Browser, server: WebServer, path: Path, script: str = "", **options: object) -> Any:
    server.folders["package"] = path.parent
    browser.open(f"{server.url}/")
    begin = 'const { openPackage, createRenderer } = await import("/js/volpkg.js"); const [url, options] = given;'
    begin += "const pack = await openPackage(url, options);"
    return browser.run(f"{begin} {script}", f"/package/{path.name}", options)


READ_ALL = "for (const { path } of pack.manifest.files) await pack.read(path); return pack.manifest.files.length;"


def busy() -> float:
    """How many times longer things take because other programs run: at least 1."""
    return max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def code_of(browser: Browser, server: WebServer, path: Path, script: str = READ_ALL, **options: object) -> str:
    start = time.monotonic()
    with pytest.raises(PageError) as caught:
        opened(browser, server, path, script, **options)
    assert time.monotonic() - start < 5 * busy()
    return str(caught.value.value["code"])


def test_damaged_zips_end_in_a_code_and_soon(zipped) -> None:
    command = ["node", str(HERE / "hostile.mjs"), str(zipped), "5", "400"]
    done = ended(command)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert set(said["found"]) <= {
        "whole",
        "VP4002",
        "VP4003",
        "VP4004",
        "VP4005",
        "VP4007",
        "VP4008",
        "VP4009",
        "VP4011",
        "VP4061",
    }
    assert said["found"]["whole"] >= 1
    assert said["found"]["VP4002"] > 100
    assert said["longest"] < 5000


LIARS = ["meshes on OpenGL ES 2", "shadow map", "half-angle slices", "slices as published", "two passes", "bricks"]


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", [*LIARS, "channels together in a mosaic", "pieces", "EAC", "editable"])
def test_manifests_that_lie_end_in_a_code_or_a_picture(browser, server, scene_package, name) -> None:
    package = scene_package(name)
    kind = "webgl2" if package.manifest.profile.api == "es3.0" else "webgl"
    server.folders["package"] = package.path.parent
    browser.open(f"{server.url}/")
    matrix = box_from_clip_of(package)[6].T.ravel().tolist()
    script = 'return (await import("/support/mutants.mjs")).mutants(...given)'
    given = (f"/package/{package.path.name}", matrix, 60, kind, package.manifest.level_programs[0].transfer)
    said = browser.run(script, *given, 5000 * busy(), timeout=280)
    assert said["wrong"] == []
    assert said["found"]["VP4004"] > 5
    # The whole schema is checked, so that few lies are left that can be drawn.
    assert said["found"]["drawn"] >= 1


@pytest.mark.long
def test_a_file_with_a_wrong_byte_is_found_by_its_digest(browser, server, copy) -> None:
    file = copy / Package.open(copy).manifest.textures[0].file
    data = bytearray(file.read_bytes())
    data[-3] ^= 1
    file.write_bytes(data)
    assert code_of(browser, server, copy) == "VP4009"


@pytest.mark.long
def test_a_file_that_is_cut_off_or_gone_says_so(browser, server, copy) -> None:
    file = copy / Package.open(copy).manifest.textures[0].file
    file.write_bytes(file.read_bytes()[:-1])
    assert code_of(browser, server, copy) == "VP4008"
    file.unlink()
    assert code_of(browser, server, copy) == "VP4007"
    (copy / "manifest.json").unlink()
    assert code_of(browser, server, copy) == "VP4001"


@pytest.mark.long
def test_an_answer_that_ends_early_and_one_that_stops_say_so(browser, package) -> None:
    for fault, options, code in (
        (("cut_after", 50), {}, "VP7015"),
        (("stall_after", 50), {"idleSeconds": 1}, "VP7016"),
    ):
        folders = {"js": HERE.parents[1] / "formats" / "js"}
        with WebServer(folders) as faulty:
            setattr(faulty, *fault)
            assert code_of(browser, faulty, package.path, **options) == code


@pytest.mark.long
def test_a_manifest_that_is_none_says_so(browser, server, copy) -> None:
    manifest = copy / "manifest.json"
    text = manifest.read_text()
    for changed, code in (
        (text[:-9], "VP4002"),
        (text.replace('"state"', '"name": "twice", "state"'), "VP4002"),
        ("[" * 200_000, "VP4002"),
        (text.replace('"version": "1.0"', '"version": "2.0"'), "VP4003"),
        (text.replace('"sealed"', '"draft"'), "VP4005"),
        (text + " " * (4 << 20), "VP4002"),
    ):
        manifest.write_text(changed)
        assert code_of(browser, server, copy, "") == code


def test_slices_for_devices_without_shaders_are_refused(browser, server, scene_package) -> None:
    package = scene_package("slices")
    with pytest.raises(PageError) as caught:
        drawn_in_page(browser, server, package.path, box_from_clip_of(package)[:1])
    assert caught.value.value["code"] == "VP7010"


@pytest.mark.long
def test_a_zip_is_drawn_by_ranges_that_hold_only_what_is_drawn(browser, package, zipped) -> None:
    draw = """const gl = new OffscreenCanvas(8, 8).getContext("webgl");
    const renderer = await createRenderer(gl, pack, { program: "core", level: 3 });
    await renderer.ready;
    return renderer.level;"""
    folders = {"js": HERE.parents[1] / "formats" / "js"}
    with WebServer(folders) as ranged:
        assert opened(browser, ranged, zipped, draw) == 3
        program = next(
            each for each in package.manifest.level_programs if (each.transfer, each.levels) == ("core", (3,))
        )
        sizes = {each.path: each.size_bytes for each in package.manifest.files}
        drawn = {each.file for each in package.manifest.textures if each.level == 3 and each.transfer != "shell"}
        needed = sum(sizes[path] for path in {*drawn, program.vertex, program.fragment})
        manifest = (package.path / "manifest.json").stat().st_size
        meshes = sum(
            size for path, size in sizes.items() if path.startswith(("meshes/", "shaders/proxy", "shaders/depth"))
        )
        # The first 128 KiB, which hold the manifest, and the last 64 KiB are all that is read beside it.
        assert manifest < 2**16
        assert ranged.sent[f"/package/{zipped.name}"] < needed + meshes + 2**17 + 2**16 + 4096
    with WebServer(folders, ranges=False) as whole:
        assert opened(browser, whole, zipped, draw) == 3


def test_bytes_and_files_are_opened_as_addresses_are(browser, server, zipped) -> None:
    server.folders["package"] = zipped.parent
    browser.open(f"{server.url}/")
    script = """
    const { openPackage } = await import("/js/volpkg.js");
    const bytes = await (await fetch(given[0])).arrayBuffer();
    const found = [];
    for (const from of [bytes, new Blob([bytes]), new File([bytes], "p.volpkg.zip")]) {
      const pack = await openPackage(from);
      for (const { path } of pack.manifest.files) await pack.read(path);
      found.push([pack.name, pack.unverified]);
    }
    const trusting = await openPackage(bytes, { digests: false });
    found.push(trusting.unverified);
    return found;
    """
    found = browser.run(script, f"/package/{zipped.name}")
    assert found == [["package", None], ["package", None], ["p.volpkg.zip", None], "the page asked for no digests"]
    assert code_of(browser, server, zipped, "await openPackage(7);") == "VP7017"


SCRIPT_HOURS = """
const gl = new OffscreenCanvas(8, 8).getContext("webgl2");
const renderer = await createRenderer(gl, pack);
await renderer.ready;
let corners = 0;
gl.drawArrays = (mode, first, count) => (corners += count);
renderer.draw({ boxFromClip: options.matrix });
let code = "";
try {
  renderer.setStep(1e-12);
} catch (error) {
  code = error.code;
}
renderer.dispose();
return { corners, code };
"""


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", ["slabs", "slices across the view", "slices as published", "half-angle slices"])
def test_a_step_that_would_take_hours_is_not_taken(browser, server, scene_package, tmp_path, name) -> None:
    package = scene_package(name)
    copy = Path(shutil.copytree(package.path, tmp_path / "copy.volpkg"))
    manifest = json.loads((copy / "manifest.json").read_text())
    for drawing in manifest["pictures"][0]["drawings"]:
        drawing["step_mm"] = 1e-12
    (copy / "manifest.json").write_text(json.dumps(manifest))
    matrix = box_from_clip_of(package)[6].T.ravel().tolist()
    found = opened(browser, server, copy, SCRIPT_HOURS, matrix=matrix)
    assert found["code"] == "VP5019"
    # Two squares a layer, for the viewer and for the light, in layers as thin as a sixteen thousandth of the diagonal.
    assert 16 < found["corners"] < 16384 * 2 * 2 * 6


def test_a_texture_may_have_any_name(browser, server, copy) -> None:
    text = (copy / "manifest.json").read_text()
    name = json.loads(text)["textures"][0]["name"]
    (copy / "manifest.json").write_text(text.replace(f'"{name}"', '"__proto__"'))
    script = "const r = await createRenderer(new OffscreenCanvas(8, 8).getContext('webgl'), pack, { level: 0 });"
    assert opened(browser, server, copy, f"{script} await r.ready; r.dispose(); return r.notes;") == []
