"""A proxy mesh as a file: plain, or compressed with Draco where that pays.

Draco makes meshes of blocks 10 to 20 times smaller, but whoever reads them loads a decoder first, a quarter of a
megabyte in a browser, and then decodes: 0.2 µs a triangle on one core of a desktop, five times that on a phone.
tests/benchmarks/bench_proxy.py measures both. A clock would make other bytes on other days, so the rule has numbers.
"""

from volprep.parts.proxy.mesh import ProxyMesh
from volprep_formats.diagnostics import VolprepError
from volprep_formats.meshes import primitives_of, write_glb

DECODER_BYTES = 2**18
"""What a reader loads before it can decode."""
BYTES_PER_TRIANGLE = 6
"""What a phone receives while it decodes a triangle: 1 µs at 50 Mbit/s."""
DRACO_RULE = (
    f"where that saves more than the {DECODER_BYTES // 1024} KiB of a decoder and {BYTES_PER_TRIANGLE} bytes for each "
    "triangle, what a phone receives at 50 Mbit/s while it decodes one"
)
"""The rule in words."""
_DRACO_VERTICES = 2**14 - 1
"""Draco gives each of up to four sheets that meet at a vertex one of its own; all must have 16-bit indices."""

_EXTRAS = {
    "units": "millimetres",
    "axes": "x, y and z of the volume's index axes; the corner of its first voxel is at 0",
    "winding": "counter-clockwise from outside",
}


def mesh_file(mesh: ProxyMesh, scale_mm_xyz: tuple[float, float, float], *, may_compress: bool) -> tuple[bytes, bool]:
    """Return the bytes of the file of a mesh that is not empty, and whether it is compressed."""
    plain = write_glb(primitives_of(mesh.positions_xyz, mesh.triangles), scale_mm_xyz, _EXTRAS)
    worth = DECODER_BYTES + BYTES_PER_TRIANGLE * len(mesh.triangles)
    if not may_compress or len(plain) <= worth:
        return plain, False
    parts = primitives_of(mesh.positions_xyz, mesh.triangles, _DRACO_VERTICES)
    try:
        packed = write_glb(parts, scale_mm_xyz, _EXTRAS, draco=True)
    except VolprepError:
        # Sheets that the border of a part cuts may give it too many vertices after all.
        return plain, False
    return (packed, True) if len(packed) + worth < len(plain) else (plain, False)
