"""Write formats/apps/unity/VolumeRecords.cs, the records of manifests and grids in C#, from the models.

A test compares the files; run this when it fails.

    python tools/make_cs_schema.py
"""

import json
from pathlib import Path

from schema_records import Schema, schema_records

TARGET = Path(__file__).parent.parent / "formats" / "apps" / "unity" / "VolumeRecords.cs"
RECORDS = schema_records()
_PLAIN = {"integer": "long", "number": "double", "boolean": "bool", "string": "string", None: "object"}
_VALUES = {"long", "double", "bool"}
_HEAD = """// Records of a manifest, as fields of classes. Null: absent. formats/spec/fields.md describes each field.
// Written by tools/make_cs_schema.py from the models of volprep; do not edit.
namespace Volpkg {"""


def records_text() -> str:
    """Return the text of the file."""
    classes = [_class(name, record) for name, record in RECORDS.items()]
    return "\n".join([_HEAD, *classes, "}", ""])


def _class(name: str, record: Schema) -> str:
    required = record.get("required", [])
    fields = [_field(key, field, key in required) for key, field in record["properties"].items()]
    return "\n".join([f"public sealed class {name} {{", *fields, "}"])


def _field(key: str, field: Schema, is_required: bool) -> str:
    default = field.get("default")
    kind = _type(field)
    # Lists and records that are absent stay null: a class has no literal.
    known = "" if default is None or isinstance(default, (list, dict)) else f" = {json.dumps(default)}"
    may_lack = "?" if kind in _VALUES and not known and (not is_required or _is_null(field)) else ""
    return f"  public {kind}{may_lack} @{key}{known};"


def _is_null(field: Schema) -> bool:
    return any(choice.get("type") == "null" for choice in field.get("anyOf", ()))


def _type(field: Schema) -> str:
    choices = [choice for choice in field.get("anyOf", [field]) if choice.get("type") != "null"]
    if len(choices) > 1:
        return "object"
    (chosen,) = choices
    if "$ref" in chosen:
        name = str(chosen["$ref"].removeprefix("#/$defs/"))
        return name if name in RECORDS else "object"
    if chosen.get("type") == "array":
        (item,) = {_type(part) for part in chosen.get("prefixItems", [chosen.get("items", {})])}
        return f"{item}[]"
    words = [chosen["const"]] if "const" in chosen else chosen.get("enum", [])
    return "long" if words and isinstance(words[0], int) else _PLAIN[chosen.get("type")]


def main() -> None:
    TARGET.write_text(records_text(), encoding="utf-8")
    print(TARGET)


if __name__ == "__main__":
    main()
