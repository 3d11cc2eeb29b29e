"""Shared by OME-TIFF and OME-Zarr: selection of a channel or time point, units of length, and position.

Microscopes know no patient: rows go along +y and columns along +x of the patient's space, as in a raw file.
"""

import math
from collections.abc import Sequence
from pathlib import Path

from volprep_formats.diagnostics import Lines, VolprepError
from volprep_formats.grid import LONGEST_AXIS, Grid

MOST_VOXELS = 2**34
"""Most voxels that a volume may have; a store of a few bytes can declare any number."""
_MOST_LISTED = 40
_PREFIX_MM = {"pico": 1e-9, "nano": 1e-6, "micro": 1e-3, "milli": 1.0, "centi": 10.0, "deci": 100.0, "": 1000.0}
_SYMBOLS = {"pm": "pico", "nm": "nano", "µm": "micro", "μm": "micro", "um": "micro", "mm": "milli", "cm": "centi"}
_MM_PER_UNIT = (
    {f"{prefix}{metre}": mm for prefix, mm in _PREFIX_MM.items() for metre in ("meter", "metre")}
    | {symbol: _PREFIX_MM[prefix] for symbol, prefix in _SYMBOLS.items()}
    | {"dm": 100.0, "m": 1000.0, "km": 1e6, "micron": 1e-3, "angstrom": 1e-7, "Å": 1e-7, "inch": 25.4, "in": 25.4}
)


def mm_per_unit(path: Path, unit: str) -> float:
    """Millimetres of a unit of length, by the symbols of OME-XML and the names of UDUNITS-2. Raises VP1224."""
    if unit not in _MM_PER_UNIT:
        raise VolprepError("VP1224", path=path, what=f"lengths in the unit {unit[:40]!r}")
    return _MM_PER_UNIT[unit]


def chosen(path: Path, key: str, kind: str, names: Sequence[str], wanted: str | int | None) -> int:
    """Index of the one that `wanted` names, or numbers from 1; of the only one if nothing is wanted.

    A name that is also a number is a name. Raises VP1221 (several, and none is wanted) and VP1222 (no such one).
    """
    if wanted is None:
        if len(names) == 1:
            return 0
        raise VolprepError("VP1221", path=path, count=len(names), kind=kind, key=key, found=_listed(names))
    if isinstance(wanted, str):
        fits = [index for index, name in enumerate(names) if name == wanted]
        if len(fits) == 1:
            return fits[0]
        if fits or not (wanted.isascii() and wanted.isdigit() and len(wanted) < 10):
            raise VolprepError("VP1222", path=path, kind=kind, wanted=wanted[:60], key=key, found=_listed(names))
        wanted = int(wanted)
    if not 1 <= wanted <= len(names):
        raise VolprepError("VP1222", path=path, kind=kind, wanted=wanted, key=key, found=_listed(names))
    return wanted - 1


def grid_of(
    path: Path,
    shape_zyx: tuple[int, int, int],
    spacing_mm_zyx: Sequence[float | None],
    origin_mm_zyx: Sequence[float] = (0.0, 0.0, 0.0),
) -> tuple[Grid, list[str]]:
    """Return the grid and remarks; a distance that the file does not give is None.

    Without any distance, 1 mm is assumed, as for pictures. An axis of one voxel takes the distance of its neighbour
    axis. Raises VP1225 for an implausible size, VP1227 when some distances are missing or invalid.
    """
    if math.prod(shape_zyx) > MOST_VOXELS or max(shape_zyx) > LONGEST_AXIS:
        size = "×".join(str(n) for n in reversed(shape_zyx))
        raise VolprepError("VP1225", path=path, size=f"{size} voxels", limit=f"{MOST_VOXELS} voxels")
    given = [h for h in spacing_mm_zyx if h is not None]
    if not given:
        return Grid.of(shape_zyx, (1.0, 1.0, 1.0)), [
            "the file does not say how far apart its voxels are; 1 mm is assumed"
        ]
    remarks = []
    spacing: list[float] = []
    for axis, n, told in zip("ZYX", shape_zyx, spacing_mm_zyx, strict=True):
        h = min(given) if told is None and n == 1 else told
        if h is None or not (math.isfinite(h) and h > 0.0):
            raise VolprepError("VP1227", path=path, axis=axis, found="no distance" if h is None else f"{h:g} mm")
        if told is None:
            remarks.append(f"the file gives no distance along {axis}, where there is one voxel; {h:g} mm is assumed")
        spacing.append(h)
    z, y, x = spacing
    if not all(map(math.isfinite, (*(n * h for n, h in zip(shape_zyx, spacing, strict=True)), *origin_mm_zyx))):
        raise VolprepError("VP1227", path=path, axis="Z, Y or X", found="an infinite length")
    return Grid.of(shape_zyx, (z, y, x), tuple(reversed(origin_mm_zyx))), remarks


def _listed(names: Sequence[str]) -> Lines:
    lines = [f"{number}{f': {name[:60]!r}' if name else ''}" for number, name in enumerate(names[:_MOST_LISTED], 1)]
    return Lines([*lines, f"and {len(names) - _MOST_LISTED} more"] if len(names) > _MOST_LISTED else lines)
