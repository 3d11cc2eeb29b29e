"""Build the documentation site in out/docs from the pages that exist, with MkDocs (mkdocs.yml).

    python tools/docs_site.py

The pages are gathered in build/docs, in the same folders as here. Links to pages and pictures work there as they do in
the checkout; a link to another file becomes its name. Three kinds of pages are added: the public functions of volprep,
the fields of each JSON Schema, and the gallery.
"""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
GATHERED = ROOT / "build" / "docs"
_PAGES = ("*.md", "docs/*.md", "formats/*/README.md", "formats/spec/*.md", "sample_specs/README.md")
_ASSETS = ("docs/pictures/*.png", "tools/docs_site.css")
_LINK = re.compile(r"`[^`\n]+`|(?<!!)\[([^\]]*)\]\(([^)#\s]+)(#[^)]*)?\)")
"""Code in a line, or a link to a file: words, path and anchor."""
_FENCED = re.compile(r"(^ *```.*?^ *```$)", re.DOTALL | re.MULTILINE)
_LIST_MARK = re.compile(r"(?:[-*]|\d+\.) +")


def pages() -> list[Path]:
    """Return the hand-written pages, relative to the checkout."""
    return sorted({path.relative_to(ROOT) for pattern in _PAGES for path in ROOT.glob(pattern)})


def site_page(text: str, page: Path) -> str:
    """Return the text of a page for the site: a link to a file that is not on the site becomes the file's name."""
    known = {ROOT / other for other in (*pages(), *_assets())}

    def link(match: re.Match[str]) -> str:
        if match[2] is None:
            return match[0]
        words, target, anchor = match[1], match[2], match[3] or ""
        path = (ROOT / page.parent / target).resolve()
        if ":" in target or path in known:
            return match[0]
        if path.name.endswith(".schema.json"):
            return f"[{words}]({target.removesuffix('.schema.json')}.md{anchor})"
        return words if "`" in words else f"`{words}`"

    parts = _FENCED.split(text)
    return _indented("".join(part if index % 2 else _LINK.sub(link, part) for index, part in enumerate(parts)))


def _indented(text: str) -> str:
    """Write lists as MkDocs reads them.

    What belongs to an item is indented by four columns, where CommonMark asks for the width of the mark. The item after
    one of several paragraphs follows an empty line.
    """
    lines: list[str] = []
    width, fenced, paragraphs = 0, False, False
    for line in text.splitlines():
        if line.startswith("```"):
            fenced = not fenced
        if line and not line.startswith(" "):
            mark = None if fenced else _LIST_MARK.match(line)
            if mark and paragraphs:
                lines.append("")
            width, paragraphs = len(mark[0]) if mark else 0, False
        belongs = width and line.startswith(" " * width)
        paragraphs = paragraphs or bool(belongs and not lines[-1])
        lines.append(" " * (4 - width) + line if belongs else line)
    return "\n".join(lines) + "\n"


def schema_page(path: Path) -> str:
    """Return a page with the fields of each record of a JSON Schema."""
    from make_spec import sections  # noqa: PLC0415 - loads the models of volprep

    schema = json.loads(path.read_text(encoding="utf-8"))
    title = schema["title"]
    records = {title: schema, **schema.get("$defs", {})}
    lines = [f"# Fields of {title}", f"All records of `formats/schemas/{path.name}`."]
    lines += [section.replace("](README.md#paths)", "](../spec/README.md#paths)") for section in sections(records)]
    return "\n\n".join(lines)


def api_page() -> str:
    """Return the page of the public functions, which MkDocs fills from their docstrings."""
    module = ast.parse((ROOT / "volprep/__init__.py").read_text(encoding="utf-8"))
    homes = {
        alias.name: node.module
        for node in ast.walk(module)
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("volprep")
        for alias in node.names
    }
    functions = (f"::: {home}.{name}\n" for name, home in sorted(homes.items()))
    return "\n".join(("# Python\n", ast.get_docstring(module) or "", *functions))


def gather() -> None:
    """Write all pages, pictures and the style sheet to an empty build/docs."""
    from gallery import write_gallery  # noqa: PLC0415 - tests load this file without its folder

    shutil.rmtree(GATHERED, ignore_errors=True)
    for page, text in _texts():
        target = GATHERED / page
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")
    for asset in _assets():
        (GATHERED / asset).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / asset, GATHERED / asset)
    write_gallery(GATHERED / "gallery")


def _texts() -> Iterator[tuple[Path, str]]:
    for page in pages():
        yield page, site_page((ROOT / page).read_text(encoding="utf-8"), page)
    for schema in sorted((ROOT / "formats" / "schemas").glob("*.schema.json")):
        yield Path("formats", "schemas", schema.name.removesuffix(".schema.json") + ".md"), schema_page(schema)
    yield Path("docs", "API.md"), api_page()


def _assets() -> list[Path]:
    return sorted(path.relative_to(ROOT) for pattern in _ASSETS for path in ROOT.glob(pattern))


def main() -> None:
    gather()
    # Without Material's advertisement of its successor.
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--clean"],
        cwd=ROOT,
        env=environment,
        check=True,
    )
    print(ROOT / "out" / "docs" / "index.html")


if __name__ == "__main__":
    main()
