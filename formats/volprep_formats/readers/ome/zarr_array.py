"""Arrays of Zarr stores, versions 2 and 3, decoded by the library zarr in worker processes.

The metadata of an array is checked before zarr reads it: numeric types only, codecs from an allow-list (none of them
loads Python objects), chunks of a size that can be decoded. Source: Zarr specifications 2 and 3
(https://zarr-specs.readthedocs.io/).
"""

import itertools
import json
import math
from collections.abc import Iterable
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import UInt8Array
from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.isolation import WorkerRequest
from volprep_formats.readers.ome.zarr_files import Files, open_files

if TYPE_CHECKING:
    from collections.abc import Iterator

MOST_TEXT_BYTES = 2**24
_MOST_CHUNK_BYTES = 2**30
_MOST_INNER_CHUNKS = 2**22
_MEMORY_BYTES = 2**29
_SECONDS, _SECONDS_PER_BYTE, _SECONDS_PER_CHUNK = 60.0, 1e-6, 1e-3
_DTYPES = frozenset(
    ("uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float16", "float32", "float64")
)
_V2_CODECS = frozenset(("zlib", "gzip", "bz2", "lzma", "zstd", "blosc", "lz4", "shuffle", "delta", "crc32", "crc32c"))
_V3_CODECS = frozenset(("bytes", "gzip", "zstd", "blosc", "crc32c", "transpose", "sharding_indexed"))
_V3_CODECS |= {f"numcodecs.{name}" for name in _V2_CODECS}
_tokens = itertools.count()

Range = tuple[int, int]


@dataclass(frozen=True)
class StoreKey:
    """An open store; workers keep it open under its number."""

    path: Path
    number: int

    @classmethod
    def of(cls, path: Path) -> "StoreKey":
        """Unique number: the same path may hold another store later."""
        return cls(path, next(_tokens))


@dataclass(frozen=True)
class GroupRequest:
    """The attributes of a group."""

    store: StoreKey
    name: str


@dataclass(frozen=True)
class ArrayFacts:
    """Metadata of an array."""

    shape: tuple[int, ...]
    chunks: tuple[int, ...]
    """Shape of the unit that is decoded in one piece."""
    dtype: str


@dataclass(frozen=True)
class ArrayRequest:
    """An array of a store."""

    store: StoreKey
    name: str


@dataclass(frozen=True)
class PartRequest:
    """A box of an array."""

    array: ArrayRequest
    facts: ArrayFacts
    box: tuple[Range, ...]
    """First index and end index along each axis."""
    axes: tuple[int, ...]
    """Axes of the array in the order in which they are wanted; the others have one index in the box."""


def text_request(function: Any, argument: GroupRequest | ArrayRequest) -> WorkerRequest:
    """Request the JSON of a group or an array, with `read_group` or `read_facts`."""
    return WorkerRequest(function, argument, argument.store.path, MOST_TEXT_BYTES, _MEMORY_BYTES, _SECONDS)


def part_request(part: PartRequest) -> WorkerRequest:
    """Request a box of an array, in the array's type."""
    item = np.dtype(part.facts.dtype).itemsize
    size = item * math.prod(stop - start for start, stop in part.box)
    # zarr holds the decoded chunk beside the result, and a decoder holds its input and its output.
    memory = _MEMORY_BYTES + 2 * size + 4 * item * math.prod(part.facts.chunks)
    return WorkerRequest(read_part, part, part.array.store.path, size, memory, _SECONDS + _SECONDS_PER_BYTE * size)


