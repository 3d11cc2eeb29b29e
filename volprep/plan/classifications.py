"""Classifications that a scene may have: which the plan chooses from, where the scene leaves it to the plan."""

from collections.abc import Callable

from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.program import ClassificationName

_KINDS: tuple[ClassificationName, ...] = ("lookup", "preintegrated", "control-points")
"""The first is the default, which works with everything."""


def possible_classifications(scene: Scene, require: Callable[[Scene], object]) -> tuple[ClassificationName, ...]:
    """Return what the classification of a scene may be, the default first.

    `require` raises for a scene that cannot be built.
    """
    wanted = scene.render.classification
    if wanted != "auto":
        return (wanted,)

    def is_possible(kind: ClassificationName) -> bool:
        try:
            require(scene.with_classification(kind))
        except VolprepError:
            return False
        return True

    return (_KINDS[0], *(kind for kind in _KINDS[1:] if is_possible(kind)))
