"""Every link of a page of documentation leads to a file and a heading that exist, and every table is drawn as one."""

import importlib.util
import itertools
import re
from collections import Counter
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest
from markdown_it import MarkdownIt
from markdown_it.token import Token

ROOT = Path(__file__).parents[2]


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


SITE = load("docs_site")


def tokens(text: str) -> list[Token]:
    blocks = MarkdownIt("commonmark").enable("table").parse(text)
    return [*blocks, *(token for block in blocks for token in block.children or ())]


def links(text: str) -> list[str]:
    found = (token.attrGet("href") or token.attrGet("src") for token in tokens(text))
    return [str(link) for link in found if link]


@cache
def anchors(page: Path) -> frozenset[str]:
    """Anchors of headings, as GitHub names them."""
    blocks = MarkdownIt("commonmark").parse(page.read_text(encoding="utf-8"))
    titles = [
        "".join(token.content for token in inline.children or ())
        for heading, inline in itertools.pairwise(blocks)
        if heading.type == "heading_open"
    ]
    seen: Counter[str] = Counter()
    found = set()
    for title in titles:
        slug = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
        found.add(f"{slug}-{seen[slug]}" if seen[slug] else slug)
        seen[slug] += 1
    return frozenset(found)


def dead_links(page: Path, text: str) -> list[str]:
    dead = []
    for link in links(text):
        target, _, anchor = link.partition("#")
        if ":" in target:
            continue
        path = (page.parent / target).resolve() if target else page
        if not path.exists() or (anchor and anchor not in anchors(path)):
            dead.append(link)
    return dead


@pytest.mark.parametrize("page", SITE.pages(), ids=str)
def test_every_link_leads_to_a_file_and_a_heading_that_exist(page: Path) -> None:
    assert dead_links(ROOT / page, (ROOT / page).read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("page", SITE.pages(), ids=str)
def test_no_row_of_a_table_has_become_text(page: Path) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    assert [token.map for token in tokens(text) if token.type == "inline" and "|---" in token.content] == []


def test_dead_files_and_headings_are_found() -> None:
    text = "[a](docs/GUIDE.md#levels) [b](docs/NONE.md) ![c](docs/none.png) [d](#nowhere) `[e](none.md)`"
    assert dead_links(ROOT / "README.md", text) == ["docs/NONE.md", "docs/none.png", "#nowhere"]


def test_the_site_names_files_that_are_not_on_it() -> None:
    text = "[volpkg.h](volpkg.h), [`example.c`](example.c), [spec](../spec/README.md#terms), `[x](volpkg.h)`\n"
    expected = "`volpkg.h`, `example.c`, [spec](../spec/README.md#terms), `[x](volpkg.h)`\n"
    assert SITE.site_page(text, Path("formats/c/README.md")) == expected
    schema = SITE.site_page("[s](../formats/schemas/device.schema.json)", Path("docs/GUIDE.md"))
    assert schema == "[s](../formats/schemas/device.md)\n"


def test_lists_with_several_paragraphs_are_written_as_mkdocs_reads_them() -> None:
    text = "- one\n  more\n\n  ```\n  code\n  ```\n\n  last\n- two\n\n```\n- no\n  list\n```\n"
    written = "- one\n    more\n\n    ```\n    code\n    ```\n\n    last\n\n- two\n\n```\n- no\n  list\n```\n"
    assert SITE.site_page(text, Path("README.md")) == written


def test_every_page_is_in_the_menu_of_the_site() -> None:
    menu = set(re.findall(r"[\w/.-]+\.md", (ROOT / "mkdocs.yml").read_text(encoding="utf-8")))
    schemas = {f"formats/schemas/{path.name.split('.')[0]}.md" for path in (ROOT / "formats/schemas").glob("*.json")}
    assert menu == {*map(str, SITE.pages()), *schemas, "docs/API.md", "gallery/README.md"}
