"""JSON for people: a value that fits into one line has one line. Keys are sorted."""

import json

WIDTH = 116


def json_lines(value: object, indent: int = 0, prefix: str = "") -> list[str]:
    """Return the lines of a value that stands `indent` spaces in, behind `prefix`."""
    flat = json.dumps(value, ensure_ascii=False, sort_keys=True)
    start = " " * indent + prefix
    if indent and len(start + flat) < WIDTH:
        return [start + flat]
    if isinstance(value, dict):
        inner = [(json.dumps(key) + ": ", value[key]) for key in sorted(value)]
        ends = "{}"
    elif isinstance(value, list):
        inner, ends = [("", element) for element in value], "[]"
    else:
        return [start + flat]
    lines = [start + ends[0]]
    for at, (name, member) in enumerate(inner):
        lines += json_lines(member, indent + 2, name)
        lines[-1] += "," if at < len(inner) - 1 else ""
    return [*lines, " " * indent + ends[1]]
