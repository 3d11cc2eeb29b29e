"""Explain a name of a batch: its scan, and the whole reason of its failure. For the owner's screen only."""

from collections.abc import Iterator
from pathlib import Path

from volprep.batch.ledger import Ledger
from volprep.batch.place import Place
from volprep.pipeline.look import look_at
from volprep.scene.request import request_for_source
from volprep_formats.diagnostics import VolprepError


def explain(name: str, place: Place) -> Iterator[str]:
    """Return lines about the scan of a name. Raises VP8060 for a name that no batch of this folder has made."""
    source = place.sources().get(name)
    if source is None:
        raise VolprepError("VP8060", name=name, path=place.folder)
    yield f"{name}: {source}"
    for (job, profile), record in sorted(Ledger(place).records().items()):
        if job != name:
            continue
        yield f"{profile}: {record.outcome}, {record.ended}"
        yield from (f"  {error.code} {error.summary}" for error in record.errors)
    path = Path(source)
    if path.exists():
        try:
            looked = look_at(request_for_source(path))
        except VolprepError as error:
            yield f"read now: {error}"
        else:
            yield f"read now: {looked.info.format}, it can be opened"
