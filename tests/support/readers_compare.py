"""Compare what the three readers make of damaged packages. `make fuzz-readers` runs this for long.

    python tests/support/readers_compare.py FOLDER --count 20000 --seed 1

Two readers that take different packages, or that refuse one for different reasons, are a defect of one of them.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).parent))

from every_kind import write_every_kind
from package_damage import damaged
from repack import files_of
from three_readers import READ, Readers

BATCH = 250
LEFT_TO_VALIDATE = {"VP4010", "VP4011", "VP4061", "VP4030", "VP4031", "VP4032", "VP4039"}
"""What formats/js leaves to `volprep validate`: contradictions that change no picture that it draws, or that it finds
only when it draws; and CRC-32 of files whose digest is right."""

OF_BYTES = {"VP4011", "VP4030", "VP4031", "VP4032", "VP4039"}
"""What is wrong with the bytes of a file, whose digest then need not be right either."""


def disagreement(python: set[str], c: str, javascript: str) -> str | None:
    """Say how the readers differ about one file; None if they agree."""
    # The header compares digests last: of a file whose bytes are wrong it may name another problem.
    digest_only = "VP4009" in python and c in OF_BYTES
    if (python == {READ}) != (c == READ) or not (c in python or digest_only):
        return f"Python says {', '.join(sorted(python))}, C says {c}"
    # Digests take the place of CRC-32 in JavaScript, which reads each local header with its file, the manifest first.
    is_same = javascript in {"VP4009", "VP4061"} and python <= {"VP4002", "VP4061"}
    if javascript != READ and javascript not in python and not is_same:
        return f"Python says {', '.join(sorted(python))}, JavaScript says {javascript}"
    if javascript == READ and not python <= LEFT_TO_VALIDATE | {READ}:
        return f"Python says {', '.join(sorted(python))}, JavaScript takes it"
    return None


def compare(readers: Readers, kinds: dict[str, Path], folder: Path, seeds: list[str]) -> tuple[Counter[str], list[str]]:
    """Read one damaged package for each seed. Return how often each outcome came, and each disagreement."""
    outcomes: Counter[str] = Counter()
    found = []
    sound = {kind: files_of(path) for kind, path in kinds.items()}
    for start in range(0, len(seeds), BATCH):
        batch = seeds[start : start + BATCH]
        paths = [folder / f"{number}.zip" for number in range(len(batch))]
        for path, seed in zip(paths, batch, strict=True):
            # A file that is written over waits for the disk.
            path.unlink(missing_ok=True)
            path.write_bytes(damaged(sound[seed.split()[1]], seed))
        for seed, path, (python, c, javascript) in zip(batch, paths, readers.all(paths), strict=True):
            outcomes[c] += 1
            outcomes["JavaScript leaves it to validate"] += javascript == READ and python != {READ}
            said = disagreement(python, c, javascript)
            if said is not None:
                found.append(f"{seed}: {said}")
                path.rename(folder / f"disagreement-{len(found)}.zip")
    return outcomes, found


def seeds_of(seed: int, count: int, kinds: dict[str, Path]) -> list[str]:
    """Seeds of packages: each names its kind, so that one package can be made again."""
    names = [*kinds]
    return [f"{seed}:{number} {names[number % len(names)]}" for number in range(count)]


def main() -> int:
    """Compare, print what was found, and return 1 if readers disagree."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as place:
        kinds = write_every_kind(Path(place))
        readers = Readers(Path(place))
        outcomes, found = compare(readers, kinds, options.folder, seeds_of(options.seed, options.count, kinds))
    print(f"{options.count} damaged packages, seed {options.seed}:", dict(outcomes.most_common()))
    print(*found, f"{len(found)} disagreements", sep="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
