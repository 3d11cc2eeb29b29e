"""Write formats/js/schema.js, the schema of manifests and grids for the reader in JavaScript, from the models.

A test compares the files; run this when it fails.

    python tools/make_js_schema.py

The file holds one table. A record is a list of its keys, each with a type; a key that may be absent ends with "?". A
type is a short text:

- `s` text, `b` true or false, `a` anything, `p` a path, `h` a digest, `c` the name of a channel, `v` a version;
- `n` a number, `P` above 0, `N` at least 0, `F` from 0 to 1, `(LOW,HIGH)` within other bounds, with `<` before a bound
  that is not allowed itself;
- `i` an integer of 32 bits, `U` at least 0, `I` at least 1, `B` from 0 to 2^53 - 1, `#(LOW,HIGH)` within other bounds;
- `=A|B` one of these words, `#=1|4` one of these integers;
- `*TYPE` a list, `*(1,4)TYPE` with so many entries, `3TYPE` a list of exactly three;
- a longer name is a record, `A/B` one of several records; `TYPE~` may be null.
"""

from pathlib import Path

from schema_records import ROLES, Schema, schema_records

TARGET = Path(__file__).parent.parent / "formats" / "js" / "schema.js"
_PATTERNS = {"^[0-9a-f]{64}$": "h", "^[a-z0-9_-]+(": "p", "^[a-z0-9][a-z0-9_-]*$": "c", "^1\\.": "v"}
_MOST = 2**31 - 1
_INTEGERS = {
    (-_MOST, _MOST, None, None): "i",
    (0, _MOST, None, None): "U",
    (1, _MOST, None, None): "I",
    (0, 2**53 - 1, None, None): "B",
}
_NUMBERS = {(None,) * 4: "n", (None, None, 0, None): "P", (0, None, None, None): "N", (0, 1, None, None): "F"}
_HEAD = """/**
 * What each record of a manifest holds. Written by tools/make_js_schema.py from the models of volprep, which says how
 * to read it; do not edit.
 */"""


def schema_text() -> str:
    """Return the text of the module."""
    table = {name: _record(record) for name, record in schema_records().items()}
    lines = [f'  {name}: "{fields}",' for name, fields in table.items()]
    return "\n".join(
        [_HEAD, "/** @type {Record<string, string>} */", "export const SCHEMA = {", *lines, "};", _roles(), ""]
    )


def _roles() -> str:
    words = "".join(f'"{role}", ' for role in ROLES).removesuffix(", ")
    return f"/** Roles of textures that this version knows. */\nexport const ROLES = [{words}];"


def _record(record: Schema) -> str:
    required = record.get("required", [])
    return "; ".join(
        f"{key}{'' if key in required else '?'}: {'*a' if key == 'stages' else _type(field)}"
        for key, field in record["properties"].items()
    )


def _type(field: Schema) -> str:
    if "$ref" in field:
        return field["$ref"].removeprefix("#/$defs/")
    if "anyOf" in field:
        choices = [choice for choice in field["anyOf"] if choice.get("type") != "null"]
        return "/".join(map(_type, choices)) + ("~" if len(choices) < len(field["anyOf"]) else "")
    values = [field["const"]] if "const" in field else field.get("enum")
    if values is not None:
        return f"{'' if isinstance(values[0], str) else '#'}={'|'.join(map(str, values))}"
    return _array(field) if field["type"] == "array" else _scalar(field)


def _array(field: Schema) -> str:
    if "prefixItems" in field:
        (kind,) = {_type(part) for part in field["prefixItems"]}
        return f"{len(field['prefixItems'])}{kind}"
    least, most = field.get("minItems", 0), field.get("maxItems", "")
    return f"*{f'({least},{most})' if least or most else ''}{_type(field['items'])}"


def _scalar(field: Schema) -> str:
    if field["type"] == "string":
        pattern = field.get("pattern", "")
        return next((name for start, name in _PATTERNS.items() if pattern.startswith(start)), "s")
    if field["type"] == "boolean":
        return "b"
    bounds = tuple(field.get(key) for key in ("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"))
    short = (_INTEGERS if field["type"] == "integer" else _NUMBERS).get(bounds)
    if short is not None:
        return short
    least, most, above, below = ("" if bound is None else str(bound) for bound in bounds)
    low, high = f"<{above}" if above else least, f"<{below}" if below else most
    return f"{'#' if field['type'] == 'integer' else ''}({low},{high})"


def main() -> None:
    TARGET.write_text(schema_text(), encoding="utf-8")
    print(TARGET)


if __name__ == "__main__":
    main()
