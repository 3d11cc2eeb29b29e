"""JSON Schema of scene files: that of `Scene`, with the keys of [lab] in that table."""

from typing import Any

from volprep.scene.lab import KEYS
from volprep.scene.scene import Scene, table_of

Schema = dict[str, Any]


def scene_schema() -> Schema:
    """Return the schema of scene files."""
    schema = Scene.model_json_schema()
    records, fields = schema["$defs"], schema["properties"]
    lab: Schema = {}
    # Builds write these keys.
    del fields["recognised"], records["ColourChannel"]
    for record in ("SourceSpec", "ChannelSpec"):
        del records[record]["properties"]["colour"]
    for name, keys in KEYS.items():
        record = table_of(name).__name__
        own, meaning = records[record]["properties"], records[record]["description"]
        moved = {key: own.pop(key) for key in [*own] if key in keys}
        lab[name] = {"type": "object", "additionalProperties": False, "description": meaning, "properties": moved}
        if not own:
            del records[record], fields[name]
    told = "Keys for studies, which a plan would never choose."
    records["Lab"] = {"type": "object", "additionalProperties": False, "description": told, "properties": lab}
    fields["lab"] = {"$ref": "#/$defs/Lab"}
    return schema
