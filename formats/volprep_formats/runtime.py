"""The runtime for browsers: the ES modules of formats/js, as they were written, and as they are sent.

What every package needs goes as one file, `core.js`, so that a page waits for one answer and not for eighteen. Each of
its modules is also there under its own name, and gives what core.js has: whoever imports one gets the same objects.
"""

import re
from functools import cache
from pathlib import Path

from volprep_formats.javascript import ScriptError, stripped

_HERE = Path(__file__).parent
ENTRY = "volpkg.js"
CORE = "core.js"
_IMPORT = re.compile(r"^import(?:\s+\{([^}]*)\}\s+from)?\s+\"\./([\w.]+)\";\n", re.MULTILINE)
_EXPORT_FROM = re.compile(r"^export\s+\{([^}]*)\}\s+from\s+\"\./([\w.]+)\";\n", re.MULTILINE)
_EXPORT = re.compile(
    r"^export\s+(?=(?:async\s+function\*?|function\*?|class|const)\s+([\w$]+))",
    re.MULTILINE,
)
_TOP = re.compile(r"^(?:export\s+)?(?:async\s+function\*?|function\*?|class|const|let)\s+([\w$]+)", re.MULTILINE)


def runtime_folder() -> Path:
    """Return the folder of the modules."""
    installed = _HERE / "js"
    return installed if installed.is_dir() else _HERE.parent / "js"


def runtime_modules() -> dict[str, str]:
    """Return the text of each module by its name, as it was written."""
    return {path.name: path.read_text(encoding="utf-8") for path in sorted(runtime_folder().glob("*.js"))}


@cache
def sent_modules() -> dict[str, str]:
    """Return the text of each module as pages get it, by its name. Raises ScriptError for what is not understood."""
    texts = runtime_modules()
    order: list[str] = []
    if ENTRY in texts:
        _visit(ENTRY, texts, order)
    others = {name: text for name, text in texts.items() if name not in order}
    sent = {name: stripped(text) for name, text in others.items()}
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


def _visit(name: str, texts: dict[str, str], order: list[str]) -> None:
    """Add a module behind all that it imports at once."""
    if name in order:
        return
    for _, imported in (*_IMPORT.findall(texts[name]), *_EXPORT_FROM.findall(texts[name])):
        _visit(imported, texts, order)
    order.append(name)


def _names(listed: str | None) -> list[str]:
    return [each.strip() for each in (listed or "").split(",") if each.strip()]


def _core(texts: list[str], exports: list[str]) -> str:
    """Return modules as one, in which each name at the top stands for one thing."""
    names = [name for text in texts for name in _TOP.findall(text)]
    twice = sorted({name for name in names if names.count(name) > 1})
    aliases = [each for text in texts for imported, _ in _IMPORT.findall(text) for each in imported.split(" as ")[1:]]
    if twice or aliases:
        raise ScriptError(f"modules of {CORE} have names in common, or import by other names: {twice} {aliases}")
    # Each alone: short names of private fields are then the same in all of them, which packs better.
    body = "".join(stripped(_EXPORT.sub("", _EXPORT_FROM.sub("", _IMPORT.sub("", text)))) for text in texts)
    left = re.search(r"^(?:export|import)\b.*", body, re.MULTILINE)
    if left is not None:
        raise ScriptError(f"this is not understood: {left[0][:80]}")
    return f"{body}export{{{','.join(exports)}}};\n"
