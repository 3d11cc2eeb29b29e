"""What formats/js says is what the catalogue of diagnostics says, and its types hold."""

import json
import re
from pathlib import Path

import pytest
from command_line import ended
from npm_package import npm_package

from volprep_formats.diagnostics import CATALOGUE

JS = Path(__file__).parents[2] / "formats" / "js"


def node(script: str) -> str:
    done = ended(["node", "--input-type=module", "-e", script], timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_each_code_has_the_words_of_the_catalogue() -> None:
    await_words = f'(await import("{JS}/core/error.js")).WORDS'
    script = f'await import("{JS}/core/messages.js"); console.log(JSON.stringify({await_words}))'
    words = json.loads(node(script))
    assert words == {code: [CATALOGUE[code].summary, CATALOGUE[code].remedy] for code in words}
    assert len(words) > 20


def test_each_code_that_is_thrown_has_words_and_the_other_way_round() -> None:
    thrown = {code for file in JS.rglob("*.js") for code in re.findall(r'"(VP\d{4})"', file.read_text())}
    listed = "".join((JS / "core" / name).read_text() for name in ("error.js", "messages.js"))
    assert thrown == set(re.findall(r"^  (VP\d{4}):", listed, re.MULTILINE))


@pytest.fixture(scope="module")
def typescript() -> str:
    return str(npm_package("typescript", "7.0.2") / "node_modules" / "typescript" / "bin" / "tsc")


@pytest.mark.long
def test_types_hold_and_declarations_can_be_made(typescript, tmp_path) -> None:
    three = npm_package("@types/three", "0.187.0") / "node_modules" / "@types" / "three"
    options = {
        "skipLibCheck": True,
        "rootDir": str(JS),
        "outDir": str(tmp_path / "types"),
        "paths": {"three": [str(three)]},
    }
    settings = {"extends": str(JS / "tsconfig.json"), "compilerOptions": options, "include": [f"{JS}/**/*.js"]}
    (tmp_path / "tsconfig.json").write_text(json.dumps(settings))
    command = ["node", typescript, "-p", str(tmp_path / "tsconfig.json")]
    done = ended(command)
    assert done.returncode == 0, done.stdout
    assert "openPackage" in (tmp_path / "types" / "core" / "package.d.ts").read_text()
