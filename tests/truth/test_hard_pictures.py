"""Hard cases of pictures of other media: faint and dense, by every technique, at every level, with every step.

The truth is the oracle's integral of what the package holds. `volprep study stress` has the hard cases of one scan.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from channel_scene import write_channel_scene
from colour_scene import write_colour_scene
from phantom_scene import write_phantom_scene
from scene_builds import built
from web_scenes import segments_scene

from volprep.lab.stress.combinations import Way, in_way
from volprep.lab.stress.drawing import ROUNDING, STEP_RATIOS, VIEWS
from volprep.lab.stress.records import StressDrawing, StressPoint
from volprep.render.renderer import Renderer
from volprep.techniques import TECHNIQUES
from volprep.truth.decoded import level_volume
from volprep.truth.laws import broken_laws
from volprep.validation.run import _together
from volprep.validation.subjects.labelled import LabelledSubject
from volprep.validation.subjects.scan import find_scan
from volprep.validation.subjects.subject import Subject, errors
from volprep_formats.arrays import FloatArray
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.parts.segments.texels import held_labels
from volprep_formats.package.program import TechniqueName
from volprep_formats.package.reader import Package

_PIXELS = 32
_DENSE = Tolerance(rmse=0.06, maximum=1.0)
"""Of surfaces sharper than an entry of the table: it is that of the silhouettes of one scan."""
_LEVELS = '\n[pyramid]\ncoarsest_longest_axis = 9\nfilter = "box"\n'


@dataclass(frozen=True)
class Medium:
    """A scene, and the name of its picture."""

    write: Callable[[Path], Path]
    picture: str


def _segments(border: str, lighting: str) -> Callable[[Path], Path]:
    tables = f'border = "{border}"\n[render]\nlighting = "{lighting}"\n[lighting]\nlight_mm = [-60.0, -80.0, 40.0]\n'
    return segments_scene("gles3", tables)


def _channels(folder: Path) -> Path:
    return write_channel_scene(folder, more='[together]\nname = "body"\ntransfers = ["white", "red"]\n')


def _baked(folder: Path) -> Path:
    return write_phantom_scene(folder, more='[lighting]\nbaked = "occlusion"\n')


MEDIA = {
    "crisp segments, headlight": Medium(_segments("crisp", "headlight"), "segments"),
    "mixed segments, phong": Medium(_segments("mixed", "phong"), "segments"),
    "two channels": Medium(_channels, "body"),
    "colour": Medium(write_colour_scene, "colour"),
    "occlusion": Medium(_baked, "shell"),
}


def _subject(package: Package, picture: str) -> Subject:
    """Return the subject of a picture, whose truth is that of the package's data."""
    if package.manifest.segments is not None:
        labels = held_labels(package.manifest.textures, 0, package.read_bytes)
        return LabelledSubject(package, level_volume(package, 0), _PIXELS, labels, package.manifest.segments)
    parts = channel_packages(package)
    channels = {name: Subject(part, level_volume(part, 0), _PIXELS) for name, part in parts.items()}
    subjects = [*_together(package, channels, find_scan(package.path, None)), *channels.values()]
    return next(found for found in subjects if any(program.transfer == picture for program in found.programs))


def _drawings(subject: Subject, picture: str, limit: Tolerance) -> Iterator[StressDrawing]:
    (program,) = (program for program in subject.programs if program.transfer == picture)
    for level in subject.levels(program):
        truths = {view: subject.on_table(picture, view, level).rgba for view in VIEWS}
        for technique in (name for name, found in TECHNIQUES.items() if found.order is None):
            way = Way(technique, program.compositing, program.classification, program.sampling)
            if way.is_possible:
                same = technique == program.technique
                package = subject.package if same else in_way(subject.package, program, way)
                # A level for previews takes longer steps.
                allowed = limit.of_previews if level else limit
                yield _drawing(package, subject, picture, way.technique, level, truths, allowed)


def _drawing(  # noqa: PLR0917 - how a picture is drawn, and its truth
    package: Package,
    subject: Subject,
    picture: str,
    technique: TechniqueName,
    level: int,
    truths: Mapping[str, FloatArray],
    limit: Tolerance,
) -> StressDrawing:
    with Renderer(package, level=level, transfer=picture, target="rgba32f") as renderer:
        steps_mm = [ratio * renderer.nominal_mm for ratio in STEP_RATIOS]
        drawn = {
            view: [renderer.render(subject.views[view], subject.shape_hw, step_mm) for step_mm in steps_mm]
            for view in VIEWS
        }
    pictures = np.stack([found[1] for found in drawn.values()])
    by_step = zip(
        *([errors(np.clip(one, 0.0, 1.0), truths[view]) for one in drawn[view]] for view in VIEWS), strict=True
    )
    worst = [max(views, key=lambda total: total.seen_rmse) for views in by_step]
    return StressDrawing(
        classification="lookup",
        technique=technique,
        level=level,
        total=worst[1],
        limit=limit,
        laws=tuple(broken_laws(pictures, ROUNDING["rgba32f"])),
        points=tuple(
            StressPoint(step_ratio=ratio, rmse=found.seen_rmse, draw_ms=0.0)
            for ratio, found in zip(STEP_RATIOS, worst, strict=True)
        ),
        picture=None,
    )


@pytest.mark.long
@pytest.mark.parametrize("density", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("name", MEDIA)
def test_pictures_of_every_medium_are_drawn_as_they_must_be(name: str, density: float, tmp_path: Path) -> None:
    medium = MEDIA[name]
    scene = medium.write(tmp_path)
    text = re.sub(
        r"(?<=extinction_per_mm = )[0-9.]+", lambda extinction: repr(density * float(extinction[0])), scene.read_text()
    )
    scene.write_text(re.sub(r"\n\[pyramid\]\n(?:[^\[\n]*\n)*", "\n", text) + _LEVELS)
    subject = _subject(built(scene), medium.picture)
    drawings = [*_drawings(subject, medium.picture, _DENSE if density > 1.0 else Tolerance())]
    assert {drawing.level for drawing in drawings} >= {0, 1}
    assert len({drawing.technique for drawing in drawings}) > 1
    said = [f"{name}, {drawing.technique}, level {drawing.level}: {drawing.problems}" for drawing in drawings]
    assert [words for words, drawing in zip(said, drawings, strict=True) if not drawing.passed] == []
