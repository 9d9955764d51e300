"""The path is the layout: each stage knows only the stages before it, and none the GUI."""

import ast
import re
import subprocess
import sys
from collections.abc import Container, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NAME = "napari_crfdeblur"
PACKAGE = ROOT / "src" / NAME
MODULES = sorted(PACKAGE.rglob("*.py"))

# Modules and folders in the order in which they may import each other: only upwards.
STAGES = [
    "_version",
    "_typing",
    "texts",
    "errors",
    "methods",
    "interrupts",
    "arguments",
    "progress",
    "photo",
    "arrays",
    "fourier",
    "boundary",
    "response",
    "quality",
    "edges",
    "profiles",
    "psf",
    "estimate",
    "deconvolution",
    "simulate",
    "pipeline",
    "io",
    "crew",
    "large",
    "batch",
    "report",
    "demo",
    "cli",
    "_napari",
    "__init__",
]
GUI = {"napari", "magicgui", "qtpy", "superqt", "vispy", "npe2"}
QT = {"PyQt5", "PyQt6", "PySide2", "PySide6"}


def stage_of(path: Path) -> str:
    """First part of the path inside the package: the module or folder."""
    return path.relative_to(PACKAGE).with_suffix("").parts[0]


def dotted(path: Path) -> str:
    """Full name of the package that the relative imports of a file start from."""
    return ".".join([NAME, *path.relative_to(PACKAGE).parent.parts])


