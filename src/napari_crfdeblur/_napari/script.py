"""What was done in a session, as a Python script that does it again without a display."""

from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from .provenance import actions_of

HEAD = '''"""Deblur {name} as in the napari window; made by napari-crfdeblur {version}."""

{imports}

viewer = ViewerModel()
{opening}
session = Session(viewer, photo{white})
'''
INTO_FILE = "restore_into"
WRITE = """
if session.state.restored is not None:
    {write}"""
TAIL = """
session.save("{stem}-session.json")
"""


def as_script(record: dict[str, Any]) -> str:
    """The steps of a session record as a Python script.

    Parameters
    ----------
    record : dict
        As of :meth:`Session.record`, or the metadata of a layer.

    Returns
    -------
    str
        Reads the photo from its file, or from the path given as the first argument if it was
        made in memory; does the same steps with the same arguments, and writes the result.
    """
    names: set[tuple[str, str]] = {("napari.components", "ViewerModel")}
    names.add(("napari_crfdeblur", "Session"))
    lines = []
    actions = actions_of(record, "the session")
    for action in actions:
        arguments = [f"{k}={expression(v, names)}" for k, v in action.arguments.items()]
        lines.append(f"session.{action.verb}({', '.join(arguments)})")
    source = record["source"]
    opening, stem = _opening(source, names)
    head = HEAD.format(
        name=source["name"],
        version=record["software"]["napari-crfdeblur"],
        opening=opening,
        white="" if source["white"] is None else f", white={source['white']!r}",
        imports="{imports}",
    )
    results = [action.verb for action in actions if action.verb in ("reapply", INTO_FILE)]
    written = results[-1:] == [INTO_FILE]  # and too large, perhaps, to be held
    tail = "" if written else WRITE.format(write=_writing(source, stem, names))
    tail += TAIL.format(stem=stem)
    body = head + "\n".join(lines) + "\n" + tail
    return body.replace("{imports}", _imports(names), 1)


def expression(value: Any, names: set[tuple[str, str]]) -> str:
    """Python source of a value: plain, an array, a member of an Enum, or a frozen method.

    Parameters
    ----------
    value : object
        What was passed to a verb.
    names : set of (str, str)
        Gets the module and name of everything that the source refers to.
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
    return repr(value)


def _is_default(value: Any, field: Any) -> bool:
    default = field.default
    if default is MISSING and field.default_factory is not MISSING:
        default = field.default_factory()
    given = getattr(value, field.name)
    return default is not MISSING and not isinstance(given, np.ndarray) and given == default


def _refer(kind: type, names: set[tuple[str, str]]) -> None:
    """Import a class from the shortest module that offers it."""
    parts = kind.__module__.split(".")
    for length in range(2, len(parts) + 1):
        home = ".".join(parts[:length])
        if getattr(import_module(home), kind.__name__, None) is kind:
            names.add((home, kind.__name__))
            return


def _opening(source: dict[str, Any], names: set[tuple[str, str]]) -> tuple[str, str]:
    """The lines that open the photo, and the stem of the results' names."""
    # Napari looks for plugins only when it opens a window.
    discover = "PluginManager.instance().discover()"
    if source["sample"]:
        names.add(("npe2", "PluginManager"))
        plugin, sample = source["sample"]
        return f"{discover}\n(photo,) = viewer.open_sample({plugin!r}, {sample!r})", str(sample)
    if source["path"]:
        names.add(("npe2", "PluginManager"))
        opened = f"viewer.open({source['path']!r}, plugin={source['reader'] or 'napari'!r})"
        return f"{discover}\nphoto = {opened}[0]", Path(source["path"]).stem
    names |= {("sys", ""), ("napari_crfdeblur.io", "read_photo"), ("pathlib", "Path")}
    photo = f"viewer.add_image(read_photo(Path(sys.argv[1])), name={source['name']!r})"
    return f"photo = {photo}", "photo"


def _writing(source: dict[str, Any], stem: str, names: set[tuple[str, str]]) -> str:
    """The line that writes the result: a photo, or a stack as TIFF."""
    if len(source["shape"]) - source["rgb"] > 2:
        names.add(("tifffile", "imwrite"))
        return f'imwrite("{stem}-deblurred.tif", session.state.restored.data)'
    names |= {("napari_crfdeblur.io", "write_photo"), ("pathlib", "Path")}
    suffix = ".png" if source["dtype"] in ("uint8", "uint16") else ".tif"
    return f'write_photo(Path("{stem}-deblurred{suffix}"), session.state.restored.data)'


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
