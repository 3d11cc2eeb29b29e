"""The page as static files and as one file, and the modules that become one."""

import base64
import json
import re
import shutil
import tempfile
from pathlib import Path

import numpy as np
import pytest
from command_line import ended, volprep
from slice_packages import slice_package
from view_page import opened, picture, text_of
from web_server import WebServer

from volprep import view as view_room
from volprep.validation.folder import default_report_path
from volprep.view.bundle import bundle
from volprep.view.export import write_page_file, write_page_folder
from volprep.view.site import SETTINGS, ShownPackage, make_site, read_served, shown_with
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.progress import Silent
from volprep_formats.runtime import runtime_modules


@pytest.fixture(scope="module")
def shown(phantom) -> ShownPackage:
    return shown_with(phantom.package, None, default_report_path(phantom.package))


@pytest.mark.parametrize(("compositing", "lengths"), [("emission-absorption", []), ("mida", []), ("maximum", [1.0])])
def test_functions_of_pictures_of_one_value_have_an_opaque_length(shown, compositing, lengths) -> None:
    manifest = shown.package.manifest
    programs = tuple(each.model_copy(update={"compositing": compositing}) for each in manifest.programs)
    package = Package(shown.package.path, manifest.model_copy(update={"programs": programs}))
    site = make_site(ShownPackage(package, None, None), takes_devices=False)
    told = json.loads(read_served(site[SETTINGS]))["opaque_lengths_mm"]
    assert set(told.values()) == set(lengths)
    assert set(told) == ({each.name for each in manifest.transfer_functions} if lengths else set())


@pytest.fixture(scope="module")
def folder(shown, tmp_path_factory) -> Path:
    target = tmp_path_factory.mktemp("static") / "page"
    write_page_folder(shown, target, Silent())
    return target


@pytest.fixture(scope="module")
def one_file(shown, tmp_path_factory) -> Path:
    target = tmp_path_factory.mktemp("single") / "phantom.html"
    write_page_file(shown, target, Silent())
    return target


@pytest.mark.long
def test_any_server_of_static_files_serves_the_folder(browser, folder) -> None:
    with WebServer({"page": folder}) as server:
        assert opened(browser, f"{server.url}/page/index.html") == "ready"
        assert picture(browser)[..., 3].max() > 0.5
        assert "you can save it" in browser.run("return document.getElementById('measure').textContent")
    assert browser.console == []


def test_the_folder_holds_the_package_as_it_is_and_says_what_it_may_load(folder, phantom) -> None:
    for record in phantom.report.package.manifest.files:
        assert (folder / "package" / record.path).read_bytes() == (phantom.package / record.path).read_bytes()
    assert (folder / "package" / MANIFEST).read_bytes() == (phantom.package / MANIFEST).read_bytes()
    assert "default-src 'none'; script-src 'self'" in (folder / "index.html").read_text(encoding="utf-8")


def test_one_file_draws_from_the_disk_and_loads_nothing(browser, one_file) -> None:
    assert opened(browser, one_file.as_uri()) == "ready"
    assert picture(browser)[..., 3].max() > 0.5
    assert text_of(browser, "error").count("RMSE") > 0
    assert browser.run("return performance.getEntriesByType('resource').map((each) => each.name)") == []
    assert browser.console == []


def test_one_file_measures_and_keeps_the_result(browser, one_file) -> None:
    assert opened(browser, one_file.as_uri()) == "ready"
    found = browser.run("""
        document.getElementById("measure").closest("details").open = true;
        document.querySelector("#measure button.main").click();
        const place = document.getElementById("measure");
        while (!/view /.test(place.innerText)) await new Promise((resolve) => setTimeout(resolve, 50));
        const going = place.innerText;
        [...place.querySelectorAll("button")].find((each) => each.innerText === "Stop").click();
        while (!/Stopped/.test(place.innerText)) await new Promise((resolve) => setTimeout(resolve, 50));
        return going;
    """)
    assert "shell, view" in found


def test_one_file_allows_its_own_text_alone(one_file) -> None:
    text = one_file.read_text(encoding="utf-8")
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    assert "default-src 'none'" in policy[1]
    assert "connect-src" not in policy[1]
    assert "unsafe" not in policy[1]
    assert "http:" not in re.sub(r"http://www\.w3\.org/2000/svg", "", policy[1])
    parts = re.findall(r'<script type="text/plain" data-file="package\.volpkg\.zip">([^<]*)</script>', text)
    assert base64.b64decode(parts[0])[:4] == b"PK\x03\x04"


def test_one_file_needs_no_room_elsewhere(shown, monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    write_page_file(shown, tmp_path / "page.html", Silent())
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]


