"""Compare the segments of a package with what the scene and its label volume state."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from volprep.validation.witness.check import WitnessCheck
from volprep.validation.witness.independent.package import Json, read_texture
from volprep.validation.witness.independent.scan import CannotWitnessError
from volprep.validation.witness.independent.scene import WitnessedScene
from volprep.validation.witness.independent.segmentations import WitnessedSegments, read_segments
from volprep.validation.witness.independent.segments import WitnessedLook, labels_of, labels_on, look_of, looks_of
from volprep.validation.witness.read_checks import NUMPY

_COLOUR = 1e-6
_TEXEL = {"u": 1.0 / 255, "f": 2.0**-11}
"""The table of looks has bytes or half floats; square roots are off by half a step, their squares by a whole one."""


def check_segments(package: Path, manifest: Json, scene: WitnessedScene) -> Iterator[WitnessCheck]:
    """Compare volumes, styles, tints and visibility of all segments, and the labels of level 0."""
    stated = manifest["segments"]
    found = read_segments(scene.segments, scene.base, manifest["channels"][0]["source"]["info"]["grid"])
    looks = {
        segment["number"]: look_of(scene.segments, scene.names, segment["number"]) for segment in stated["segments"]
    }
    yield from _check_records(stated, found, looks)
    yield _check_outside(stated, scene)
    yield from _check_table(package, manifest, looks, float(stated["outside"]))
    yield _check_voxels(package, manifest, found)


def _check_records(stated: Json, found: WitnessedSegments, looks: dict[int, WitnessedLook]) -> Iterator[WitnessCheck]:
    """Compare what the manifest states of each segment."""
    volumes, tints, others = [], [0.0], []
    for segment in stated["segments"]:
        look, expected = looks[segment["number"]], found.volume_ml(segment["number"])
        volumes.append(abs(segment["volume_ml"] - expected) / max(expected, 1e-12))
        if look.tint is not None:
            tints.append(float(np.abs(look.tint - segment["tint"]).max()))
        others += [segment["transfer"] != look.transfer, segment["visible"] != look.visible]
        others.append(abs(segment["opacity"] - look.opacity) > _COLOUR)
    shown = {segment["name"]: segment["transfer"] for segment in stated["segments"]}
    others += [label["transfer"] != shown[name] for label in stated["labels"] for name in label["segments"][:1]]
    yield _check(
        "volumes of segments", found.labels.library, "largest difference, as a part", max(volumes), found.off_share
    )
    yield _check("tints of segments", NUMPY, "largest difference of linear light", max(tints), _COLOUR)
    yield _check("styles of segments", NUMPY, "functions, opacities and visibilities that differ", sum(others), 0)


def _check_outside(stated: Json, scene: WitnessedScene) -> WitnessCheck:
    wanted = float(scene.segments.get("outside_opacity", 1.0))
    return _check("opacity outside of segments", NUMPY, "difference", abs(stated["outside"] - wanted), _COLOUR)


def _check_table(
    package: Path, manifest: Json, looks: dict[int, WitnessedLook], outside: float
) -> Iterator[WitnessCheck]:
    """Compare the table of looks, which programs read, for labels of at most one segment."""
    stated = manifest["segments"]
    numbers = {segment["name"]: segment["number"] for segment in stated["segments"]}
    for texture in manifest["textures"]:
        if texture["role"] != "looks":
            continue
        off = [0.0]
        texels = read_texture(package, texture["file"])
        held, limit = looks_of(texels, len(stated["labels"])), _TEXEL[texels.dtype.kind]
        for label, (*tint, opacity) in zip(stated["labels"], held.tolist(), strict=True):
            if len(label["segments"]) > 1:
                continue
            look = looks[numbers[label["segments"][0]]] if label["segments"] else None
            wanted = outside if look is None else look.opacity if look.visible else 0.0
            off.append(abs(opacity - wanted))
            if look is not None and look.tint is not None and look.visible:
                off.append(float(np.abs(look.tint - tint).max()))
        yield _check(texture["name"], NUMPY, "largest difference of a tint or an opacity", max(off), limit)


def _check_voxels(package: Path, manifest: Json, found: WitnessedSegments) -> WitnessCheck:
    """Compare the numbers of segments of the voxels of level 0 that are in one segment at most."""
    stated = manifest["segments"]
    textures = [texture for texture in manifest["textures"] if texture["role"] == "labels" and texture["level"] == 0]
    grid = manifest["channels"][0]["levels"][0]["grid"]
    if len(textures) != 1 or textures[0]["shape_zyx"] != grid["shape_zyx"]:
        raise CannotWitnessError("its labels lie in a mosaic or in bricks: pictures are compared with the truth alone")
    numbers = {segment["name"]: float(segment["number"]) for segment in stated["segments"]}
    sets = [[numbers[name] for name in label["segments"]] or [0.0] for label in stated["labels"]]
    held = np.array([value[0] if len(value) == 1 else np.nan for value in sets])[
        labels_of(read_texture(package, textures[0]["file"]))
    ]
    wanted = labels_on(found.labels, grid)
    certain = ~np.isnan(wanted)
    if not certain.any():
        raise CannotWitnessError("all voxels are in several segments")
    wanted = np.where(np.isin(wanted, list(numbers.values())), wanted, 0.0)
    differing = float((held != wanted)[certain].mean())
    return _check("labels of level 0", found.labels.library, "part of the voxels with another segment", differing, 0)


def _check(item: str, by: str, what: str, found: float, limit: float) -> WitnessCheck:
    return WitnessCheck(item=item, by=by, what=what, found=float(found), limit=limit)
