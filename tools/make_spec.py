"""Write what is generated in formats/spec and sample_specs/README.md: tables of fields, and examples.

A test compares the files; run this when it fails.

    python tools/make_spec.py

In a written page a table is between the lines `<!-- fields of NAME -->` and `<!-- end -->`, and a part of a sample's
manifest between `<!-- example KEY of SAMPLE -->` and `<!-- end -->`. KEY is a key, or `textures[role=skip]` for the
first item of a list with that value; `a.b` is `b` in `a`.
"""

import json
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path

from example_manifest import example
from json_lines import json_lines
from pydantic import BaseModel
from scene_schema import scene_schema

from volprep.scene.scene import Scene
from volprep_formats.package.look import VolumeLooks, extras_of, looks_of
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid
from volprep_formats.package.profile import DeviceProfile

_ROOT = Path(__file__).parent.parent
FIELDS = _ROOT / "formats" / "spec" / "fields.md"
EXAMPLE = _ROOT / "formats" / "spec" / "example.md"
SCENES = _ROOT / "sample_specs" / "README.md"
PAGES = sorted({*FIELDS.parent.glob("*.md")} - {FIELDS, EXAMPLE})
"""Written pages of the specification, with examples."""
DOCUMENTS: dict[Path, tuple[type[BaseModel], ...]] = {
    FIELDS: (Manifest, SubvolumeGrid, VolumeLooks),
    SCENES: (DeviceProfile, Scene),
}
"""Each text with tables, and the models whose fields they list, with every record in them."""
_TABLE = re.compile(r"(<!-- fields of (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
_EXAMPLE = re.compile(r"(<!-- example (\S+) of (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)
_BASES = {"ChannelSpec": "SourceSpec"}
"""Records that have all fields of another one: their tables list the others."""
_PATTERNS = {"^[0-9a-f]{64}$": "64 hexadecimal digits", "^[a-z0-9_-]+(": "[path](README.md#paths)"}
_FIELDS_HEAD = """# Fields

Generated from the models of volprep. "If absent" gives the default of a field; "none" is no value, or an empty list or
text. [Manifest](#manifest) is `manifest.json`, [SubvolumeGrid](#subvolumegrid) is the file `grid.json` of
[sub-volumes](subvolumes.md), [VolumeLooks](#volumelooks) is the record of [looks](looks.md).
"""
_EXAMPLE_HEAD = """# An example

The manifest of a small package for OpenGL ES 3: one volume as a 3D texture, one transfer function, one program. The
comments are not part of it. [fields.md](fields.md) has every field.
"""

Schema = dict[str, object]


def generated(path: Path) -> str:
    """Return the text that a generated page should have."""
    if path == EXAMPLE:
        return f"{_EXAMPLE_HEAD}\n```jsonc\n{example()}```\n"
    if path == FIELDS:
        return "\n".join([_FIELDS_HEAD, *sections(records_of(path))])
    text = path.read_text(encoding="utf-8")
    if path in PAGES:
        return _EXAMPLE.sub(
            lambda match: f"{match[1]}\n```json\n{part_of_sample(*match.group(2, 3))}\n```\n\n{match[4]}", text
        )
    records = records_of(path)
    return _TABLE.sub(lambda match: f"{match[1]}\n{field_table(match[2], records)}\n{match[3]}", text)


def part_of_sample(key: str, sample: str) -> str:
    """JSON text of a part of the manifest of a sample package, or of its looks."""
    with zipfile.ZipFile(_ROOT / "formats" / "samples" / f"{sample}.volpkg.zip") as package:
        value = json.loads(package.read("manifest.json"))
    value |= extras_of(looks_of(Manifest.model_validate(value)))
    for name, field, wanted in re.findall(r"(\w+)(?:\[(\w+)=([\w-]+)\])?", key):
        value = value[name]
        if field:
            value = next(item for item in value if str(item.get(field)) == wanted)
    return "\n".join(json_lines({name: value}))


def sections(records: dict[str, Schema]) -> Iterator[str]:
    """Each record as a section: its name, its description and the table of its fields."""
    for name, record in records.items():
        yield f"## {name}\n"
        if "description" in record:
            yield f"{' '.join(record['description'].split())}\n"
        if record.get("properties"):
            yield field_table(name, records)


def records_of(path: Path) -> dict[str, Schema]:
    """JSON Schema of the models of a document, and of every record in them, by name."""
    records = {}
    for model in DOCUMENTS[path]:
        schema = scene_schema() if model is Scene else model.model_json_schema()
        records |= {model.__name__: schema, **schema.get("$defs", {})}
    return records


def own_fields(name: str, records: dict[str, Schema]) -> dict[str, Schema]:
    """Fields of a record that are not in the table of its base; those of tables within it have dotted names."""
    base = records[_BASES[name]]["properties"] if name in _BASES else {}
    fields = {key: field for key, field in records[name]["properties"].items() if key not in base}
    within = {
        f"{key}.{inner}": fields[key]["properties"][inner]
        for key in fields
        for inner in fields[key].get("properties", {})
    }
    return within or fields


def field_table(name: str, records: dict[str, Schema]) -> str:
    record = records[name]
    required = record.get("required", [])
    lines = ["| field | type | if absent | meaning |", "|---|---|---|---|"]
    for key, field in own_fields(name, records).items():
        absent = "not allowed" if key in required else _absent(field)
        # A description that is also that of the field's record stands only there.
        described = field if "description" in field else records[field["$ref"].removeprefix("#/$defs/")]
        lines.append(f"| `{key}` | {_type(field)} | {absent} | {' '.join(described['description'].split())} |")
    return "\n".join(lines) + "\n"


def _absent(field: Schema) -> str:
    default = field.get("default")
    if default is None:
        return "none"
    if isinstance(default, dict):
        return "defaults of its fields"
    return "none" if default in ([], "") else f"`{json.dumps(default, ensure_ascii=False)}`"


def _type(field: Schema) -> str:
    if "$ref" in field:
        name = field["$ref"].removeprefix("#/$defs/")
        return f"[{name}](#{name.lower()})"
    if "anyOf" in field:
        return " or ".join(_type(choice) for choice in field["anyOf"] if choice.get("type") != "null")
    if "const" in field:
        return f"`{json.dumps(field['const'])}`"
    if "enum" in field:
        return ", ".join(f"`{json.dumps(value)}`" for value in field["enum"])
    if field.get("type") == "array":
        return _array(field)
    return _scalar(field)


def _array(field: Schema) -> str:
    if "prefixItems" not in field:
        return f"list of {_type(field['items'])}"
    parts = [_type(part) for part in field["prefixItems"]]
    return f"{len(parts)} × ({parts[0]})" if len(set(parts)) == 1 else f"[{', '.join(parts)}]"


def _scalar(field: Schema) -> str:
    for start, text in _PATTERNS.items():
        if field.get("pattern", "").startswith(start):
            return text
    if "examples" in field:
        return ", ".join(f"`{json.dumps(word)}`" for word in field["examples"]) + ", or another word"
    low, high = field.get("minimum"), field.get("maximum")
    if low is not None and high is not None:
        return f"{field['type']}, {_bound(low)} to {_bound(high)}"
    if low is not None:
        return f"{field['type']} ≥ {low:g}"
    if "exclusiveMinimum" in field:
        return f"{field['type']} > {field['exclusiveMinimum']:g}"
    return str(field.get("type", "any"))


def _bound(value: float) -> str:
    powers = {2**31 - 1: "2³¹ − 1", 1 - 2**31: "1 − 2³¹", 2**53 - 1: "2⁵³ − 1", 1 - 2**53: "1 − 2⁵³"}
    return powers.get(value, f"{value:g}")


def main() -> None:
    for path in (FIELDS, EXAMPLE, SCENES, *PAGES):
        path.write_text(generated(path), encoding="utf-8")
        print(path)


if __name__ == "__main__":
    main()
