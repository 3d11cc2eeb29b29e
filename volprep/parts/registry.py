"""Every part that a package may have. A new part adds one line here; plan, stages, costs and validation loop over it.

The order is that of decisions about a channel: a part sees those before it. What channels share is decided in the
opposite order: programs say how far samples are apart, tables of colours depend on that, and channels are
drawn together, and in common texels, with their tables.
"""

from volprep.parts.bricks.part import PART as BRICKS
from volprep.parts.classification.part import PART as CLASSIFICATION
from volprep.parts.compression.part import PART as COMPRESSION
from volprep.parts.editing.part import PART as EDITING
from volprep.parts.fidelity.part import PART as FIDELITY
from volprep.parts.flattened.part import PART as FLATTENED
from volprep.parts.frames.part import PART as FRAMES
from volprep.parts.hybrid.part import PART as HYBRID
from volprep.parts.layout.part import PART as LAYOUT
from volprep.parts.levels.part import PART as LEVELS
from volprep.parts.light.part import PART as LIGHT
from volprep.parts.mosaic.part import PART as MOSAIC
from volprep.parts.normals.part import PART as NORMALS
from volprep.parts.on_demand.part import PART as ON_DEMAND
from volprep.parts.part import Part
from volprep.parts.programs.part import PART as PROGRAMS
from volprep.parts.proxy.part import PART as PROXY
from volprep.parts.segments.part import PART as SEGMENTS
from volprep.parts.skip.part import PART as SKIP
from volprep.parts.slices.part import PART as SLICES
from volprep.parts.subvolumes.part import PART as SUBVOLUMES
from volprep.parts.texture.part import PART as TEXTURE
from volprep.parts.together.part import PART as TOGETHER
from volprep.parts.values.part import PART as VALUES
from volprep_formats.package.profile import DeviceProfile

PARTS: tuple[Part, ...] = (
    FRAMES,
    TOGETHER,
    VALUES,
    LEVELS,
    COMPRESSION,
    LAYOUT,
    FLATTENED,
    CLASSIFICATION,
    NORMALS,
    LIGHT,
    MOSAIC,
    TEXTURE,
    BRICKS,
    SKIP,
    SEGMENTS,
    PROXY,
    SUBVOLUMES,
    ON_DEMAND,
    EDITING,
    SLICES,
    PROGRAMS,
    HYBRID,
    FIDELITY,
)


def parts_of(profile: DeviceProfile) -> tuple[Part, ...]:
    """Return the parts that packages for a device class may have."""
    devices = {"any", "with shaders" if profile.has_shaders else "without shaders"}
    return tuple(part for part in PARTS if part.devices in devices)
