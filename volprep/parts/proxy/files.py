"""Proxy meshes as files: plain, or compressed with Draco where that pays.

Draco makes meshes of blocks 10 to 20 times smaller, but a reader loads a decoder first, a quarter of a megabyte in a
browser, and then decodes: 0.2 µs a triangle on one core of a desktop, five times that on a phone.
tests/benchmarks/bench_proxy.py measures both. A clock would make other bytes on other days, so the rule has numbers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from volprep.parts.proxy.mesh import ProxyMesh
from volprep.scene.scene import DracoWish
from volprep_formats.diagnostics import VolprepError
from volprep_formats.meshes import primitives_of, write_glb

DECODER_BYTES = 2**18
"""Size of the decoder that a reader loads first."""
BYTES_PER_TRIANGLE = 6
"""Bytes that a phone receives while it decodes a triangle: 1 µs at 50 Mbit/s."""
DRACO_RULE = (
    f"where that saves more than {BYTES_PER_TRIANGLE} bytes for each triangle, what a phone receives at 50 Mbit/s "
    f"while it decodes one, and all files together save more than the {DECODER_BYTES // 1024} KiB of a decoder"
)
"""The rule in words."""
_DRACO_VERTICES = 2**14 - 1
"""Draco gives each of up to four sheets that meet at a vertex one of its own; all must have 16-bit indices."""

_EXTRAS = {
    "units": "millimetres",
    "axes": "x, y and z of the volume's index axes; the corner of its first voxel is at 0",
    "winding": "counter-clockwise from outside",
}


@dataclass(frozen=True)
class MeshFile:
    """A mesh that is not empty, as a file."""

    mesh: ProxyMesh
    """The mesh."""
    scale_mm_xyz: tuple[float, float, float]
    """Millimetres of a unit of its positions."""
    plain: bytes
    """The file without compression."""

    @property
    def decoding_bytes(self) -> int:
        """Bytes that a phone receives while it decodes the mesh."""
        return BYTES_PER_TRIANGLE * len(self.mesh.triangles)

    def packed(self) -> bytes | None:
        """Return the file with Draco; None for a mesh that Draco cannot hold in 16-bit indices."""
        parts = primitives_of(self.mesh.positions_xyz, self.mesh.triangles, _DRACO_VERTICES)
        try:
            return write_glb(parts, self.scale_mm_xyz, _EXTRAS, draco=True)
        except VolprepError:
            # Sheets that the border of a part cuts may give it too many vertices after all.
            return None

    def saved_bytes(self, packed: bytes | None) -> int:
        """Bytes that Draco saves, less `decoding_bytes`; 0 if it saves none."""
        return 0 if packed is None else max(0, len(self.plain) - len(packed) - self.decoding_bytes)


def mesh_file(mesh: ProxyMesh, scale_mm_xyz: tuple[float, float, float]) -> MeshFile:
    """Return the file of a mesh that is not empty."""
    plain = write_glb(primitives_of(mesh.positions_xyz, mesh.triangles), scale_mm_xyz, _EXTRAS)
    return MeshFile(mesh, scale_mm_xyz, plain)


def chosen_files(files: Sequence[MeshFile], draco: DracoWish) -> list[tuple[bytes, bool]]:
    """Return the bytes of each file, and whether it is compressed. A reader loads the decoder once for all of them."""
    # Files that save too little even if nothing of them is left need no trial.
    possible = sum(max(0, len(file.plain) - file.decoding_bytes) for file in files)
    if draco == "none" or (draco == "auto" and possible <= DECODER_BYTES):
        return [(file.plain, False) for file in files]
    packed = [file.packed() for file in files]
    saved = [file.saved_bytes(data) for file, data in zip(files, packed, strict=True)]
    pays = sum(saved) > DECODER_BYTES
    return [
        (data, True) if data is not None and (draco == "always" or (pays and value > 0)) else (file.plain, False)
        for file, data, value in zip(files, packed, saved, strict=True)
    ]
