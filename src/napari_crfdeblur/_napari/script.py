"""What was done in a session, as a Python script that does it again without a display.

Whatever comes from outside, such as names of files and layers, stands in it as ``repr`` writes
it, so that it is text and nothing else.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass, replace
from enum import Enum
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..io import record_from
from ..pipeline import Record, Stage
from ..pipeline.intermediates import PLANE
from .pixels import KEY

HEAD = '''"""Do again what was done in the napari window; made by napari-crfdeblur {version}."""

{imports}

# what was worked on: {name}
viewer = ViewerModel()
{opening}
{placing}
session = Session(viewer, photo{white})
record = {record}
for sentence in session.repeat(record):
    print(sentence)
{rest}session.save({record_file})
'''
PLACES = ("scale", "translate", "units", "axis_labels")


def as_script(content: dict[str, Any]) -> str:
    """What a session did as a Python script.

    Parameters
    ----------
    content : dict
        As of :meth:`Session.record`, or the metadata of a layer.

    Returns
    -------
    str
        Reads the photo from its file, or from the path given as the first argument if it was
        made in memory; gives it its scale, units and names of axes; does the same by the same
        options, says whether the same comes out, and writes the result.
    """
    names = {("napari.components", "ViewerModel"), ("napari_crfdeblur", "Session")}
    record, source = record_from(content, "the session"), content["source"]
    opening, stem = _opening(record, source, names)
    rest = ""
    if record.until is Stage.REAPPLY and not record.tiled:
        rest = f"{_writing(record, source, stem, names)}\n"
    text = HEAD.format(
        version=record.versions[KEY],
        imports="{imports}",
        name=ascii(source["name"]),
        opening=opening,
        placing="\n".join(f"photo.{name} = {expression(source[name], names)}" for name in PLACES),
        white="" if record.white is None else f", white={record.white!r}",
        record=expression(replace(record, chosen={}), names),
        rest=rest,
        record_file=ascii(f"{stem}-record.json"),
    )
    return text.replace("{imports}", _imports(names), 1)


def expression(value: Any, names: set[tuple[str, str]]) -> str:
    """Python source of a value: plain, an array, a member of an Enum, or a frozen object.

    Parameters
    ----------
    value : object
        What is to stand in the script.
    names : set of (str, str)
        Gets the module and name of everything that the source refers to.

    Raises
    ------
    ValueError
        A value of another kind, whose ``repr`` might be anything.
    """
    if isinstance(value, Enum):
        _refer(type(value), names)
        return f"{type(value).__name__}.{value.name}"
    if isinstance(value, np.ndarray):
        names.add(("numpy", ""))
        return f"np.array({value.tolist()!r})"
    if is_dataclass(value) and not isinstance(value, type):
        _refer(type(value), names)
        given = [
            f"{f.name}={expression(getattr(value, f.name), names)}"
            for f in fields(value)
            if f.init and not _is_default(value, f)
        ]
        return f"{type(value).__name__}({', '.join(given)})"
    if isinstance(value, tuple):
        inner = ", ".join(expression(item, names) for item in value)
        return f"({inner},)" if len(value) == 1 else f"({inner})"
    if isinstance(value, list):
        return f"[{', '.join(expression(item, names) for item in value)}]"
    if isinstance(value, Mapping):
        pairs = (f"{expression(k, names)}: {expression(v, names)}" for k, v in value.items())
        return f"{{{', '.join(pairs)}}}"
    if isinstance(value, str):
        return ascii(str(value))
    if value is None or isinstance(value, bool | int | float):
        return repr(value)
    raise ValueError(f"expected a value that a script can hold, got {type(value).__name__}")


def _is_default(value: Any, field: Any) -> bool:
    default = field.default
    if default is MISSING and field.default_factory is not MISSING:
        default = field.default_factory()
    given = getattr(value, field.name)
    return default is not MISSING and not isinstance(given, np.ndarray) and given == default


def _refer(kind: type, names: set[tuple[str, str]]) -> None:
    """Import a class from the shortest module that offers it."""
    parts = kind.__module__.split(".")
    for length in range(1, len(parts) + 1):
        home = ".".join(parts[:length])
        if getattr(import_module(home), kind.__name__, None) is kind:
            names.add((home, kind.__name__))
            return


def _opening(
    record: Record, source: dict[str, Any], names: set[tuple[str, str]]
) -> tuple[str, str]:
    """The lines that open the photo, and the stem of the results' names."""
    # Napari looks for plugins only when it opens a window.
    discover = "PluginManager.instance().discover()"
    if source["sample"]:
        names.add(("npe2", "PluginManager"))
        plugin, sample = (ascii(str(name)) for name in source["sample"])
        return f"{discover}\n(photo,) = viewer.open_sample({plugin}, {sample})", "photo"
    if source["path"]:
        names.add(("npe2", "PluginManager"))
        path, reader = ascii(str(source["path"])), ascii(str(source["reader"] or "napari"))
        opened = f"viewer.open({path}, plugin={reader})[0]"
        return f"{discover}\nphoto = {opened}", Path(source["path"]).stem
    names.add(("sys", ""))
    if _is_stack(record, source):
        names.add(("tifffile", "imread"))
        read = "imread(sys.argv[1])"
    else:
        names |= {("napari_crfdeblur.io", "read_photo"), ("pathlib", "Path")}
        read = "read_photo(Path(sys.argv[1]))"
    # Of small photos napari would not guess whether they have colors.
    options = f"rgb={bool(source['rgb'])}, name={source['name']!a}"
    return f"photo = viewer.add_image({read}, {options})", "photo"


def _is_stack(record: Record, source: dict[str, Any]) -> bool:
    """Whether it is more than a single photo."""
    return len(record.photo.shape) - bool(source["rgb"]) > PLANE


def _writing(record: Record, source: dict[str, Any], stem: str, names: set[tuple[str, str]]) -> str:
    """The line that writes the result: a photo, or a stack as TIFF."""
    if _is_stack(record, source):
        names.add(("tifffile", "imwrite"))
        return f"imwrite({f'{stem}-deblurred.tif'!a}, session.state.restored.data)"
    names |= {("napari_crfdeblur.io", "write_photo"), ("pathlib", "Path")}
    suffix = ".png" if record.photo.kind in ("uint8", "uint16") else ".tif"
    name = ascii(f"{stem}-deblurred{suffix}")
    return f"write_photo(Path({name}), session.state.restored.data)"


def _imports(names: set[tuple[str, str]]) -> str:
    """Import lines: modules first, then names, as ruff sorts them."""
    modules = {"numpy": "import numpy as np", "sys": "import sys"}
    whole = [modules[module] for module, name in sorted(names) if not name]
    homes: dict[str, list[str]] = {}
    for module, name in sorted(names):
        if name:
            homes.setdefault(module, []).append(name)
    return "\n".join(
        [*whole, *(f"from {module} import {', '.join(found)}" for module, found in homes.items())]
    )
