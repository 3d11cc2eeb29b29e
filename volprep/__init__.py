"""volprep as a library: scans become validated volume packages.

The functions below are for programs and notebooks. Each loads its modules on first use, so that `import volprep` costs
nothing. Arrays of voxels are `[z, y, x]`, positions are millimetres in the patient's space (LPS).

- scans: `read_scan`, `list_series`, `list_channels`
- packages: `plan_package`, `build_package`, `validate_package`, `check_package`, `open_package`, `read_level`
- pictures: `render_package`, `list_presets`
- notebooks: `show`, `from_pyvista`; they need the extra `notebook`
- `__version__`
- `VolprepError`: raised by all of them; `code`, `summary` and `remedy` describe the problem
"""

from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from volprep.library.notebook.from_pyvista import from_pyvista as from_pyvista
    from volprep.library.notebook.show import show as show
    from volprep.library.packages import build_package as build_package
    from volprep.library.packages import check_package as check_package
    from volprep.library.packages import open_package as open_package
    from volprep.library.packages import plan_package as plan_package
    from volprep.library.packages import validate_package as validate_package
    from volprep.library.pictures import list_presets as list_presets
    from volprep.library.pictures import render_package as render_package
    from volprep.library.scans import list_channels as list_channels
    from volprep.library.scans import list_series as list_series
    from volprep.library.scans import read_level as read_level
    from volprep.library.scans import read_scan as read_scan
    from volprep_formats.diagnostics import VolprepError as VolprepError

_HOME = {
    "VolprepError": "volprep_formats.diagnostics",
    "build_package": "volprep.library.packages",
    "check_package": "volprep.library.packages",
    "from_pyvista": "volprep.library.notebook.from_pyvista",
    "list_channels": "volprep.library.scans",
    "list_presets": "volprep.library.pictures",
    "list_series": "volprep.library.scans",
    "open_package": "volprep.library.packages",
    "plan_package": "volprep.library.packages",
    "read_level": "volprep.library.scans",
    "read_scan": "volprep.library.scans",
    "render_package": "volprep.library.pictures",
    "show": "volprep.library.notebook.show",
    "validate_package": "volprep.library.packages",
}
"""Each public name, and the module that is loaded when it is asked for (PEP 562). A test compares with the imports."""


def __getattr__(name: str) -> object:
    if name == "__version__":
        return version("volprep")
    if name == "__all__":
        return ["__version__", *_offered()]
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    found: object = getattr(import_module(_HOME[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_offered()})


def _offered() -> list[str]:
    """Return the public names that load here: `help` and `import *` load all of them."""
    lacks_notebook = find_spec("anywidget") is None
    return [name for name, home in _HOME.items() if not (lacks_notebook and ".notebook." in home)]
