"""Write the generated parts of formats/c/volpkg.h, structs and tables of fields, from the models.

A test compares the files; run this when it fails. tools/c_names.py has the names that differ from the manifest.

    python tools/make_c_schema.py
"""

import re
import textwrap
from dataclasses import dataclass
from pathlib import Path

import c_names as names
from schema_records import Schema, schema_records

TARGET = Path(__file__).parent.parent / "formats" / "c" / "volpkg.h"
_WIDTH = 120
_INT32 = 2**31 - 1
_ASCII = str.maketrans({"·": "*", "²": "^2", "°": " degrees", "×": "x"})
_TEXTS = {"^[0-9a-f]{64}$": "digest", "^[a-z0-9_-]+(": "path", "^[a-z0-9][a-z0-9_-]*$": "label", "^1\\.": "string"}
_LONGEST_LABEL = 60


@dataclass(frozen=True)
class CType:
    """A type of the header: its name in C, and the table that reads it."""

    name: str
    """Name of its table entry, without `volpkg__`."""
    declared: str
    """Declaration of a member, with {} for its name."""
    table: str = ""
    """Definition of its entry; empty if it is written by hand."""
    uses: tuple["CType", ...] = ()
    """Types that must be defined before it."""
    struct: str = ""
    """Record whose struct must be declared before it."""
    empty: int = 0
    """Number that means null."""


def _plain(name: str, kind: str, c_type: str, bounds: str = "0, 0, 0", empty: int = 0) -> CType:
    table = f"VOLPKG__NUMBERS(volpkg__{name}, {kind}, {c_type}, {bounds})"
    return CType(name, f"{c_type} {{}};", table, empty=empty)


_DIGEST = CType("digest", "unsigned char {}[32];")
_ANY = CType("any", "int32_t {};")
_TRUTH = _plain("truth", "VOLPKG__TRUTH", "int32_t", "0, 1, 1")
_WRITTEN_TEXTS = {
    **{kind: _plain(kind, f"VOLPKG__{kind.upper()}", "const char*") for kind in ("string", "path", "label")},
    "digest": _DIGEST,
}


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def record_name(record: str) -> str:
    """Return the name of the struct of a record, without `volpkg_`."""
    return names.RECORDS.get(record, _snake(record))


def _constant(enum: str, word: str) -> str:
    signed = word.replace("-", "MINUS_", 1) if word.startswith("-") else word.replace("+", "PLUS_", 1)
    return f"VOLPKG_{enum}_{re.sub(r'[^A-Za-z0-9]', '_', signed)}".upper()


