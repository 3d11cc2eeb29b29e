"""Default look of a label map: it is drawn as the segments of itself, so that labels are lit and an app switches them.

The light of labels is that of their borders. The numbers of labels are drawn by a function of one value.
"""

from volprep.scene.label_look import LABEL_OPACITY, LABEL_SHARE
from volprep.scene.points import ScenePoint
from volprep.scene.scene import Scene
from volprep.scene.segments import SegmentsSettings
from volprep.scene.transfer import SceneTransfer
from volprep_formats.package.channel import Statistics
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.source import SourceSpec

_OF_ALL = frozenset(("name", "source", "transfer", "recognised"))
"""Settings of a scan without a scene."""
_NOTHING, _LABELS = "nothing", "labels"


def can_light_labels(scene: Scene, profile: DeviceProfile) -> bool:
    """Return whether a label map without a scene can be drawn as segments: of a plain file, with 3D textures."""
    source = scene.source
    is_plain = source == SourceSpec(path=source.path, labels=True, label_table=source.label_table)
    return is_plain and scene.model_fields_set <= _OF_ALL and profile.has_shaders and profile.max_3d_texture_size > 0


def as_segments_of_itself(scene: Scene) -> Scene:
    """Return the scene of a label map with the map as a scan and its segments."""
    source = scene.source
    segments = SegmentsSettings(source=source.path, table=source.label_table, inside=_LABELS, outside=_NOTHING)
    return scene.with_source(SourceSpec(path=source.path)).with_segments(segments)


def is_segments_of_itself(scene: Scene) -> bool:
    """Return whether the scan and its segments are one label map."""
    return scene.segments is not None and scene.segments.source == scene.source.path


def with_lit_labels(scene: Scene, statistics: Statistics) -> Scene:
    """Return the scene with functions that show the labels alike, and light."""
    low, high = statistics.minimum, max(statistics.maximum, statistics.minimum + 1.0)
    nothing = (ScenePoint(value=low, colour="#000000", extinction_per_mm=0.0),)
    every = tuple(ScenePoint(value=value, colour="#ffffff", opacity=LABEL_OPACITY) for value in (low, high))
    functions = (
        SceneTransfer(name=_NOTHING, points=nothing),
        SceneTransfer(name=_LABELS, points=every, reference_share=LABEL_SHARE),
    )
    render = scene.render.model_copy(update={"lighting": "headlight", "classification": "control-points"})
    return scene.with_transfer(functions).model_copy(update={"render": render})
