"""The table [lab] of a scene file: keys for studies, which a plan would never choose.

The key `epsilon` of the table `[lab.skip]` is the field `skip.epsilon` of `Scene`.
"""

from collections.abc import Iterator, Mapping

KEYS: Mapping[str, frozenset[str]] = {
    "bricks": frozenset(("reach",)),
    "hybrid": frozenset(("lines", "opacity")),
    "lighting": frozenset(("radius_mm",)),
    "mosaic": frozenset(("order", "gutter")),
    "proxy": frozenset(("draco", "epsilon")),
    "pyramid": frozenset(("refine",)),
    "render": frozenset(("palette_entries",)),
    "skip": frozenset(("epsilon",)),
    "slices": frozenset(("form", "layers", "palette_entries", "stacks")),
    "textures": frozenset(("channels", "flatten")),
}
"""Keys of each table that a scene file has in [lab]."""


def without_lab(tables: Mapping[str, object]) -> dict[str, object]:
    """Return the tables of a scene file with the keys of [lab] where `Scene` has them."""
    lab = tables.get("lab")
    merged = {name: table for name, table in tables.items() if name != "lab"}
    for name, keys in lab.items() if isinstance(lab, dict) else ():
        merged[name] = {**_table(tables, name), **keys}
    return merged


def misplaced(tables: Mapping[str, object]) -> Iterator[str]:
    """Describe each key that is in [lab] and belongs into its own table, or the reverse, or is for builds alone."""
    lab = _table(tables, "lab")
    if "recognised" in tables:
        yield "recognised: a build writes this key, and a scene file has none"
    source = _table(tables, "source")
    channels = source.get("channels")
    for channel in (source, *(channels if isinstance(channels, list) else ())):
        if isinstance(channel, dict) and "colour" in channel:
            yield "source.colour: a build writes this key, for the table [colour]"
    for name in KEYS:
        for key in sorted(KEYS[name] & _table(tables, name).keys()):
            yield f"{name}.{key}: this key is now in the table [lab.{name}]"
    if not isinstance(tables.get("lab", {}), dict):
        yield "lab: this is a table of tables, such as [lab.skip]"
    for name, keys in lab.items():
        for key in sorted(keys.keys() - KEYS.get(name, frozenset())) if isinstance(keys, dict) else ("",):
            yield f"lab.{name}{key and f'.{key}'}: [lab] has no such key; see {name}{key and f'.{key}'}"


def _table(tables: Mapping[str, object], name: str) -> dict[str, object]:
    table = tables.get(name)
    return table if isinstance(table, dict) else {}
