"""Write the folder that is published on npm: formats/js as it is sent, without comments. Usage: npm_folder.py FOLDER.

For the declarations of types: tsc -p formats/js --outDir FOLDER/types.
"""

import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "formats"))

from volprep_formats.runtime import runtime_folder, sent_modules  # noqa: E402 - found by the line above


def main(target: Path) -> None:
    target.mkdir(parents=True, exist_ok=True)
    for name, text in sent_modules().items():
        (target / name).write_text(text, encoding="utf-8")
    for file in (*(runtime_folder() / name for name in ("package.json", "README.md")), ROOT / "LICENSE"):
        shutil.copy(file, target)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