class Header:
    """The types of all records, and the text of both generated parts."""

    def __init__(self) -> None:
        self.records = schema_records()
        self.enums: dict[str, list[str]] = {}
        self.open_enums: set[str] = set()
        self.fields = {
            record: {key: self.member(f"{record}.{key}", field) for key, field in schema["properties"].items()}
            for record, schema in self.records.items()
            if not record.endswith("Repair")
        }

    # ---- types ----

    def member(self, place: str, field: Schema) -> CType:
        """Return the type of a field. Raises ValueError if the header has no such type."""
        if place in names.NOT_KEPT:
            return self._list("any_list", _ANY, 0, _INT32)
        choices = [choice for choice in field.get("anyOf", [field]) if choice.get("type") != "null"]
        found = self._type(place, choices[0])
        is_null = len(choices) < len(field.get("anyOf", choices))
        if is_null and ((found.struct and "*" not in found.declared) or place in names.POINTERS):
            return self._pointer(found)
        if is_null and found.name.endswith("_word"):
            enum = self.enums[found.name.removesuffix("_word")]
            enum.insert(0, "none") if "none" not in enum else None
        return found

    def _type(self, place: str, field: Schema) -> CType:
        if "$ref" in field:
            record = field["$ref"].removeprefix("#/$defs/")
            name = record_name(record)
            return CType(f"{_snake(record)}_record", f"volpkg_{name} {{}};", struct=names.SHARED.get(record, record))
        if place in names.GL_WORDS and "prefixItems" not in field:
            return self._gl(place)
        if place in names.OPEN_ENUMS and "examples" in field:
            return self._words(place, field["examples"], is_open=True)
        if "const" in field:
            return self._const(field["const"])
        values = field.get("enum")
        if values is not None:
            return self._words(place, values) if isinstance(values[0], str) else self._two(*values)
        return self._array(place, field) if field["type"] == "array" else self._scalar(field)

    def _array(self, place: str, field: Schema) -> CType:
        if "prefixItems" in field:
            (item,) = {self._type(place, part) for part in field["prefixItems"]}
            count = len(field["prefixItems"])
            c_type = "volpkg__list" if "LIST" in item.declared else item.declared.replace(" {}", "").removesuffix(";")
            table = f"VOLPKG__EXACTLY(volpkg__{item.name}_x{count}, volpkg__{item.name}, {count}, {c_type})"
            declared = item.declared.replace("{}", f"{{}}[{count}]")
            return CType(f"{item.name}_x{count}", declared, table, (item,), item.struct)
        item = self._type(place, field["items"])
        key = place.partition(".")[2]
        most = field.get("maxItems", names.LIMITS.get(place, names.LIMITS.get(key, _INT32)))
        return self._list("", item, field.get("minItems", 0), most)

    def _list(self, name: str, item: CType, least: int, most: int) -> CType:
        between = f"_{least}_to_{most}" if least and most < _INT32 else f"_from_{least}" if least else ""
        between = f"_to_{most}" if not least and most < _INT32 else between
        name = name or f"{item.name}_list{between}"
        table = f"VOLPKG__MANY(volpkg__{name}, volpkg__{item.name}, {least}, {most}.0)"
        kind = (
            item.declared.removesuffix(" {};")
            .replace("char*", "char* const")
            .replace("const char* const", "char* const")
        )
        return CType(name, f"VOLPKG_LIST({kind}) {{}};", table, (item,), item.struct)

    @staticmethod
    def _pointer(item: CType) -> CType:
        table = f"VOLPKG__MAYBE(volpkg__{item.name}_pointer, volpkg__{item.name})"
        declared = "const " + re.sub(r"\[\d\]", "", item.declared).replace(" {}", "* {}")
        return CType(f"{item.name}_pointer", declared, table, (item,), item.struct)

    def _words(self, place: str, words: list[str], *, is_open: bool = False) -> CType:
        enum = names.ENUMS.get(place, place.partition(".")[2])
        known = self.enums.setdefault(enum, [])
        known += [word for word in words if word not in known]
        if is_open:
            self.open_enums.add(enum)
        name = f"{_snake(place.partition('.')[0])}_{enum}" if enum == "role" else enum
        name = f"known_{name}" if enum in self.open_enums and not is_open else name
        rows = "".join(f'{{"{word}", {_constant(enum, word)}}}, ' for word in words)
        other = f"VOLPKG_{enum.upper()}_OTHER" if is_open else "0"
        kind = "VOLPKG__OPEN" if is_open else "VOLPKG__NAMED"
        return CType(f"{name}_word", f"volpkg_{enum} {{}};", self._word_table(name, kind, other, rows))

    def _gl(self, place: str) -> CType:
        rows = "".join(f'{{"{word}", {number:#06x}}}, ' for word, number in names.GL_WORDS[place].items())
        return CType("factor_word", "uint32_t {};", self._word_table("factor", "VOLPKG__NAMED", "0", rows))

    def _const(self, word: str) -> CType:
        name = f"only_{re.sub(r'[^a-z]', '_', word)}"
        return CType(f"{name}_word", "", self._word_table(name, "VOLPKG__CONST", "0", f'{{"{word}", 0}}, '))

    @staticmethod
    def _word_table(name: str, kind: str, other: str, rows: str) -> str:
        list_of = _wrapped(f"static const volpkg__named volpkg__{name}_words[] = {{{rows}{{NULL, 0}}}};", "    ")
        return f"{list_of}\nVOLPKG__WORDS(volpkg__{name}_word, {kind}, {other}, volpkg__{name}_words)"

    @staticmethod
    def _two(low: int, high: int) -> CType:
        return _plain(f"int_{low}_or_{high}", "VOLPKG__INT", "int32_t", f"{low}, {high}, {high - low}")

    def _scalar(self, field: Schema) -> CType:
        if field["type"] == "boolean":
            return _TRUTH
        if field["type"] == "string":
            return self._text(field)
        keys = ("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum")
        least, most, above, below = (field.get(key) for key in keys)
        if field["type"] == "integer":
            return self._integer(least, most)
        words = (
            [f"from_{_word(least)}"] if least is not None else [f"above_{_word(above)}"] if above is not None else []
        )
        words += [f"to_{_word(most)}"] if most is not None else [f"below_{_word(below)}"] if below is not None else []
        flags = (above is not None) + 2 * (below is not None)
        low = "-VOLPKG__HUGE" if least is above is None else f"{least if above is None else above}"
        high = "VOLPKG__HUGE" if most is below is None else f"{most if below is None else below}"
        empty = -1 if least == 0 else 0
        return _plain("_".join(["real", *words]), "VOLPKG__REAL", "double", f"{low}, {high}, {flags}", empty)

    @staticmethod
    def _integer(least: int | None, most: int | None) -> CType:
        if least is None or most is None:
            raise ValueError("an integer of a manifest needs bounds: see volprep_formats/grid.py and package/values.py")
        is_small = least >= -_INT32 and most <= _INT32
        between = f"_from_{least}" if least > -_INT32 else ""
        between += f"_to_{most}" if most < _INT32 else ""
        bounds = f"{least}.0, {most}.0, 1"
        empty = -1 if least == 0 else 0
        if is_small:
            return _plain(f"int{between}", "VOLPKG__INT", "int32_t", bounds, empty)
        return _plain(f"long{between}", "VOLPKG__LONG", "int64_t", bounds, empty)

    @staticmethod
    def _text(field: Schema) -> CType:
        pattern = field.get("pattern")
        if pattern is None and {"maxLength", "minLength"} & field.keys():
            raise ValueError(f"the header has no strings of some length: {field}")
        kind = next((kind for start, kind in _TEXTS.items() if pattern and pattern.startswith(start)), "string")
        if (pattern and kind == "string" and not pattern.startswith("^1")) or (
            kind == "label" and field.get("maxLength") != _LONGEST_LABEL
        ):
            raise ValueError(f"the header has no such strings: {field}")
        return _WRITTEN_TEXTS[kind]

    # ---- declarations ----

    def declarations(self) -> str:
        """Return the enums and structs of all records."""
        made: dict[str, str] = {}
        for record in self.fields:
            self._declare(record, made)
        enums = "\n".join(map(self._enum, sorted(self.enums)))
        return f"{enums}\n" + "\n".join(made.values())

    def _enum(self, enum: str) -> str:
        words = [_constant(enum, word) for word in self.enums[enum]]
        if enum in self.open_enums:
            words.append(f"VOLPKG_{enum.upper()}_OTHER /* of a later version: ignore it */")
        return _wrapped(f"typedef enum volpkg_{enum} {{ {', '.join(words)} }} volpkg_{enum};", "    ")

    def _declare(self, record: str, made: dict[str, str]) -> None:
        if record in made or record in names.SHARED:
            return
        fields = self.fields[record]
        added = names.ADDED.get(record, ())
        used = {f"volpkg_{record_name(field)}": field for field in self.fields}
        pointed = [used[word] for line, _ in added for word in re.findall(r"volpkg_\w+", line) if word in used]
        for struct in [*(member.struct for member in fields.values() if member.struct), *pointed]:
            self._declare(struct, made)
        properties = self.records[record]["properties"]
        lines = [
            line
            for key, member in fields.items()
            if member.declared
            for line in self._declared(record, key, member, properties[key])
        ]
        for declared, comment in added:
            lines += [*_comment(comment, "    "), f"    {declared}"]
        name = f"volpkg_{record_name(record)}"
        about = _comment(self.records[record]["description"], "")
        made[record] = "\n".join(["", *about, f"typedef struct {name} {{", *lines, f"}} {name};"])

    def _declared(self, record: str, key: str, member: CType, field: Schema) -> list[str]:
        shared = [value for value, struct in names.SHARED.items() if struct == record]
        about = field.get("description", self.records.get(member.struct, {}).get("description", ""))
        null = self._null_text(f"{record}.{key}", member, field)
        if any(key not in self.fields[struct] for struct in shared):
            null = f" All zero in a {' or '.join(map(_snake, shared))} of another kind."
        declared = member.declared.format(self._name(record, key).partition(".")[0])
        if self._is_text(key, member):
            declared = declared.replace("const char*", "volpkg_text")
        return [*_comment(about + null, "    "), f"    {declared}"]

    def _null_text(self, place: str, member: CType, field: Schema) -> str:
        if not _is_nullable(field):
            return ""
        if "const char*" in member.declared and member.name != "path" and place not in names.NULL_TEXTS:
            return ' "" if absent.'
        if "*" in member.declared:
            return " NULL if absent."
        if member.name.endswith("_word") or "[" in member.declared:
            return ""
        return f" {self._absent(place, member, field)} if absent."

    # ---- tables ----

    def tables(self) -> str:
        """Return the tables that read records."""
        made: dict[str, str] = {}
        for record in self.fields:
            self._tabulate(record, made)
        return "\n".join(text for text in made.values() if text)

    def _tabulate(self, record: str, made: dict[str, str]) -> None:
        name = f"{_snake(record)}_record"
        if name in made:
            return
        fields = self.fields[record]
        for member in fields.values():
            self._define(member, made)
        required = self.records[record].get("required", [])
        rows, values = [], []
        for key, member in fields.items():
            field = self.records[record]["properties"][key]
            flags = ["VOLPKG__NEEDED"] * (key in required) + ["VOLPKG__NULLABLE"] * _is_nullable(field)
            flags += ["VOLPKG__NO_TEXT"] * (f"{record}.{key}" in names.NULL_TEXTS)
            default = self._default(record, key, member, field)
            if default.startswith("{"):
                array = f"volpkg__{_snake(record)}_{key}"
                values.append(f"static const double {array}[] = {default};")
                default = f"0, {array}"
            offset = f"offsetof(volpkg_{record_name(record)}, {self._name(record, key)})" if member.declared else "0"
            absent = default if "," in default else f"{default}, NULL"
            row = f'    {{"{key}", &volpkg__{member.name}, {offset}, {" | ".join(flags) or 0}, {absent}}},'
            rows.append("\n".join(textwrap.wrap(row, _WIDTH, subsequent_indent="     ")))
        table = f"static const volpkg__field volpkg__{_snake(record)}_fields[] = {{"
        entry = f"VOLPKG__RECORDS(volpkg__{name}, volpkg_{record_name(record)}, volpkg__{_snake(record)}_fields)"
        made[name] = "\n".join([*values, table, *rows, "    VOLPKG__END};", entry])

    def _define(self, member: CType, made: dict[str, str]) -> None:
        for used in member.uses:
            self._define(used, made)
        if member.name.endswith("_record"):
            (record,) = (struct for struct in self.fields if f"{_snake(struct)}_record" == member.name)
            self._tabulate(record, made)
        made.setdefault(member.name, member.table)

    def _default(self, record: str, key: str, member: CType, field: Schema) -> str:
        """Return the number, or the numbers in braces, of an absent field."""
        default = field.get("default")
        if member.name.endswith("_word"):
            enum = member.declared.removeprefix("volpkg_").removesuffix(" {};")
            return _constant(enum, default) if isinstance(default, str) and member.declared else "0"
        if isinstance(default, list) and any(default):
            return "{" + ", ".join(f"{value}" for value in default) + "}"
        if isinstance(default, str) and default not in ("", "1.0"):
            return "0, " + f'"{default}"'
        return f"{self._absent(f'{record}.{key}', member, field)}"

    @staticmethod
    def _absent(place: str, member: CType, field: Schema) -> float:
        default = field.get("default")
        if _is_nullable(field) and default is None:
            return names.ABSENT.get(place, member.empty)
        return float(default) if isinstance(default, bool | int | float) else 0

    def _name(self, record: str, key: str) -> str:
        name = names.MEMBERS.get(f"{record}.{key}", names.MEMBERS.get(key, key))
        return f"{name}.path" if self._is_text(key, self.fields[record][key]) else name

    @staticmethod
    def _is_text(key: str, member: CType) -> bool:
        return member.name == "path" and key in names.TEXTS


