"""The widget's front end as one ES module without imports, as `anywidget` needs it."""

from functools import cache
from pathlib import Path

from volprep.view.bundle import bundle
from volprep_formats.javascript import stripped
from volprep_formats.runtime import runtime_modules

_ENTRY = "widget.js"


@cache
def widget_module() -> str:
    """Return the text of the module: the custom element with all that it imports, and `render` as default export."""
    modules = {f"runtime/{name}": text for name, text in runtime_modules().items()}
    modules[_ENTRY] = Path(__file__).with_name(_ENTRY).read_text(encoding="utf-8")
    return stripped(bundle(modules, _ENTRY, default="widget"))
