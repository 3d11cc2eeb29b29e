"""Where the runtime for browsers is: the ES modules of formats/js, which an installation has inside this package."""

from pathlib import Path

_HERE = Path(__file__).parent


def runtime_folder() -> Path:
    """Return the folder of the modules."""
    installed = _HERE / "js"
    return installed if installed.is_dir() else _HERE.parent / "js"
