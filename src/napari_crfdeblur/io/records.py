"""Methods, curves, edges and results as JSON, for records of what was done.

Texts, whole numbers, finite floats, None, lists and dicts are their own records. All else is a
dict that names its ``"type"``: an object of a stage with its fields, a choice with its name, an
array, a float that JSON lacks, a dict that has a key ``"type"`` itself.
"""

import reprlib
from collections.abc import Callable, Collection
from dataclasses import fields, is_dataclass
from enum import Enum
from math import isfinite
from pathlib import Path
from types import UnionType
from typing import Any, TypeAlias, Union, get_args, get_origin, get_type_hints

import numpy as np

from .. import deconvolution, edges, estimate, pipeline, profiles, psf, response
from .._typing import Image
from ..errors import DAMAGED, CrfDeblurError
from ..estimate import Responses
from ..psf import Evidence
from ..texts import brief, printable
from .json_files import check_values

Json: TypeAlias = Any
"""What ``json`` writes and reads: None, bool, int, float, str, list or dict of such."""

STAGES = (response, edges, profiles, psf, estimate, deconvolution)
WHOLE_PATH = (pipeline.DeblurOptions, pipeline.Pixels, pipeline.Record, pipeline.Stage)
PASSING = (Evidence, Responses)  # on the way from one stage to the next only
MEMBERS: dict[str, type[Any]] = {
    member.__name__: member
    for members in (*([getattr(stage, n) for n in stage.__all__] for stage in STAGES), WHOLE_PATH)
    for member in members
    if isinstance(member, type) and (is_dataclass(member) or issubclass(member, Enum))
    if member not in PASSING
}
"""The classes that have records, by name: all that the stages export and that hold values."""


def to_record(value: object) -> Json:
    """What JSON can hold of a value; :func:`from_record` makes the value of it again.

    Parameters
    ----------
    value : object
        A method, curve, edge, result or choice that a stage exports, an array of real
        numbers, None, a bool, a number, a text, or a list, tuple or dict of these. A path
        becomes a text, and a number of numpy a plain one.

    Raises
    ------
    CrfDeblurError
        A value of another type.
    """
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)) and not isinstance(value, Enum):
        return int(value)
    if isinstance(value, (float, np.floating)):
        number = float(value)
        return number if isfinite(number) else {"type": "float", "value": str(number)}
    if isinstance(value, (str, Path)) and not isinstance(value, Enum):
        return str(value)
    if isinstance(value, (list, tuple)):
        return [to_record(each) for each in value]
    if isinstance(value, dict) and all(isinstance(key, str) for key in value):
        items = {str(key): to_record(each) for key, each in value.items()}
        return {"type": "dict", "items": items} if "type" in items else items
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and value.itemsize <= 8:
        return _record_of_array(value)
    return None if value is None else _record_of_member(value)


def from_record(record: Json) -> Any:
    """Make the value of which :func:`to_record` made a record; lists become tuples.

    Parameters
    ----------
    record : object
        As it was made, or as it came back from a JSON file.

    Raises
    ------
    CrfDeblurError
        Of an unknown type, with a field too few or too many, with a value that cannot be, or
        beyond the limits of JSON files.
    """
    try:
        check_values(record)
        return _value(record)
    except (*DAMAGED, AssertionError) as error:
        raise CrfDeblurError(
            f"a record is damaged ({brief(error)}); mend the file or make it again"
        ) from error


def _value(record: Json) -> Any:
    if record is None or isinstance(record, (bool, int, float, str)):
        return record
    if isinstance(record, (list, tuple)):
        return tuple(_value(each) for each in record)
    if isinstance(record, dict) and "type" not in record:
        return {key: _value(each) for key, each in record.items()}
    name = record["type"] if isinstance(record, dict) else type(record).__name__
    if not isinstance(name, str) or name not in {*READERS, *MEMBERS}:
        raise CrfDeblurError(
            f'records of type "{_shown(name)}" are not known; update napari-crfdeblur, or take the '
            "record out of the file"
        )
    content = {key: each for key, each in record.items() if key != "type"}
    try:
        # What overflows is refused by the constructors, which look at the values.
        with np.errstate(all="ignore"):
            return _read(name, content)
    except DAMAGED as error:
        raise CrfDeblurError(
            f'a record of type "{name}" is damaged ({brief(error)}); mend the file or make it again'
        ) from error


def _read(name: str, content: dict[str, Json]) -> Any:
    if name in MEMBERS:
        return _member(MEMBERS[name], content)
    names, reader = READERS[name]
    _check_fields(content, names)
    return reader(*(content[each] for each in names))


