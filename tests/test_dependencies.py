"""What is imported is declared, and what is declared is imported."""

import ast
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
NAME = "napari_crfdeblur"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
DISTRIBUTIONS = {"PIL": "pillow", "skimage": "scikit-image"}  # where the names differ
HOST = {"napari", "npe2"}  # what the plugin finds where it runs
OPTIONAL = {
    "numba": "fast",
    "distributed": "large",
    "numcodecs": "large",
    "zarr": "large",
}  # and the extra it is in


def declared(requirements: list[str]) -> set[str]:
    """Names of distributions."""
    return {re.match(r"[\w-]+", each).group() for each in requirements}


def imported(inside_plugin: bool) -> set[str]:
    """Distributions whose modules the package imports anywhere, also inside functions."""
    found = set()
    for path in (ROOT / "src" / NAME).rglob("*.py"):
        if ("_napari" in path.parts) is not inside_plugin:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(node.module.split(".")[0])
    found -= sys.stdlib_module_names | {NAME}
    return {DISTRIBUTIONS.get(name, name.replace("_", "-")) for name in found}


def test_what_the_core_imports_is_declared() -> None:
    assert imported(inside_plugin=False) - set(OPTIONAL) <= declared(PROJECT["dependencies"])


def test_what_the_plugin_imports_is_declared() -> None:
    assert imported(inside_plugin=True) - HOST <= declared(PROJECT["dependencies"])
    assert declared(PROJECT["optional-dependencies"]["all"]) >= HOST


def test_what_is_optional_is_in_its_extra() -> None:
    extras = PROJECT["optional-dependencies"]
    for name, extra in OPTIONAL.items():
        assert name in declared(extras[extra])
        assert name in declared(extras["test"]), "tested"


def test_what_is_declared_is_imported() -> None:
    used = imported(inside_plugin=False) | imported(inside_plugin=True)
    assert declared(PROJECT["dependencies"]) <= used
    assert set(OPTIONAL) | HOST <= used
