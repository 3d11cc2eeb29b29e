"""The runtime for browsers: the ES modules of formats/js, as written and as served.

Modules that every package needs are bundled as one file, `core.js`, so that a page makes one request and not eighteen.
Each of these modules is also available under its own name and re-exports the objects of core.js; the other modules that
are served import core.js itself, so that none of them waits for a second request.
"""

import re
from functools import cache
from pathlib import Path

from volprep_formats.javascript import ScriptError, stripped

_HERE = Path(__file__).parent
ENTRY = "volpkg.js"
CORE = "core.js"
_PATH = re.compile(r'"\.{1,2}/(?:[\w.]+/)*(\w+\.js)"')
"""A module beside or in another folder of formats/js."""
_IMPORT = re.compile(r"^import(?:\s+\{([^}]*)\}\s+from)?\s+\"\./([\w.]+)\";\n", re.MULTILINE)
_EXPORT_FROM = re.compile(r"^export\s+\{([^}]*)\}\s+from\s+\"\./([\w.]+)\";\n", re.MULTILINE)
_FROM = re.compile(r"^((?:import|export)\s+\{[^}]*\}\s+from\s+)\"\./([\w.]+)\"", re.MULTILINE)
_EXPORT = re.compile(r"^export\s+(?=(?:async\s+function\*?|function\*?|class|const)\s+([\w$]+))", re.MULTILINE)
_TOP = re.compile(r"^(?:export\s+)?(?:async\s+function\*?|function\*?|class|const|let)\s+([\w$]+)", re.MULTILINE)


def runtime_folder() -> Path:
    """Return the folder of the modules."""
    installed = _HERE / "js"
    return installed if installed.is_dir() else _HERE.parent / "js"


def runtime_modules() -> dict[str, str]:
    """Return the text of each module by its name, as it was written, but for all of them in one folder."""
    paths = sorted(runtime_folder().rglob("*.js"), key=lambda path: path.name)
    return {path.name: _PATH.sub(r'"./\1"', path.read_text(encoding="utf-8")) for path in paths}


@cache
def sent_modules() -> dict[str, str]:
    """Return the text of each module as served, by name. Raises ScriptError for unsupported syntax."""
    texts = runtime_modules()
    order: list[str] = []
    if ENTRY in texts:
        _visit(ENTRY, texts, order)
    others = {name: text for name, text in texts.items() if name not in order}
    sent = {name: stripped(_from_core(text, order)) for name, text in others.items()}
    wanted: dict[str, set[str]] = {name: set() for name in order}
    for text in (texts.get(ENTRY, ""), *others.values()):
        for names, module in (*_IMPORT.findall(text), *_EXPORT_FROM.findall(text)):
            wanted.get(module, set()).update(_names(names))
    for module, names in wanted.items():
        given = _names(" ".join(f"{names}," for names, _ in _EXPORT_FROM.findall(texts[module]))) or sorted(names)
        sent[module] = f'export{{{",".join(given)}}}from"./{CORE}";\n' if given else "export{};\n"
    if order:
        sent[CORE] = _core([texts[name] for name in order], sorted(set().union(*wanted.values())))
    return sent


def _from_core(text: str, order: list[str]) -> str:
    """Import what core.js has from there."""
    return _FROM.sub(lambda found: f'{found[1]}"./{CORE if found[2] in order else found[2]}"', text)


def _visit(name: str, texts: dict[str, str], order: list[str]) -> None:
    """Add a module behind all that it imports at once."""
    if name in order:
        return
    for _, imported in (*_IMPORT.findall(texts[name]), *_EXPORT_FROM.findall(texts[name])):
        _visit(imported, texts, order)
    order.append(name)


def _names(listed: str | None) -> list[str]:
    return [word.strip() for word in (listed or "").split(",") if word.strip()]


def _core(texts: list[str], exports: list[str]) -> str:
    """Bundle modules into one, in which each top-level name has one meaning."""
    names = [name for text in texts for name in _TOP.findall(text)]
    twice = sorted({name for name in names if names.count(name) > 1})
    aliases = [word for text in texts for imported, _ in _IMPORT.findall(text) for word in imported.split(" as ")[1:]]
    if twice or aliases:
        raise ScriptError(f"modules of {CORE} have names in common, or import by other names: {twice} {aliases}")
    # Minify each module separately: private fields then get the same short names in all, which compresses better.
    body = "".join(stripped(_EXPORT.sub("", _EXPORT_FROM.sub("", _IMPORT.sub("", text)))) for text in texts)
    left = re.search(r"^(?:export|import)\b.*", body, re.MULTILINE)
    if left is not None:
        raise ScriptError(f"this is not understood: {left[0][:80]}")
    return f"{body}export{{{','.join(exports)}}};\n"