def imports_of(source: str, package: str) -> Iterator[tuple[int, str]]:
    """Line and full name of everything imported, inside functions and by name, too."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Import():
                yield from ((node.lineno, alias.name) for alias in node.names)
            case ast.ImportFrom():
                above = package.split(".")[: package.count(".") + 2 - node.level]
                origin = [*above, *filter(None, [node.module])] if node.level else [node.module]
                yield from ((node.lineno, ".".join([*origin, a.name])) for a in node.names)
            case ast.Call(
                func=ast.Name(id="import_module" | "__import__")
                | ast.Attribute(attr="import_module"),
                args=[ast.Constant(value=str(name)), *_],
            ):
                level = len(name) - len(name.lstrip("."))
                above = package.split(".")[: package.count(".") + 2 - level] if level else []
                yield node.lineno, ".".join([*above, name[level:]])


def imported_stage(name: str) -> str:
    """Stage that a full name inside the package belongs to."""
    first = name.split(".")[1:2]
    return first[0] if first and first[0] in STAGES else "__init__"


def violations(path: Path) -> Iterator[str]:
    stage = stage_of(path)
    for line, name in imports_of(path.read_text(encoding="utf-8"), dotted(path)):
        where, top = f"{path.relative_to(ROOT)}:{line}", name.split(".")[0]
        if top in QT or (top in GUI and stage != "_napari"):
            yield f"{where}: imports {top}; only _napari/ may, and Qt by way of qtpy"
        if top != NAME:
            continue
        other = imported_stage(name)
        if other != stage and STAGES.index(other) > STAGES.index(stage):
            yield f"{where}: {stage} imports {other}, a later stage; move what they share up"


def imported_modules(sources: dict[str, tuple[str, str]]) -> dict[str, set[str]]:
    """Which modules each module imports: of names, with their package and source."""
    found = {}
    for module, (package, source) in sources.items():
        names = [name for _, name in imports_of(source, package)]
        found[module] = {first_known(name, sources) for name in names} - {module, ""}
    return found


def first_known(name: str, modules: Container[str]) -> str:
    """The module that a full name is in, or nothing."""
    while name and name not in modules:
        name = name.rpartition(".")[0]
    return name


def test_no_modules_import_each_other_in_a_circle() -> None:
    sources = {}
    for path in MODULES:
        name = ".".join([dotted(path), path.stem]).removesuffix(".__init__")
        sources[name] = (dotted(path), path.read_text(encoding="utf-8"))
    list(TopologicalSorter(imported_modules(sources)).static_order())


def test_a_circle_is_found() -> None:
    sources = {
        "p.one": ("p", "from .two import A"),
        "p.two": ("p", "def f():\n    from . import three"),
        "p.three": ("p", "import p.one, numpy"),
    }
    with pytest.raises(CycleError):
        list(TopologicalSorter(imported_modules(sources)).static_order())


def test_every_module_is_a_stage_on_the_list() -> None:
    unknown = {stage_of(path) for path in MODULES} - set(STAGES)
    assert not unknown, (
        f"{sorted(unknown)} in src/{NAME} are not on the list of stages: add them to STAGES in "
        "tests/test_architecture.py and to docs/architecture.md where they belong on the path"
    )


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_a_stage_imports_only_earlier_stages_and_no_gui(path: Path) -> None:
    if stage_of(path) not in STAGES:
        pytest.fail(f"{stage_of(path)} is not on the list of stages")
    found = list(violations(path))
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("import napari_crfdeblur.psf.base", "napari_crfdeblur.psf.base"),
        ("from napari_crfdeblur import cli", "napari_crfdeblur.cli"),
        ("from . import base", "napari_crfdeblur.psf.base"),
        ("from .. import estimate", "napari_crfdeblur.estimate"),
        ("from ..io.curves import Cube", "napari_crfdeblur.io.curves.Cube"),
        ("def f():\n    from ..io import read_photo", "napari_crfdeblur.io.read_photo"),
        ("import_module('napari.layers')", "napari.layers"),
        ("importlib.import_module('..cli', __package__)", "napari_crfdeblur.cli"),
    ],
)
def test_the_walk_sees_every_form_of_import(source: str, expected: str) -> None:
    assert [name for _, name in imports_of(source, "napari_crfdeblur.psf")] == [expected]


def test_the_whole_core_loads_without_a_gui() -> None:
    core = [path for path in MODULES if stage_of(path) != "_napari"]
    names = [".".join([dotted(path), path.stem]).removesuffix(".__init__") for path in core]
    code = "import importlib, sys\n"
    code += f"for name in {names}: importlib.import_module(name)\n"
    code += f"print(*({GUI | QT} & {{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []


def test_the_documented_path_is_the_list_of_stages() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = [row.group(1) for row in re.finditer(r"^\| `(\w+)", text, flags=re.MULTILINE)]
    assert table == [stage for stage in STAGES if stage in table]
    assert {stage_of(path) for path in MODULES} <= set(table)


# Verbs that the command or the plugin has under the name that they have in the core, and the
# methods proper of the blind estimators, which are alike from outside.
VERBS = {
    "deblur",
    "deblurring",
    "deconvolving",
    "draw_edges",
    "estimate_psf",
    "estimate_response",
    "estimating_psf",
    "estimating_response",
    "find_edges",
    "linearizing",
    "reapplying",
    "searching",
    "shrink_gradient",  # and its compiled loop
    "simulate",
}


def names_of(source: str) -> set[str]:
    """Public classes, functions and types that a module defines; numbers and texts have none."""
    found = set()
    for node in ast.parse(source).body:
        match node:
            case ast.ClassDef(name=name) | ast.FunctionDef(name=name):
                found.add(name)
            case ast.AnnAssign(target=ast.Name(id=name)):
                found.add(name)
            # a type has small letters in its name; a call makes a type variable
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                if name != name.upper() and not isinstance(value, ast.Call):
                    found.add(name)
    return {name for name in found if not name.startswith("_")}


def twice(sources: dict[str, str]) -> dict[str, list[str]]:
    """Names that several modules define, and which."""
    places: dict[str, list[str]] = {}
    for path, source in sources.items():
        for name in names_of(source):
            places.setdefault(name, []).append(path)
    return {name: paths for name, paths in places.items() if len(paths) > 1}


def test_no_name_has_two_meanings() -> None:
    sources = {str(p.relative_to(PACKAGE)): p.read_text(encoding="utf-8") for p in MODULES}
    found = twice(sources)
    unknown = {name: found[name] for name in sorted(found.keys() - VERBS)}
    assert not unknown, "name one of each after what it is: " + "; ".join(
        f"{name} in {', '.join(paths)}" for name, paths in unknown.items()
    )
    gone = VERBS - found.keys()
    assert not gone, f"{sorted(gone)} have one meaning now: take them off the list"


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("class Tile: ...", {"Tile"}),
        ("def cut(x):\n    def inner(): ...\n    class Local: ...", {"cut"}),
        ("Box = tuple[int, int]", {"Box"}),
        ("Box: TypeAlias = tuple[int, int]", {"Box"}),
        ("class _Hidden: ...\ndef _hidden(): ...", set()),
        ("STEPS = 3\nT = TypeVar('T')\nSides = TypeVar('Sides')", set()),
    ],
)
def test_the_walk_sees_every_name_that_has_a_meaning(source: str, expected: set[str]) -> None:
    assert names_of(source) == expected


def test_a_name_in_two_modules_is_found_with_its_places() -> None:
    sources = {"a.py": "class State: ...", "b.py": "State = dict[str, int]", "c.py": "STATE = 1"}
    assert twice(sources) == {"State": ["a.py", "b.py"]}
