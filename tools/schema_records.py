"""Records of manifests and grids as JSON Schema, which tools turn into the tables of other readers."""

from typing import Any, get_args

from pydantic import BaseModel

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid
from volprep_formats.package.texture import TextureRole

Schema = dict[str, Any]
ROLES: tuple[str, ...] = get_args(TextureRole)
"""Roles of textures that this version knows."""
_MODELS: tuple[type[BaseModel], ...] = (Manifest, SubvolumeGrid)
_OF_DRAFTS = {
    *("StageRecord", "Contribution", "ChannelPart", "LevelFidelity", "FrameTextures"),
    *("ComposedProgram", "Sampler", "RaySampling", "LevelStep"),
}
"""Records that drafts alone have; readers refuse drafts."""


def schema_records() -> dict[str, Schema]:
    """Return the schema of each record that a sealed package may have, sorted by name."""
    records: dict[str, Schema] = {}
    for model in _MODELS:
        schema = model.model_json_schema()
        records |= schema.pop("$defs", {})
        records[model.__name__] = schema
    return {name: record for name, record in sorted(records.items()) if name not in _OF_DRAFTS}
