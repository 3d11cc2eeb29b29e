"""Bundle several ES modules into one inline module: a page that is opened from a disk may load no other file.

Each module becomes a function that runs once, when it is first imported, and returns its exports. Only the forms that
our own modules use are supported: imports and exports that begin a line, names in braces or `* as`, and
`import("./x.js")`. Anything else is refused, and a test bundles all shipped modules.
"""

import posixpath
import re
from collections.abc import Mapping

_COMMENT = re.compile(r"/\*\*.*?\*/", re.DOTALL)
_IMPORT = re.compile(
    r"^import\s+(?:(?:\{(?P<names>[^}]*)\}|\*\s+as\s+(?P<all>[\w$]+))\s+from\s+)?"
    r"[\"'](?P<from>[^\"'\n]+)[\"'];?[ \t]*$",
    re.MULTILINE,
)
_EXPORT_FROM = re.compile(
    r"^export\s+\{(?P<names>[^}]*)\}\s+from\s+[\"'](?P<from>[^\"'\n]+)[\"'];?[ \t]*$", re.MULTILINE
)
_EXPORT_LIST = re.compile(r"^export\s+\{(?P<names>[^}]*)\};?[ \t]*$", re.MULTILINE)
_EXPORT = re.compile(r"^export\s+(?=(?:async\s+function|function|class|const|let)\b)", re.MULTILINE)
_DECLARED = re.compile(r"(?:async\s+function\s*\*?|function\s*\*?|class|const|let)\s+([\w$]+)")
_DYNAMIC = re.compile(r"\bimport\(\s*[\"'](?P<from>\.[^\"'\n]+)[\"']\s*\)")
_BESIDE = re.compile(r"\bnew URL\(\"(\./[\w.]+)\",\s*import\.meta\.url\)")
_LEFT = re.compile(r"^[ \t]*(?:import|export)\b[^\n]*|\bimport\.meta\b|\bimport\s*\(", re.MULTILINE)
_NAME = re.compile(r"[\w$]+")


def bundle(modules: Mapping[str, str], entry: str, *, default: str | None = None) -> str:
    """Return the module `entry`, one of `modules` by address, with all its imports, as the text of one module.

    The module exports nothing, or its export `default` as its default export.

    Raises ValueError for an import of a missing module, for modules that import each other in a circle, and for an
    unsupported form of import or export.
    """
    found: dict[str, str] = {}
    # A dynamically imported module may itself import the module that needs it: it is visited after all static imports.
    waiting = [entry]
    while waiting:
        waiting += _visit(waiting.pop(0), modules, found, ())
    numbers = {address: number for number, address in enumerate(found)}
    lines = ["const $once = (make) => { let made; return () => (made ??= make()); };"]
    for address, text in found.items():
        body = re.sub(r"\$of\{([^}]*)\}", lambda match: f"$module{numbers[match[1]]}()", text)
        lines.append(f"const $module{numbers[address]} = $once(() => {{ // {address}\n{body}\n}});")
    run = f"$module{numbers[entry]}()"
    lines.append(f"{run};" if default is None else f"export default {run}.{default};")
    return "\n".join(lines) + "\n"


def _visit(address: str, modules: Mapping[str, str], found: dict[str, str], path: tuple[str, ...]) -> list[str]:
    """Add a module and all of its static imports; return its dynamic imports."""
    if address in found:
        return []
    if address in path:
        msg = f"modules import each other in a circle: {' > '.join((*path, address))}"
        raise ValueError(msg)
    if address not in modules:
        msg = f"{path[-1] if path else 'some module'} imports {address}, which is not there"
        raise ValueError(msg)
    text, imported, later = _rewritten(address, modules[address])
    for value in imported:
        later += _visit(value, modules, found, (*path, address))
    found[address] = text
    return later


def _rewritten(address: str, text: str) -> tuple[str, list[str], list[str]]:
    """Return the body of a module's function, and the addresses that it imports at once and later."""
    text = _COMMENT.sub("", text)
    imported: list[str] = []
    later: list[str] = []
    exports: dict[str, str] = {}

    def place(match: re.Match[str], to: list[str]) -> str:
        to.append(posixpath.normpath(posixpath.join(posixpath.dirname(address), match["from"])))
        return f"$of{{{to[-1]}}}"

    def import_of(match: re.Match[str]) -> str:
        module = place(match, imported)
        if match["all"]:
            return f"const {match['all']} = {module};"
        if match["names"] is None:
            return f"{module};"
        names = ", ".join(f"{theirs}: {ours}" for theirs, ours in _pairs(match["names"]))
        return f"const {{ {names} }} = {module};"

    def export_from(match: re.Match[str]) -> str:
        module = place(match, imported)
        exports.update({theirs: f"{module}.{ours}" for ours, theirs in _pairs(match["names"])})
        return ""

    def export_list(match: re.Match[str]) -> str:
        exports.update({theirs: ours for ours, theirs in _pairs(match["names"])})
        return ""

    text = _IMPORT.sub(import_of, text)
    text = _EXPORT_FROM.sub(export_from, text)
    text = _EXPORT_LIST.sub(export_list, text)
    for match in _EXPORT.finditer(text):
        declared = _DECLARED.match(text, match.end())
        assert declared is not None  # noqa: S101 - the pattern above has looked ahead
        exports[declared[1]] = declared[1]
    text = _EXPORT.sub("", text)
    # A page of one file has no worker beside it: addresses relative to nothing are errors, which the runtime catches.
    text = _BESIDE.sub(r'new URL("\1", "")', text)
    text = _DYNAMIC.sub(lambda match: f"Promise.resolve().then(() => {place(match, later)})", text)
    left = _LEFT.search(text)
    if left is not None:
        msg = f"{address}: this is not understood: {left[0][:80]}"
        raise ValueError(msg)
    given = ", ".join(f"get {name}() {{ return {value}; }}" for name, value in exports.items())
    return f"{text.strip()}\nreturn {{ {given} }};", imported, later


def _pairs(names: str) -> list[tuple[str, str]]:
    """Return the names of a list in braces, each with the one that it gets."""
    pairs = []
    for name in names.split(","):
        parts = _NAME.findall(name)
        if parts:
            pairs.append((parts[0], parts[-1]))
    return pairs
