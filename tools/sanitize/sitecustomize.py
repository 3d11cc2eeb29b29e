"""Python runs this at its start where tools/sanitize.sh has put this folder into PYTHONPATH.

It makes every process, also the workers that decode foreign files, load the native modules that were built with
sanitizers, from the folder that the environment variable VOLPREP_SANITIZED names.
"""

import os
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType

FOLDERS = {
    "volprep.kernels._native": "volprep/native",
    "volprep_formats._dicom": "formats/native/dicom",
    "volprep_formats._vdb": "formats/native/vdb",
}


class Sanitized:
    """Finds the three modules, and nothing else."""

    @staticmethod
    def find_spec(
        name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return where a module is; None for all others, and for one that this build does not have."""
        if name not in FOLDERS:
            return None
        folder = Path(os.environ["VOLPREP_SANITIZED"], FOLDERS[name])
        (file, *_) = *folder.glob(f"{name.rpartition('.')[2]}.*.so"), None
        return None if file is None else spec_from_file_location(name, file)


sys.meta_path.insert(0, Sanitized)
