"""What a page is sent is small, and the program that was written; more is sent only for packages that have more."""

import gzip
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import ended
from npm_package import npm_package

from volprep.view.site import page_modules
from volprep_formats.javascript import ScriptError, stripped
from volprep_formats.runtime import runtime_modules, sent_modules

ROOT = Path(__file__).parents[2]
MOST_BYTES = 21_500
"""With the custom element 26 kB."""


def needed(modules: dict[str, str], first: str) -> set[str]:
    """A module, and all that it imports at once."""
    found, waiting = set(), [first]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += re.findall(r'\b(?:import|export)[^;"()=]*"\./([\w.]+)"', modules[name])
    return found


def test_what_every_package_needs_is_sent_in_less_than_22_kilobytes() -> None:
    sent = sent_modules()
    core = needed(sent, "volpkg.js")
    assert core == {"volpkg.js", "core.js"}
    assert sum(len(gzip.compress(sent[name].encode())) for name in core) < MOST_BYTES


def test_the_custom_element_and_all_that_it_needs_take_26_kilobytes() -> None:
    sent = sent_modules()
    names = needed(sent, "element.js") | needed(sent, "volpkg.js")
    assert "core.js" in names
    assert "element_tools.js" not in names
    # Names under which core.js gives what it has are 10 to 90 bytes each, and are bundled or cached.
    assert sum(len(gzip.compress(sent[name].encode())) for name in names if len(sent[name]) > 200) < 26_000


def test_rarer_parts_are_loaded_only_when_a_package_has_them() -> None:
    modules = runtime_modules()
    later = set(modules) - needed(modules, "volpkg.js")
    assert later == {
        *("workers.js", "blocks.js", "camera.js", "clip.js", "draco.js", "edit.js", "element.js", "element_tools.js"),
        *("environment.js", "finisher.js", "rotate.js"),
        *("on_demand.js", "brick_fetch.js", "brick_index.js", "brick_pool.js", "view_loss.js"),
        *("annotations.js", "sheet.js", "slices.js", "unpack_worker.js", "values.js", "worker_loop.js"),
        *(
            "fallbacks.js",
            "fidelity.js",
            "frames.js",
            "gestures.js",
            "half_angle.js",
            "ruler.js",
            "service_worker.js",
            "stage.js",
        ),
        *(
            "finish.js",
            "halves.js",
            "kept_files.js",
            "layers.js",
            "light.js",
            "options.js",
            "schema.js",
            "light_view.js",
            "mesh.js",
            "motion_quality.js",
            "parts.js",
            "pass_targets.js",
        ),
        *(
            "pick.js",
            "points.js",
            "ranges.js",
            "messages.js",
            "segments.js",
            "upload_memory.js",
            "sha256.js",
            "skip.js",
            "store_fidelity.js",
            "strict.js",
            "subvolumes.js",
        ),
        *(
            "three.js",
            "three_backdrop.js",
            "three_camera.js",
            "three_layers.js",
            "three_page.js",
            "three_shader.js",
            "types.js",
        ),
        *("cut_light.js", "occlusion.js", "sweep.js"),
        *("techniques.js", "worker.js", "zip.js", "zstd.js"),
    }


def test_nothing_is_imported_from_elsewhere() -> None:
    for text in runtime_modules().values():
        for line in text.splitlines():
            if line.startswith(("import ", "export ")) and " from " in line:
                assert '"./' in line or 'from "three"' in line, line


def same(script: str) -> str:
    """A script with private fields numbered as they occur."""
    names: dict[str, str] = {}
    return re.sub(r"#[A-Za-z_]\w*", lambda found: names.setdefault(found[0], f"#{len(names)}"), script)


