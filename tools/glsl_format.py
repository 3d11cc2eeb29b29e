"""Check the layout of the shader parts in volprep/shading/glsl with clang-format; with --write, lay them out.

clang-format reads them as C, in the style of tools/glsl.clang-format. Words of templates are hidden from it:
`${P}PITCH` as one name, and `)$BORDER`, which may hold an operator, as a member. Parts may differ in white space alone.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PARTS = ROOT / "volprep/shading/glsl"
STYLE = ROOT / "tools/glsl.clang-format"
# Letters for clang-format, and in no part.
_HIDDEN = ((re.compile(r"\$\{(\w+)\}"), r"ÀÁ\1Â"), (re.compile(r"\)\$(?=\w)"), ").Ä"))
_SHOWN = ((re.compile(r"ÀÁ(\w+?)Â"), r"${\1}"), (re.compile(r"\)\.Ä"), ")$"))


def laid_out(text: str) -> str:
    """Return the text of a part as clang-format lays it out. Raise ValueError if more than white space changes."""
    for pattern, hidden in _HIDDEN:
        text = pattern.sub(hidden, text)
    command = [Path(sys.executable).with_name("clang-format"), f"--style=file:{STYLE}"]
    done = subprocess.run(
        [*command, "--assume-filename=part.c"], input=text, capture_output=True, check=True, encoding="utf-8"
    )
    if "".join(done.stdout.split()) != "".join(text.split()):
        msg = "clang-format changes more than white space"
        raise ValueError(msg)
    found = done.stdout
    for pattern, shown in _SHOWN:
        found = pattern.sub(shown, found)
    return found


def main() -> None:
    """Check or write all parts."""
    wrong = []
    for path in sorted(PARTS.rglob("*.glsl")):
        text = path.read_text(encoding="utf-8")
        found = laid_out(text)
        if found != text:
            wrong.append(str(path))
            if "--write" in sys.argv:
                path.write_text(found, encoding="utf-8")
    if wrong and "--write" not in sys.argv:
        sys.exit("\n".join([*wrong, "Lay these out with tools/glsl_format.py --write"]))


if __name__ == "__main__":
    main()