def _word(number: float) -> str:
    return f"{number:g}".replace(".", "_").replace("-", "minus_")


def _is_nullable(field: Schema) -> bool:
    return any(choice.get("type") == "null" for choice in field.get("anyOf", []))


def _comment(text: str, indent: str) -> list[str]:
    plain = " ".join(text.translate(_ASCII).split())
    if not plain.isascii() or "*/" in plain:
        raise ValueError(f"a comment in C is ASCII: {text}")
    return textwrap.wrap(f"/* {plain} */", _WIDTH, initial_indent=indent, subsequent_indent=f"{indent}   ")


def _wrapped(text: str, indent: str) -> str:
    """Break a long line at spaces, but not within an entry in braces."""
    kept = re.sub(r"\{(\"|NULL)[^{}]*\}", lambda entry: entry[0].replace(" ", "\0"), text)
    lines = textwrap.wrap(kept, _WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines).replace("\0", " ")


def generated_parts() -> dict[str, str]:
    """Return each generated part by its name."""
    header = Header()
    return {"records": header.declarations(), "tables": header.tables()}


def header_text(old: str) -> str:
    """Return the header with its generated parts replaced."""
    for name, part in generated_parts().items():
        begin = f"/* ==== {name}, written by tools/make_c_schema.py: do not edit ==== */\n/* clang-format off */\n"
        end = f"\n/* clang-format on */\n/* ==== end of {name} ==== */\n"
        before, mark, rest = old.partition(begin)
        _, closing, after = rest.partition(end)
        if not mark or not closing:
            raise ValueError(f"{TARGET} has no lines that mark its {name}")
        old = before + begin + part + end + after
    return old


def main() -> None:
    TARGET.write_text(header_text(TARGET.read_text(encoding="utf-8")), encoding="utf-8")
    print(TARGET)


if __name__ == "__main__":
    main()
