"""Common parts of all versions of OpenGL ES: a context, errors as diagnostics, and a count of every object.

Objects live as long as the block that created them. Closing a context with a live object raises, so that the code with
the leak is found.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from volprep.render.bindings import GLError
from volprep.render.egl import Context
from volprep_formats.diagnostics import VolprepError

_CONTEXT_LOST = 0x0507


class GlObjects:
    """The objects of one context."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self.driver = context.driver
        self.live: Counter[str] = Counter()
        """Number of objects that exist, by kind."""
        self.uploaded_bytes = 0
        """Bytes of textures and meshes that were handed to the driver."""

    def close(self) -> None:
        """Check that nothing is left. Raises VP9001 if it is."""
        left = {kind: count for kind, count in self.live.items() if count}
        if left:
            raise VolprepError("VP9001", error=f"OpenGL objects were not deleted: {left}")

    @contextmanager
    def _checked(self, operation: str) -> Iterator[None]:
        """Make the context current; an error of OpenGL becomes VP5007, or VP5042 if the driver lost the context."""
        self._context.make_current()
        try:
            yield
        except GLError as error:
            if error.err == _CONTEXT_LOST or self._context.is_lost:
                raise VolprepError("VP5042", operation=operation, driver=self.driver) from error
            name = bytes(error.description or b"").decode("ascii", "replace") or str(error.err)
            raise VolprepError("VP5007", error=name, operation=operation, driver=self.driver) from error

    @contextmanager
    def _object(self, kind: str, create: Callable[[], int], delete: Callable[[int], object]) -> Iterator[int]:
        handle = int(create())
        self.live[kind] += 1
        try:
            yield handle
        finally:
            self._context.make_current()
            try:
                delete(handle)
            except GLError:
                # With the context its objects are gone.
                if not self._context.is_lost:
                    raise
            self.live[kind] -= 1

    def _require_context(self, operation: str) -> None:
        """Raise VP5042 if the driver lost the context, because its picture is then invalid."""
        if self._context.is_lost:
            raise VolprepError("VP5042", operation=operation, driver=self.driver)
