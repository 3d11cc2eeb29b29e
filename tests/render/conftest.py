"""What the tests of drawing share."""

from collections import Counter

import numpy as np
import pytest

from volprep.render.bindings import GLES1, GLES3
from volprep.render.gl import Gl

NUMBERED = ("Textures", "Buffers", "Framebuffers", "Renderbuffers")
SINGLE = ("Program", "Shader")


@pytest.fixture(autouse=True)
def no_gl_object_leaks():
    """Fail a test that leaves an OpenGL object behind: by the renderer's own count, and by what the driver was told."""
    # A patch of its own: where a test has the fixture monkeypatch, no stage is remembered, and this one only counts.
    with pytest.MonkeyPatch.context() as patch:
        yield from _counted(patch)


def _counted(monkeypatch):
    made: list[Gl] = []
    original = Gl.__init__

    def remember(self, context):
        original(self, context)
        made.append(self)

    monkeypatch.setattr(Gl, "__init__", remember)
    alive = Counter()
    for library in (GLES1, GLES3):
        watch(monkeypatch, library, alive)
    yield
    left = [dict(+gl.live) for gl in made if +gl.live]
    assert not left, f"OpenGL objects were not deleted: {left}"
    assert not any(alive.values()), f"the driver was not told to delete: {dict(alive)}"


def watch(monkeypatch, library, alive):
    """Count the objects that a library has made and not deleted."""

    def counted(name, kind, change):
        original = getattr(library, name)

        def call(*arguments):
            done = original(*arguments)
            alive[kind] += change(*arguments)
            return done

        monkeypatch.setattr(library, name, call)

    for kind in NUMBERED if library is GLES3 else NUMBERED[:1]:
        counted(f"glGen{kind}", kind, lambda count, *_: count)
        counted(f"glDelete{kind}", kind, lambda count, handles: -int(np.count_nonzero(handles[:count])))
    for kind in SINGLE if library is GLES3 else ():
        counted(f"glCreate{kind}", kind, lambda *_: 1)
        counted(f"glDelete{kind}", kind, lambda _: -1)