@pytest.mark.long
def test_a_stripped_module_is_the_same_program(tmp_path) -> None:
    esbuild = npm_package("esbuild", "0.25.0") / "node_modules" / "esbuild" / "bin" / "esbuild"
    for kind, modules in (("runtime", runtime_modules()), ("page", page_modules())):
        # A parser joins declarations of one kind: as they are sent, there is one kind.
        written = {name: re.sub(r"\bconst\b", "let", each) for name, each in modules.items()}
        sent = {name: stripped(each) for name, each in modules.items()}
        for form, made in (("written", written), ("stripped", sent)):
            (tmp_path / form / kind).mkdir(parents=True)
            (tmp_path / form / "package.json").write_text('{"type": "module"}')
            for name, text in made.items():
                (tmp_path / form / kind / name).write_text(text)
    for form in ("written", "stripped"):
        files = sorted((tmp_path / form).glob("*/*.js"))
        options = ("--minify-whitespace", "--minify-syntax", f"--outdir={tmp_path}/{form}-parsed")
        done = ended([esbuild, *files, *options])
        assert done.returncode == 0, done.stderr
    found = sorted((tmp_path / "written-parsed").rglob("*.js"))
    assert len(found) == len(runtime_modules()) + len(page_modules())
    for file in found:
        other = tmp_path / "stripped-parsed" / file.relative_to(tmp_path / "written-parsed")
        assert same(file.read_text()) == same(other.read_text()), file.name


@pytest.mark.long(keep=3)
@pytest.mark.parametrize(
    ("script", "expected"),
    [
        ("a = b // c\n/ d", "a=b\n/d\n"),
        ("x = /[/*]'`/.test(y) /* z */ / 2;", "x=/[/*]'`/.test(y)/2;\n"),
        ("return /'/g", "return/'/g\n"),
        ("`a // ${ b + `c ${ { d: 1 }.d } /* e */` } f  g`", "`a // ${b+`c ${{d:1}.d} /* e */`} f  g`\n"),
        ("a + +b - -c + ++d", "a+ +b- -c+ ++d\n"),
        ("\"// no\" + '/* no */'", "\"// no\"+'/* no */'\n"),
        ("let a = 1\nlet b = 2\n\n(c)()", "let a=1\nlet b=2\n(c)()\n"),
        ("(/** @type {any} */ (gl)).x; f(/** @type {Y} */ (a.b).c)", "(gl).x;f(a.b.c)\n"),
        ("f /** @type {Y} */ (a)", "f (a)\n".replace(" ", "")),
        ("class A { #long = 1; get b() { return `${this.#long}` } }", "class A{#a=1;get b(){return`${this.#a}`}}\n"),
        ("if (a) {\n  b();\n}\nc = { d: 1 }\ne()", "if(a){b()}c={d:1}\ne()\n"),
        ("f(() => {\n  b();\n})\nclass A {\n  m() {}\n  n() {}\n}\nx()", "f(()=>{b()})\nclass A{m(){}n(){}}\nx()\n"),
        ("function f() { a(); }", "function f(){a()}\n"),
        ("{ while (a()); } { for (;;) { b(); } }", "{while(a());}{for(;;){b()}}\n"),
        ("const a = `${b.const}`; a;", "let a=`${b.const}`;a;\n"),
        ("1 .toFixed(); x in y", "1 .toFixed();x in y\n"),
    ],
)
def test_comments_and_spaces_go_and_nothing_else(script: str, expected: str) -> None:
    assert stripped(script) == expected


@pytest.mark.parametrize("script", ["} / 2", '"open', "`open ${a", "x = /open", "{", "x = function () {}"])
def test_what_may_mean_two_things_is_refused(script: str) -> None:
    with pytest.raises(ScriptError):
        stripped(script)


def test_the_folder_for_npm_has_what_is_sent(tmp_path) -> None:
    command = [sys.executable, ROOT / "tools" / "npm_folder.py", tmp_path / "volpkg"]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    listed = subprocess.run(
        ["npm", "pack", "--dry-run", "--json"], cwd=tmp_path / "volpkg", capture_output=True, text=True, check=True
    )
    names = {each["path"] for each in json.loads(listed.stdout)[0]["files"]}
    assert {"core.js", "volpkg.js", "three.js", "zstd.js", "README.md", "LICENSE", "package.json"} <= names
    script = f'const m = await import("{tmp_path}/volpkg/volpkg.js"); console.log(Object.keys(m).sort().join())'
    done = subprocess.run(["node", "--input-type=module", "-e", script], capture_output=True, text=True, check=True)
    assert done.stdout == "Package,Renderer,VolpkgError,createRenderer,openPackage\n"
