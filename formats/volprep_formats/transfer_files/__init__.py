"""Transfer functions that other programs wrote: 3D Slicer (.vp), ParaView (.json), ITK-SNAP (labels, .txt).

All give points over physical values with sRGB colours and opacities. Each file is hostile until it is checked.
"""

from collections.abc import Callable
from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.regular_files import read_regular
from volprep_formats.transfer_files.itksnap import read_labels
from volprep_formats.transfer_files.paraview import read_paraview
from volprep_formats.transfer_files.points import FilePoint
from volprep_formats.transfer_files.slicer import read_slicer

_READERS: dict[str, Callable[[str], list[FilePoint]]] = {
    ".vp": read_slicer,
    ".json": read_paraview,
    ".txt": read_labels,
}


def read_transfer_file(path: Path) -> list[FilePoint]:
    """Read the points of a transfer function, in ascending order, two at one value where it jumps.

    Raises VP3042 for a file that cannot be read, is larger than 1 MiB, or is not what its ending says.
    """
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise VolprepError("VP3042", path=path, problem=f"it ends in none of {', '.join(_READERS)}")
    try:
        data = read_regular(path)
    except OSError as error:
        raise VolprepError("VP3042", path=path, problem=error.strerror) from error
    try:
        return reader(data.decode("utf-8"))
    except ValueError as error:  # UnicodeDecodeError is one
        raise VolprepError("VP3042", path=path, problem=error) from error
    except RecursionError as error:
        raise VolprepError("VP3042", path=path, problem="it nests too deeply") from error