def test_what_exists_is_replaced_only_by_force_and_only_if_it_is_a_page(shown, folder, one_file, tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP7033"):
        write_page_folder(shown, folder, Silent())
    (folder / "page" / "old.js").write_text("old")
    write_page_folder(shown, folder, Silent(), force=True)
    assert not (folder / "page" / "old.js").exists()
    (folder / "mine.txt").write_text("mine")
    with pytest.raises(VolprepError, match=r"it holds mine\.txt, which is no part of a page"):
        write_page_folder(shown, folder, Silent(), force=True)
    (folder / "mine.txt").unlink()
    with pytest.raises(VolprepError, match="VP1251"):
        write_page_file(shown, one_file, Silent())
    before = one_file.read_bytes()
    write_page_file(shown, one_file, Silent(), force=True)
    assert one_file.read_bytes() == before
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(VolprepError, match="VP7033"):
        write_page_folder(shown, tmp_path, Silent(), force=True)
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_the_verb_writes_a_folder_once(phantom, tmp_path) -> None:
    done = volprep("view", phantom.package, "-o", tmp_path / "page")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "page" / "index.html").is_file()
    again = volprep("view", phantom.package, "-o", tmp_path / "page")
    assert (again.returncode, "VP7033" in again.stderr) == (ExitStatus.OUTPUT, True)


def test_a_report_of_another_package_is_refused_where_it_was_named_and_not_shown_where_not(phantom, tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP7039"):
        shown_with(phantom.package, tmp_path, phantom.report_folder)
    other = tmp_path / "report"
    shutil.copytree(phantom.report_folder, other)
    text = (other / "report.json").read_text().replace(phantom.report.package.manifest_sha256, "0" * 64)
    (other / "report.json").write_text(text)
    assert shown_with(phantom.package, None, other).report is None


def test_slices_without_palettes_are_refused(tmp_path) -> None:
    package = slice_package(tmp_path, np.full((4, 5, 6), 200, np.uint8), slices='form = "rgba"').path
    with pytest.raises(VolprepError, match="VP7030"):
        shown_with(package, None, tmp_path / "none.report")


def modules() -> dict[str, str]:
    page = Path(view_room.__file__).parent / "page"
    found = {f"page/{path.name}": path.read_text(encoding="utf-8") for path in page.glob("*.js")}
    return found | {f"runtime/{name}": text for name, text in runtime_modules().items()}


def test_all_modules_that_ship_become_one_and_none_is_forgotten() -> None:
    text = bundle(modules(), "page/main.js")
    for address in modules():
        if not any(
            each in address
            for each in ("types.js", "options.js", "store_fidelity.js", "worker", "three", "runtime/volpkg")
        ):
            assert f"// {address}\n" in text, address


def run(text: str) -> str:
    done = ended(["node", "--input-type=module", "-e", text], timeout=20)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_modules_that_became_one_do_what_they_did_apart() -> None:
    found = bundle(
        {
            "a/main.js": 'import { twice as double, VERSION } from "../b.js";\nimport * as c from "./c.js";\n'
            'import "./d.js";\n/** @type {import("./nothing.js").X} */\nconst x = 1;\n'
            "const show = (late) => console.log(double(VERSION), c.name, c.count(), late.f(x));\n"
            'import("./late.js").then(show);\nexport const all = () => 7;\n',
            "b.js": "export const VERSION = 3;\nexport function twice(n) {\n  return 2 * n;\n}\n",
            "a/c.js": 'export { VERSION as name } from "../b.js";\nlet n = 0;\n'
            "const count = () => ++n;\nexport { count };\n",
            "a/d.js": "console.log('d first');\n",
            "a/late.js": 'import { VERSION } from "../b.js";\nimport { all } from "./main.js";\n'
            "export async function f(x) {\n  return x + VERSION + all();\n}\nexport class Unused {}\n",
        },
        "a/main.js",
    )
    assert run(found) == "d first\n6 3 1 Promise { 11 }\n"


@pytest.mark.parametrize(
    ("modules", "problem"),
    [
        ({"m.js": 'import x from "./n.js";\n', "n.js": ""}, "not understood"),
        ({"m.js": "export default 3;\n"}, "not understood"),
        ({"m.js": "/** Three. */ export const three = 3;\n"}, "not understood"),
        ({"m.js": "console.log(import.meta.url);\n"}, "not understood"),
        ({"m.js": "const a = await import(where);\n"}, "not understood"),
        ({"m.js": 'import "./n.js";\n'}, "not there"),
        ({"m.js": 'import "./n.js";\n', "n.js": 'import "./m.js";\n'}, "circle"),
    ],
)
def test_what_would_be_bundled_wrongly_is_refused(modules, problem) -> None:
    with pytest.raises(ValueError, match=problem):
        bundle(modules, "m.js")
