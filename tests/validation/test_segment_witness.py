"""A second reading of segments: it agrees with what the scene and its labels say, and with nothing else."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest

from volprep.parts.segments.looks import segments_of
from volprep.scan.segments.record import FoundSegment, FoundSegments, VoxelBox
from volprep.scene.segments import SegmentsSettings, SegmentStyle
from volprep.validation.witness.independent.scan import CannotWitnessError
from volprep.validation.witness.independent.scene import WitnessedScene, read_scene
from volprep.validation.witness.independent.segments import look_of
from volprep.validation.witness.segment_checks import check_segments
from volprep_formats.package.parts.segments.record import Segment, SegmentLabel, Segments, looks
from volprep_formats.package.parts.segments.texels import flagged, label_texels, look_texels
from volprep_formats.srgb import linear_of_srgb
from volprep_formats.textures.ktx2 import Ktx2Image, encode

SHAPE_ZYX = (7, 9, 11)
LABELS = np.random.default_rng(8).integers(0, 4, SHAPE_ZYX).astype(np.uint16)
SCENE = """
[source]
path = "scan.nii"
[[transfer]]
name = "veil"
points = [{ value = 0.0, colour = "#ffffff", opacity = 0.5 }]
[[transfer]]
name = "inside"
points = [{ value = 0.0, colour = "#ffffff", opacity = 0.5 }]
[segments]
source = "labels.nii"
outside_opacity = 0.25
[[segments.style]]
tint = "#8090a0"
[[segments.style]]
labels = [2]
tint = "#ff8040"
opacity = 0.5
transfer = "veil"
[[segments.style]]
labels = [3]
visible = false
"""
Package = tuple[Path, dict[str, Any], WitnessedScene]


def tint(colour: str) -> tuple[float, float, float]:
    red, green, blue = (float(linear_of_srgb(int(colour[k : k + 2], 16) / 255)) for k in (0, 2, 4))
    return red, green, blue


def record() -> Segments:
    def segment(number: int, transfer: str, **look: Any) -> Segment:
        volume_ml = float((number == LABELS).sum()) * 0.5 * 0.8 * 2.0 / 1000
        return Segment(name=f"segment-{number}", number=number, transfer=transfer, volume_ml=volume_ml, **look)

    found = (
        segment(1, "inside", tint=tint("8090a0")),
        segment(2, "veil", tint=tint("ff8040"), opacity=0.5),
        segment(3, "inside", visible=False),
    )
    of_label = [SegmentLabel(segments=(each.name,), transfer=each.transfer) for each in (found[1], found[0], found[2])]
    return Segments(
        transfers=("veil", "inside"),
        segments=found,
        labels=(SegmentLabel(transfer="veil"), *of_label),
        outside=0.25,
        sha256="0" * 64,
    )


HELD = np.array([0, 2, 1, 3], np.uint16)[LABELS]
"""Labels as the package numbers them: those of one transfer function are consecutive."""


def write(folder: Path, name: str, form: str, texels: np.ndarray, dimensions: int) -> dict[str, Any]:
    """Write a texture, and return its record."""
    shape = texels.shape[:3]
    (folder / name).write_bytes(b"".join(encode(Ktx2Image(form, shape, texels, dimensions))))
    return {"name": name, "file": name, "role": name, "level": 0, "shape_zyx": list(shape)}


@pytest.fixture(scope="module", params=["rgba16float", "rgba8unorm"])
def package(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Package:
    """Labels and looks of a package, its manifest, and the scene."""
    folder, form = tmp_path_factory.mktemp("segments"), request.param
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    nibabel.save(nibabel.Nifti1Image(LABELS.astype(np.uint8).T, np.diag([-0.5, -0.8, 2.0, 1.0])), folder / "labels.nii")
    grid = {
        "shape_zyx": list(SHAPE_ZYX),
        "spacing_mm_zyx": [2.0, 0.8, 0.5],
        "origin_mm_xyz": [0.0, 0.0, 0.0],
        "direction": np.eye(3).tolist(),
    }
    manifest = {
        "segments": json.loads(record().model_dump_json()),
        "channels": [{"levels": [{"grid": grid}], "source": {"info": {"grid": grid}}}],
        "textures": [
            write(folder, "labels", "r8unorm", label_texels(HELD, flagged(HELD, None), wide=False), 3),
            write(folder, "looks", form, look_texels(looks(record()), form), 2),
        ],
    }
    return folder, manifest, read_scene(folder, folder / "scene.toml", folder)


def disagreeing(package: Package, manifest: dict[str, Any] | None = None) -> list[str]:
    folder, right, scene = package
    return [check.item for check in check_segments(folder, manifest or right, scene) if not check.passed]


def test_it_agrees_with_what_is_right(package) -> None:
    assert disagreeing(package) == []


def of_all(key: str, change: Callable[[Any], Any]) -> Callable[[dict[str, Any]], None]:
    def lie(segments: dict[str, Any]) -> None:
        for each in segments["segments"]:
            each[key] = change(each[key])

    return lie


LIES: dict[str, tuple[Callable[[dict[str, Any]], None], list[str]]] = {
    "millilitres ten times": (of_all("volume_ml", lambda each: 10 * each), ["volumes of segments"]),
    "channels of tints rotated": (of_all("tint", lambda each: each[1:] + each[:1]), ["tints of segments"]),
    "hidden segments visible": (of_all("visible", lambda _: True), ["styles of segments"]),
    "functions of styles ignored": (of_all("transfer", lambda _: "inside"), ["styles of segments"]),
    "opacities ignored": (of_all("opacity", lambda _: 1.0), ["styles of segments"]),
    "outside opaque": (lambda segments: segments.update(outside=1.0), ["opacity outside of segments", "looks"]),
    "labels exchanged": (
        lambda segments: segments["labels"].insert(1, segments["labels"].pop(2)),
        ["looks", "labels of level 0"],
    ),
}


@pytest.mark.parametrize("name", LIES)
def test_it_contradicts_a_manifest_that_says_otherwise(package, name) -> None:
    lie, expected = LIES[name]
    manifest = copy.deepcopy(package[1])
    lie(manifest["segments"])
    assert disagreeing(package, manifest) == expected


def test_product_and_witness_read_the_same_looks() -> None:
    """Numbers of labels, too: those of the function that the last segment has come first."""
    styles = (
        SegmentStyle(labels=(1,), tint="#20c0ff", opacity=0.1),
        SegmentStyle(labels=(2,), tint="#ff8040", visible=False),
        SegmentStyle(labels=(3,), tint="#80ff40", transfer="veil"),
    )
    wanted = SegmentsSettings(source="s", style=styles)
    segments = [FoundSegment(number=k, name="", code=None, colour=None, volume_ml=1.0) for k in (1, 2, 3)]
    box = VoxelBox(start_zyx=(0, 0, 0), stop_zyx=(1, 1, 1))
    found = FoundSegments(
        segments=segments,
        members=((), (0,), (1,), (2,)),
        boxes=4 * (box,),
        voxels=(1, 1, 1, 1),
        blocks="",
        sha256="0" * 64,
    )
    made, numbers = segments_of(found, wanted, ("veil", "inside"), "scene")
    settings = json.loads(wanted.model_dump_json())
    for segment in made.segments:
        look = look_of(settings, ("veil", "inside"), segment.number)
        assert (segment.transfer, segment.opacity, segment.visible) == (look.transfer, look.opacity, look.visible)
        assert segment.tint == pytest.approx(tuple(look.tint))
    shown = [made.labels[number].segments for number in numbers]
    assert shown == [(), *((segment.name,) for segment in made.segments)]


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"source": "labels.nii", "smoothing_mm": 1.0}, "smoothed"),
        ({"source": "labels.nii", "style": [{"labels": ["liver"]}]}, "by words"),
    ],
)
def test_what_it_cannot_read_it_names(package, settings, reason) -> None:
    folder, manifest, scene = package
    other = WitnessedScene(sources={}, functions=(), names=scene.names, segments=settings, base=folder)
    with pytest.raises(CannotWitnessError, match=reason):
        list(check_segments(folder, manifest, other))
