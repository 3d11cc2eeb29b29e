"""Records in which every field is filled, and every text is the same."""

from collections.abc import Mapping
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from volprep_formats.record import Record

AnyRecord = TypeVar("AnyRecord", bound=Record)


def filled(record: type[AnyRecord], text: str) -> AnyRecord:
    """Return a record of this type in which nothing is absent; it is not validated."""
    return record.model_construct(**{name: _value(each.annotation, text) for name, each in record.model_fields.items()})


def _value(annotation: object, text: str, place: int = 0) -> Any:
    """Return a value of a type. Lists have one entry; of several types the first counts; pairs of numbers rise."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        value: Any = inner[0]
    elif origin in {Annotated, Union, UnionType}:
        value = _value(next(each for each in inner if each is not NoneType), text, place)
    elif origin is tuple:
        value = tuple(_value(each, text, index) for index, each in enumerate(inner) if each is not Ellipsis)
    elif origin in {dict, Mapping}:
        value = {_value(inner[0], text): _value(inner[1], text)}
    elif isinstance(annotation, type) and issubclass(annotation, Record):
        value = filled(annotation, text)
    else:
        value = {str: text, bool: True, int: 1, float: 0.5 + place}[annotation]
    return value