def _check_fields(content: dict[str, Json], names: Collection[str]) -> None:
    if content.keys() != set(names):
        raise ValueError(f"expected the fields {[*names]}, got {_shown([*content])}")


def _shown(value: object) -> str:
    """The beginning of a value as a text, however large it is."""
    return printable(value[:80]) if isinstance(value, str) else printable(reprlib.repr(value))


def _record_of_member(value: object) -> Json:
    name = type(value).__name__
    if MEMBERS.get(name) is not type(value):
        raise CrfDeblurError(
            f"a value of type {name} cannot be recorded; keep to numbers, texts, arrays and the "
            "objects of the stages"
        )
    if isinstance(value, Enum):
        return {"type": name, "name": value.name}
    return {"type": name} | {key: to_record(getattr(value, key)) for key in _hints(type(value))}


def _member(cls: type[Any], content: dict[str, Json]) -> object:
    """An object of a stage; its constructor checks the values, and this their types."""
    if issubclass(cls, Enum):
        _check_fields(content, ("name",))
        return cls[content["name"]]
    hints = _hints(cls)
    _check_fields(content, hints)
    values = {key: _value(each) for key, each in content.items()}
    for key, value in values.items():
        if not _fits(value, hints[key]):
            raise ValueError(f"expected {key} of type {hints[key]}, got {_shown(value)}")
    return cls(**values)


def _hints(cls: type[Any]) -> dict[str, Any]:
    """Types of the fields that the constructor takes, by name."""
    hints = get_type_hints(cls)
    return {field.name: hints[field.name] for field in fields(cls) if field.init}


def _fits(value: object, hint: Any) -> bool:
    """Whether a value is of the type of a field."""
    origin, inner = get_origin(hint), get_args(hint)
    if hint is Any:
        return True
    if origin in (Union, UnionType):
        return any(_fits(value, each) for each in inner)
    if origin is tuple and isinstance(value, tuple):
        wanted = inner[:1] * len(value) if inner[-1] is Ellipsis else inner
        return len(value) == len(wanted) and all(map(_fits, value, wanted))
    if origin is dict and isinstance(value, dict):
        return all(_fits(each, inner[1]) for each in value.values())
    kind = origin or hint
    if isinstance(value, bool):
        return kind is bool
    return isinstance(value, (int, float) if kind is float else kind)


def _record_of_array(array: Image) -> Json:
    finite = array.dtype.kind != "f" or bool(np.isfinite(array).all())
    return {
        "type": "array",
        "dtype": array.dtype.name,
        "shape": list(array.shape),
        # Numbers that JSON lacks are written as texts, which become numbers again.
        "data": array.tolist() if finite else _texts(array.tolist()),
    }


def _texts(data: Any) -> Json:
    if isinstance(data, list):
        return [_texts(each) for each in data]
    return data if isfinite(data) else str(data)


def _array(name: Json, sides: Json, data: Json) -> Image:
    if name not in KINDS:
        raise ValueError(f"expected real numbers, got {_shown(name)}")
    if not isinstance(sides, (list, tuple)) or not all(type(side) is int for side in sides):
        raise ValueError(f"expected sides, got {_shown(sides)}")
    dtype, shape = np.dtype(name), tuple(sides)
    values = np.array(data, dtype=object)  # the numbers alone are as large as the record
    wanted = (int, float, str) if dtype.kind == "f" else (int,)
    if not all(isinstance(each, wanted) for each in values.flat):
        raise ValueError(f"expected an array of {dtype}, got other values, or rows of other length")
    if values.size == 0 and 0 in shape:  # nested lists do not tell all sides of an empty array
        return np.empty(shape, dtype)
    if values.shape != shape:
        raise ValueError(f"expected an array of shape {shape}, got {values.shape}")
    with np.errstate(over="raise"):
        return values.astype(dtype)


def _items(items: Json) -> dict[str, Any]:
    if not isinstance(items, dict):
        raise ValueError(f"expected items by their keys, got {_shown(items)}")
    return {key: _value(each) for key, each in items.items()}


def _float(value: Json) -> float:
    if value not in NOT_IN_JSON:
        raise ValueError(f"expected one of {', '.join(NOT_IN_JSON)}, got {_shown(value)}")
    return float(value)


KINDS = (
    *("bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64"),
    *("float16", "float32", "float64"),
)
NOT_IN_JSON = ("nan", "inf", "-inf")
READERS: dict[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "array": (("dtype", "shape", "data"), _array),
    "dict": (("items",), _items),
    "float": (("value",), _float),
}
