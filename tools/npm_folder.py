"""Write the folder that is published on npm: formats/js as it is sent, without comments, with declarations of types.

Usage: npm_folder.py FOLDER. TypeScript comes from npm on first use; without npm or its registry the folder has no
declarations, and its package.json names none.
"""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "formats"))

from volprep_formats.runtime import runtime_folder, sent_modules  # noqa: E402 - found by the line above

NEEDED = ("typescript@7.0.2", "@types/three@0.187.0")
TOOLS = ROOT / "build" / "node" / "types"


def main(target: Path) -> None:
    target.mkdir(parents=True, exist_ok=True)
    for name, text in sent_modules().items():
        (target / name).write_text(text, encoding="utf-8")
    for file in (*(runtime_folder() / name for name in ("package.json", "README.md")), ROOT / "LICENSE"):
        shutil.copy(file, target)
    if not wrote_types(target / "types"):
        print("volpkg: without types: npm is missing, or cannot install TypeScript", file=sys.stderr)
        facts = json.loads((target / "package.json").read_text(encoding="utf-8"))
        for entry in facts["exports"].values():
            del entry["types"]
        facts["files"].remove("types")
        (target / "package.json").write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")


def wrote_types(target: Path) -> bool:
    """Write the declarations that JSDoc gives; False without npm or TypeScript."""
    npm = shutil.which("npm")
    installed = TOOLS / "node_modules"
    if npm is None or shutil.which("node") is None:
        return False
    if not (installed / "@types" / "three").is_dir():
        TOOLS.mkdir(parents=True, exist_ok=True)
        command = [
            npm,
            "install",
            "--silent",
            "--no-audit",
            "--no-fund",
            "--ignore-scripts",
            "--prefix",
            TOOLS,
            *NEEDED,
        ]
        if subprocess.run(command, check=False, capture_output=True).returncode != 0:
            return False
    source = runtime_folder()
    paths = {"three": [str(installed / "@types" / "three")]}
    options = {"skipLibCheck": True, "rootDir": str(source), "outDir": str(target.absolute()), "paths": paths}
    settings = {"extends": str(source / "tsconfig.json"), "compilerOptions": options, "include": [f"{source}/**/*.js"]}
    with TemporaryDirectory() as folder:
        file = Path(folder) / "tsconfig.json"
        file.write_text(json.dumps(settings), encoding="utf-8")
        # Declarations are written in spite of errors of types, which `make lint` and the tests find.
        subprocess.run(["node", installed / "typescript" / "bin" / "tsc", "-p", file], check=False)
    return (target / "volpkg.d.ts").is_file()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
