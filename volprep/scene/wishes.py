"""Wishes of a scene, by the names of its keys: parts that cannot have something refuse it by these names."""

from collections.abc import Callable, Iterable, Mapping

from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError


def _other_than_none(value: str) -> str | None:
    return None if value == "none" else value


_WISHES: Mapping[str, Callable[[Scene], object]] = {
    "[bricks]": lambda scene: scene.bricks,
    "[colour]": lambda scene: scene.colour,
    "[grid]": lambda scene: scene.grid,
    "[normals]": lambda scene: scene.normals,
    "[proxy]": lambda scene: scene.proxy,
    "[segments]": lambda scene: scene.segments,
    "[together]": lambda scene: scene.together,
    "editable": lambda scene: scene.editable,
    "fidelity": lambda scene: scene.fidelity,
    "lighting.baked": lambda scene: _other_than_none(scene.lighting.baked),
    "render.lighting": lambda scene: _other_than_none(scene.render.lighting),
    "skip.ranges": lambda scene: scene.skip.ranges,
    "several transfer functions": lambda scene: len(scene.transfer) > 1,
    "source.labels": lambda scene: scene.source.labels,
    "source.mask": lambda scene: scene.source.mask is not None,
    "textures.compression": lambda scene: _other_than_none(scene.textures.compression),
    "textures.flatten": lambda scene: _other_than_none(scene.textures.flatten),
    "textures.mipmaps": lambda scene: scene.textures.mipmaps,
}


def wish_among(scene: Scene, names: Iterable[str]) -> str | None:
    """Return the first of the named wishes that the scene has, with a value that is a word; None if it has none."""
    for name in names:
        value = _WISHES[name](scene)
        if value:
            return f'{name} = "{value}"' if isinstance(value, str) and "." in name else name
    return None


def refuse_any(code: str, wanted: Mapping[str, bool], **fields: object) -> None:
    """Raise `code` with the name of the first wish that the scene has."""
    for what, is_wanted in wanted.items():
        if is_wanted:
            raise VolprepError(code, what=what, **fields)


def refuse_wishes(code: str, scene: Scene, names: Iterable[str], **fields: object) -> None:
    """Raise `code` with the first of the named wishes that the scene has."""
    what = wish_among(scene, names)
    if what is not None:
        raise VolprepError(code, what=what, **fields)
