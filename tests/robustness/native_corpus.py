"""The sound files that `make fuzz-native` damages, made by the generators of the tests.

Usage: python -m tests.robustness.native_corpus FOLDER. It writes FOLDER/header and FOLDER/vdb.
"""

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian, RLELossless

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "tests" / "support"))

from dicom_files import compressed, image, nested, save  # noqa: E402 - found by the line above
from vdb_files import HandGrid, write_vdb_by_hand  # noqa: E402

EYE = np.eye(4).tolist()


def dicom_headers(folder: Path) -> None:
    """Slices of the plain syntaxes, with and without sequences of unknown length."""
    folder.mkdir(parents=True, exist_ok=True)
    for syntax in (ExplicitVRLittleEndian, ImplicitVRLittleEndian, RLELossless):
        for depth in (0, 1, 3):
            data = image(np.arange(12, dtype=np.int16).reshape(3, 4), (1.0, 2.0, 3.0), RescaleSlope="2")
            data.add_new(0x00290010, "LO", "SIEMENS CSA HEADER")
            data.add_new(0x00291010, "OB", bytes(40))
            if depth:
                data.ReferencedImageSequence = nested(depth)
                data["ReferencedImageSequence"].is_undefined_length = syntax != ImplicitVRLittleEndian
            if syntax == RLELossless:
                data = compressed(data, syntax)
            save(data, folder / f"{syntax.name.split()[0]}-{depth}".lower(), syntax)


def vdb_files(folder: Path) -> None:
    """Grids of leaves, as the library writes them, and grids of tiles, written by hand."""
    from volprep_formats import _vdb

    folder.mkdir(parents=True, exist_ok=True)
    for side in (3, 9):
        fog = _vdb.FogVolume("density", EYE)
        fog.add(0, np.random.default_rng(side).normal(size=(side, side, side)).astype(np.float32))
        fog.write(str(folder / f"leaves-{side}.vdb"))
    empty = HandGrid({}, background=2.0)
    write_vdb_by_hand(folder / "empty.vdb", empty, HandGrid({}, name="other", kind="double"))
    write_vdb_by_hand(folder / "tiles.vdb", HandGrid({(0, 0, 0): 1.0, (31, 31, 31): 2.0}))
    for compression in (1, 4):
        packed = HandGrid({(0, 0, 0): 1.0}, compression=compression)
        write_vdb_by_hand(folder / f"compression-{compression}.vdb", packed)
    write_vdb_by_hand(folder / "doubles.vdb", HandGrid({(1, 2, 3): 0.1}, kind="double", corner_xyz=(-4096, 0, 4096)))


def main() -> None:
    """Write all of them."""
    folder = Path(sys.argv[1])
    dicom_headers(folder / "header")
    if find_spec("volprep_formats._vdb"):
        vdb_files(folder / "vdb")


if __name__ == "__main__":
    main()
