"""Diffuse light from where the viewer is (Lambert 1760), with normals that the package holds.

What has no normal, because the gradient is zero or codes around it cancel, keeps its own colour: it is no surface.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from volprep.render.compose import literal
from volprep_formats.package.manifest import Sampler, Texture

# Linear filtering of 8-bit codes leaves about a thousandth of a zero vector.
_LEAST_LENGTH = 0.01


@dataclass(frozen=True)
class Lighting:
    """What lighting adds to a ray caster."""

    parts: Mapping[str, str | None]
    """Files of its slots."""
    constants: Mapping[str, str]
    """Words that these files use."""
    sampler: Sampler
    """The sampler that they declare."""


def headlight(texture: Texture) -> Lighting:
    """Light from the viewer, on normals of this kind: the same for every level that the program draws."""
    if texture.normals is None:
        msg = f"texture {texture.name} holds no normals"
        raise ValueError(msg)
    code = texture.normals.code
    return Lighting(
        parts={
            "lighting": "normals_texture3d",
            "normal_code": f"normal_{code}",
            "octahedron": "octahedron",
            "light_start": "headlight_start",
            "light": "headlight",
        },
        constants={"LEAST_SQUARED": literal(_LEAST_LENGTH**2)},
        sampler=Sampler(name="u_normals", role="normals"),
    )
