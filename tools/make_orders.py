"""Measure the tables of docs/ORDERS.md and write them. A test compares the files; run this when it fails.

python tools/make_orders.py
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "support"))

from order_document import DOCUMENT, filled, tables


def main() -> None:
    """Write the document. It takes minutes, so that any argument, as --help, only prints what this is."""
    if len(sys.argv) > 1:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        made = tables(Path(folder))
    DOCUMENT.write_text(filled(DOCUMENT.read_text(encoding="utf-8"), made), encoding="utf-8")


if __name__ == "__main__":
    main()
