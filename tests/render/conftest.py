"""What the tests of drawing share."""

import pytest

from volprep.render.gl import Gl


@pytest.fixture(autouse=True)
def no_gl_object_leaks(monkeypatch):
    """Fail a test that leaves an OpenGL object behind."""
    made: list[Gl] = []
    original = Gl.__init__

    def remember(self, context):
        original(self, context)
        made.append(self)

    monkeypatch.setattr(Gl, "__init__", remember)
    yield
    left = [dict(+gl.live) for gl in made if +gl.live]
    assert not left, f"OpenGL objects were not deleted: {left}"
