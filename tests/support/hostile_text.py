"""Text that attacks the page it is written into, and packages whose every free text is such a text."""

import json
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.gate import require_sound
from volprep_formats.package.manifest_json import decode_manifest
from volprep_formats.package.storage.files import MANIFEST

_TAGS = (
    '<script>window.attacked = 1; location = "{url}/1"</script><img src="{url}/2" onerror="window.attacked = 1">'
    '<svg onload="window.attacked = 1"></svg><meta http-equiv="refresh" content="0;url={url}/3"><base href="{url}/">'
    '<link rel="stylesheet" href="{url}/4"><iframe src="{url}/5"></iframe>'
    "<style>* {{ background: url({url}/6) }}</style>"
)
ATTACKS = (
    "\"'>`-->]]></script></style></title></textarea></svg>" + _TAGS,
    "<!--<script>" + _TAGS,
    "javascript:window.attacked=1//",
    "{url}/7#",
    '" autofocus onfocus="window.attacked = 1" style="background: url({url}/8)" x="',
    r"\g<9>\1 $\frac$ $x$ ${{window.attacked = 1}} {{{{ 7 * 7 }}}} {{% include 'batch.js' %}}",
)
"""Each may be written with `format(url=...)`: a request to that address has left the page."""
_WORDS = {"uniforms": {"name", "source", "type"}, "programs": {"samplers"}, "textures": {"role", "format"}}
"""Names of the shaders and words that readers look up, by list: with others nothing is drawn."""


def made_hostile(package: Path, attack: str) -> int:
    """Write `attack` before every text of a manifest that a reader leaves free; return the number of texts."""
    manifest = json.loads((package / MANIFEST).read_text(encoding="utf-8"))
    changed = 0
    for text in sorted(set(_texts(manifest))):
        tried = _replaced(manifest, lambda found, text=text: attack + text if found == text else found)
        if _is_sound(package, tried):
            manifest, changed = tried, changed + 1
    (package / MANIFEST).write_text(json.dumps(manifest), encoding="utf-8")
    return changed


def _is_sound(package: Path, manifest: object) -> bool:
    try:
        require_sound(package, decode_manifest(json.dumps(manifest).encode(), package, strict=True))
    except VolprepError:
        return False
    return True


def _texts(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            yield from _texts(each)


def _replaced(value: Any, change: Callable[[str], str], words: Collection[str] = ()) -> Any:
    if isinstance(value, str):
        return change(value)
    if isinstance(value, list):
        return [_replaced(each, change, words) for each in value]
    if isinstance(value, dict):
        inner = {
            key: each if key in words else _replaced(each, change, _WORDS.get(key, ())) for key, each in value.items()
        }
        return {change(key): each for key, each in inner.items()}
    return value