def count_request(part: PartRequest) -> WorkerRequest:
    """Request the number of chunk files of a box, and of missing ones, as JSON."""
    chunks = math.prod(-(-n // m) for n, m in zip(part.facts.shape, part.facts.chunks, strict=True))
    seconds = _SECONDS + _SECONDS_PER_CHUNK * chunks
    return WorkerRequest(count_files, part, part.array.store.path, MOST_TEXT_BYTES, _MEMORY_BYTES, seconds)


def count_files(part: PartRequest) -> UInt8Array:
    """Count the chunk (or shard) files of a box, and how many of them are missing."""
    with _coded_errors(part.array.store.path):
        array, files = _opened(part.array), _files(part.array.store)
        stored = array.shards or array.chunks
        ranges = [range(start // n, -(-stop // n)) for (start, stop), n in zip(part.box, stored, strict=True)]
        missing = sum(
            files.size(_key(part.array.name, array.metadata.encode_chunk_key(place))) is None
            for place in itertools.product(*ranges)
        )
        said = {"files": math.prod(map(len, ranges)), "missing": missing}
        return np.frombuffer(json.dumps(said).encode(), np.uint8)


def read_group(request: GroupRequest) -> UInt8Array:
    """Return the attributes of a group as JSON, or null if it is not a group."""
    with _coded_errors(request.store.path):
        files = _files(request.store)
        document = _document(request.store.path, files, _key(request.name, "zarr.json"))
        if document is None:
            attributes = _document(request.store.path, files, _key(request.name, ".zattrs"))
        else:
            attributes = document.get("attributes") or {}
        if not isinstance(attributes, (dict, NoneType)):
            raise VolprepError(
                "VP1220", path=request.store.path, error=SafeText("the attributes of a group are no JSON object")
            )
        return np.frombuffer(json.dumps(attributes).encode(), np.uint8)


def read_facts(request: ArrayRequest) -> UInt8Array:
    """Return the facts of an array as JSON, when it can be read. Raises VP1220, VP1224, VP1225."""
    with _coded_errors(request.store.path):
        facts = _checked(request)
        _opened(request)
        said = {"shape": facts.shape, "chunks": facts.chunks, "dtype": facts.dtype}
        return np.frombuffer(json.dumps(said).encode(), np.uint8)


def read_part(part: PartRequest) -> NDArray[np.generic]:
    """Decode a part of an array. Raises VP1220 when a chunk is damaged."""
    path = part.array.store.path
    with _coded_errors(path):
        array = _opened(part.array)
        values: NDArray[np.generic] = np.asarray(array[tuple(slice(*ends) for ends in part.box)])
        expected = tuple(stop - start for start, stop in part.box)
        if values.shape != expected or values.dtype.name != part.facts.dtype:
            error = f"{part.array.name} gives {values.shape} of {values.dtype}, not {expected} of {part.facts.dtype}"
            raise VolprepError("VP1220", path=path, error=error)
        others = [axis for axis in range(values.ndim) if axis not in part.axes]
        return values.transpose(*others, *part.axes).reshape([expected[axis] for axis in part.axes])


@lru_cache(maxsize=4)
def _files(store: StoreKey) -> Files:
    return open_files(store.path)


@lru_cache(maxsize=4)
def _opened(request: ArrayRequest) -> Any:
    import zarr  # noqa: PLC0415 - in workers only

    from volprep_formats.readers.ome.zarr_guard import GuardedStore  # noqa: PLC0415 - as above

    facts = _checked(request)
    # The pool has a worker for every core, and threads count as memory.
    zarr.config.set({"async.concurrency": 1, "threading.max_workers": 1})
    # Packed noise is slightly larger than its unpacked form; the index of a shard is read separately.
    decoded = math.prod(facts.chunks) * np.dtype(facts.dtype).itemsize
    store = GuardedStore(request.store.path, _files(request.store), 2 * decoded + MOST_TEXT_BYTES)
    array = zarr.open_array(store=store, path=request.name, mode="r")
    if array.shape != facts.shape or np.dtype(array.dtype).name != facts.dtype:
        raise VolprepError("VP1220", path=request.store.path, error=f"what {request.name} says has changed")
    return array


def _checked(request: ArrayRequest) -> ArrayFacts:
    path, files = request.store.path, _files(request.store)
    told = _document(path, files, _key(request.name, "zarr.json"))
    if told is not None:
        if told.get("node_type") != "array":
            raise VolprepError("VP1220", path=path, error=f"{request.name} is no array")
        return _facts_of_v3(path, told)
    told = _document(path, files, _key(request.name, ".zarray"))
    if told is None:
        raise VolprepError("VP1220", path=path, error=f"its array {request.name} is missing")
    return _facts_of_v2(path, told)


def _facts_of_v2(path: Path, told: dict[str, Any]) -> ArrayFacts:
    filters = told.get("filters") or []
    codecs = [*filters, *([told["compressor"]] if told.get("compressor") else [])]
    _check_codecs(path, (codec.get("id") for codec in codecs), _V2_CODECS)
    if not isinstance(told["dtype"], str):
        raise VolprepError("VP1224", path=path, what=SafeText("an array of records"))
    return _facts(path, told["shape"], told["chunks"], np.dtype(told["dtype"]).name)


def _facts_of_v3(path: Path, told: dict[str, Any]) -> ArrayFacts:
    grid = told["chunk_grid"]
    if grid["name"] != "regular":
        raise VolprepError("VP1224", path=path, what=f"chunks in a grid called {str(grid['name'])[:40]!r}")
    codecs = told["codecs"]
    _check_codecs(path, (codec["name"] for codec in codecs), _V3_CODECS)
    outer = grid["configuration"]["chunk_shape"]
    chunks = outer
    for codec in codecs:
        if codec["name"] == "sharding_indexed":
            inner = codec["configuration"]
            _check_codecs(path, (c["name"] for c in (*inner["codecs"], *inner.get("index_codecs", ()))), _V3_CODECS)
            chunks = inner["chunk_shape"]
            _check_lengths(path, outer, chunks)
            if any(c["name"] == "sharding_indexed" for c in inner["codecs"]):
                raise VolprepError("VP1224", path=path, what=SafeText("shards in shards"))
            if math.prod(n // max(1, m) for n, m in zip(outer, chunks, strict=True)) > _MOST_INNER_CHUNKS:
                raise VolprepError("VP1225", path=path, size="more chunks in a shard", limit=str(_MOST_INNER_CHUNKS))
    return _facts(path, told["shape"], chunks, str(told["data_type"]))


def _facts(path: Path, shape: list[int], chunks: list[int], dtype: str) -> ArrayFacts:
    _check_lengths(path, shape, chunks)
    if dtype not in _DTYPES:
        raise VolprepError("VP1224", path=path, what=f"voxels of type {dtype[:40]!r}")
    size = math.prod(chunks) * np.dtype(dtype).itemsize
    if size > _MOST_CHUNK_BYTES:
        raise VolprepError("VP1225", path=path, size=f"chunks of {size} bytes", limit=f"{_MOST_CHUNK_BYTES} bytes")
    return ArrayFacts(tuple(shape), tuple(chunks), dtype)


def _check_lengths(path: Path, *each: list[int]) -> None:
    for lengths in each:
        if not all(type(n) is int and 0 < n < 2**63 for n in lengths) or len(lengths) != len(each[0]) or not lengths:
            raise VolprepError("VP1220", path=path, error=f"the shape of an array or chunk is {str(lengths)[:80]}")


def _check_codecs(path: Path, names: Iterable[object], known: frozenset[str]) -> None:
    for name in names:
        if name not in known:
            raise VolprepError("VP1224", path=path, what=f"data packed with {str(name)[:40]!r}")


def _document(path: Path, files: Files, key: str) -> dict[str, Any] | None:
    size = files.size(key)
    if size is None:
        return None
    if size > MOST_TEXT_BYTES:
        raise VolprepError("VP1225", path=path, size=f"{size} bytes in {key}", limit=f"{MOST_TEXT_BYTES} bytes")
    document = json.loads(files.read(key, 0, size))
    if not isinstance(document, dict):
        raise VolprepError("VP1220", path=path, error=f"{key} is no JSON object")
    return document


def _key(name: str, file: str) -> str:
    return f"{name}/{file}" if name else file


@contextmanager
def _coded_errors(path: Path) -> "Iterator[None]":
    try:
        yield
    except (VolprepError, MemoryError):
        raise
    except OSError as error:
        raise VolprepError("VP1003", path=path, error=error.strerror or error) from error
    except Exception as error:  # damaged chunks and metadata end in many kinds of errors
        lines = str(error).strip().splitlines()
        what = f"{type(error).__name__}: {lines[0][:160]}" if lines else type(error).__name__
        raise VolprepError("VP1220", path=path, error=what) from error
