"""JavaScript accepts and refuses grids of sub-volumes as Python does."""

import copy
import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

from volprep.parts.subvolumes.cuts import cuts_along, grid_points
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.parts.subvolumes.record import (
    Subvolume,
    SubvolumeGrid,
    ViewThresholds,
    decode_grid,
    encode_grid,
)
from volprep_formats.package.texture import MosaicLayout

SHAPE_ZYX = (9, 8, 1)
SCRIPT = Path(__file__).parent / "read_grids.mjs"
Change = Callable[[dict[str, Any]], object]


def grid(*, flat: bool) -> dict[str, Any]:
    z, y, x = (cuts_along(n, 4) for n in SHAPE_ZYX)
    mosaic = MosaicLayout(
        tile_shape_yx=(4, 1),
        slices=5,
        slices_per_texel=4,
        order="overlapping",
        tiles_x=2,
        tiles_y=1,
        texture_shape_yx=(4, 2),
    )
    pieces = [Subvolume(minimum=0, maximum=9, file=f"pieces/{n}.ktx2") for n in range((len(z) - 1) * (len(y) - 1))]
    made = SubvolumeGrid(
        shape_zyx=SHAPE_ZYX,
        size=4,
        cuts_zyx=(z, y, x),
        texture_format="rgba8unorm" if flat else "r8unorm",
        dimension="2d" if flat else "3d",
        mosaic=mosaic if flat else None,
        subvolumes=tuple(pieces),
        points=grid_points((z, y, x)),
        view=ViewThresholds(),
    )
    return json.loads(encode_grid(made))


ANY: dict[str, Change] = {
    "sound": lambda _: None,
    "cut too far": lambda g: g.update(size=3),
    "ghost voxels in pieces of 6": lambda g: g.update(size=6, ghost=1),
    "ghost voxels in pieces of 5": lambda g: g.update(size=5, ghost=1),
    "two layers of ghost voxels": lambda g: g.update(size=9, ghost=2),
    "cut backwards": lambda g: g["cuts_zyx"][0].reverse(),
    "one cut": lambda g: g["cuts_zyx"].__setitem__(2, [0]),
    "last cut missing": lambda g: g["cuts_zyx"][1].pop(),
    "a piece missing": lambda g: g["subvolumes"].pop(),
    "a point missing": lambda g: g["points"].pop(),
    "a point astray": lambda g: g["points"][0].update(subvolumes=[99]),
    "another volume": lambda g: g.update(shape_zyx=[9, 9, 1]),
    "another target": lambda g: g.update(dimension="2d" if g["dimension"] == "3d" else "3d"),
    "another file": lambda g: g["subvolumes"][0].update(file="pieces/99.ktx2"),
    "an unknown whole": lambda g: g.update(whole="pieces/whole.ktx2"),
    "another format": lambda g: g.update(format="other"),
}
_ROOM = {"tile_shape_yx": [6, 1], "slices": 7, "texture_shape_yx": [6, 2]}
FLAT: dict[str, Change] = {
    "no mosaic": lambda g: g.pop("mosaic"),
    "two textures": lambda g: g["mosaic"].update(textures=2),
    "two components": lambda g: g["mosaic"].update(components_per_voxel=2),
    "one slice in a texel": lambda g: g["mosaic"].update(slices_per_texel=1),
    "one channel, overlapping": lambda g: (g["mosaic"].update(slices_per_texel=1), g.update(texture_format="r8unorm")),
    "ghost voxels with room": lambda g: (g.update(ghost=1, size=6), g["mosaic"].update(_ROOM)),
    "low tiles": lambda g: g["mosaic"].update(tile_shape_yx=[3, 1]),
    "few slices": lambda g: g["mosaic"].update(slices=3),
    "one tile, interleaved": lambda g: g["mosaic"].update(order="interleaved", tiles_x=1),
    "no tile of the last slice": lambda g: g["mosaic"].update(tiles_x=1),
    "a wide gutter": lambda g: g["mosaic"].update(gutter=1),
    "wide padding": lambda g: g["mosaic"].update(padding_yx=[0, 1]),
    "a small texture": lambda g: g["mosaic"].update(texture_shape_yx=[3, 2]),
}


def python(record: dict[str, Any], manifest: dict[str, Any]) -> str:
    """As `check` reads a grid."""
    try:
        made = decode_grid(json.dumps(record).encode(), Path("package"), "grid.json")
    except VolprepError as error:
        return error.code
    pieces = [piece.file for piece in made.subvolumes if piece.file is not None]
    same = (pieces, made.whole, made.shape_zyx) == (manifest["subvolumes"]["pieces"], None, SHAPE_ZYX)
    return "read" if same else "VP4011"


def test_javascript_and_python_take_the_same_grids() -> None:
    cases = [(flat, name, change) for flat in (False, True) for name, change in (ANY | (FLAT if flat else {})).items()]
    lines, expected = [], []
    for flat, _, change in cases:
        record = grid(flat=flat)
        pieces = [piece["file"] for piece in record["subvolumes"]]
        manifest = {
            "profile": {"api": "es3.0"},
            "grid": {"shape_zyx": list(SHAPE_ZYX)},
            "subvolumes": {"grid": "grid.json", "pieces": pieces},
        }
        changed = copy.deepcopy(record)
        change(changed)
        lines.append(json.dumps({"manifest": manifest, "grid": json.dumps(changed)}))
        expected.append(python(changed, manifest))
    done = subprocess.run(["node", SCRIPT], input="\n".join(lines) + "\n", capture_output=True, text=True, check=True)
    found = done.stdout.split()
    taken = [(name, flat) for (flat, name, _), here in zip(cases, expected, strict=True) if here == "read"]
    with_ghosts = [("ghost voxels in pieces of 6", False), ("ghost voxels with room", True)]
    assert sorted(taken) == sorted([("sound", False), ("sound", True), *with_ghosts])
    wrong = [
        (name, flat, here, there)
        for (flat, name, _), here, there in zip(cases, expected, found, strict=True)
        if here != there
    ]
    assert not wrong
