"""The package as its users meet it: names, version, command, manifest, files."""

import re
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path

import pytest

import napari_crfdeblur
from napari_crfdeblur._version import __version__

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "napari_crfdeblur"
MANIFEST = PACKAGE / "napari.yaml"


def constants_classes_functions(name: str) -> tuple[int, str]:
    """Key of the order that ruff's RUF022 enforces."""
    return (0 if name.isupper() else 1 if name[0].isupper() else 2), name


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True)


def modules_loaded_by(code: str) -> set[str]:
    done = run("-c", f"{code}\nimport sys\nprint('loaded:', *sys.modules)")
    assert done.returncode == 0, done.stderr
    return set(done.stdout.rpartition("loaded:")[2].split())


def test_public_names_are_few_and_sorted() -> None:
    names = list(napari_crfdeblur.__all__)
    assert names == sorted(set(names), key=constants_classes_functions)
    assert 10 <= len(names) <= 22  # about 20: the verbs and the types in their signatures


def test_every_public_name_resolves_and_is_listed() -> None:
    for name in napari_crfdeblur.__all__:
        assert getattr(napari_crfdeblur, name) is not None
    assert set(napari_crfdeblur.__all__) <= set(dir(napari_crfdeblur))


def test_the_session_is_offered_and_says_what_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "Session" in dir(napari_crfdeblur)
    napari_crfdeblur.__dict__.pop("Session", None)
    assert napari_crfdeblur.Session.__name__ == "Session"
    napari_crfdeblur.__dict__.pop("Session")
    monkeypatch.setattr(napari_crfdeblur, "find_spec", lambda _: None)
    with pytest.raises(ImportError, match="install napari"):
        napari_crfdeblur.Session  # noqa: B018 - looking it up is the test


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no_such_name"):
        napari_crfdeblur.no_such_name  # noqa: B018 - looking it up is the test


def test_importing_the_package_loads_no_numpy() -> None:
    assert "numpy" not in modules_loaded_by("import napari_crfdeblur")


@pytest.mark.parametrize(
    "arguments", [["--help"], ["--version"], ["deblur", "--help"], ["batch", "--help"]]
)
def test_asking_the_command_for_help_loads_no_numpy(arguments: list[str]) -> None:
    code = (
        "from napari_crfdeblur.cli import main\n"
        f"try: code = main({arguments})\n"
        "except SystemExit as stop: code = stop.code\n"
        "assert not code, code"
    )
    assert not modules_loaded_by(code) & {"numpy", "dask", "distributed", "zarr"}


def test_the_stages_load_no_dask_until_a_large_photo_needs_it() -> None:
    loaded = modules_loaded_by("from napari_crfdeblur.cli import commands")
    assert not loaded & {"dask", "distributed", "zarr"}


def test_help_names_every_command() -> None:
    code = "from napari_crfdeblur.cli import main; main(['--help'])"
    shown = run("-c", code).stdout
    for command in ("demo", "deblur", "batch", "estimate", "psf", "simulate"):
        assert re.search(rf"\b{command}\b", shown), f"{command} is not in:\n{shown}"


def test_the_command_is_installed() -> None:
    scripts = distribution("napari-crfdeblur").entry_points.select(group="console_scripts")
    assert {s.name: s.value for s in scripts} == {"crfdeblur": "napari_crfdeblur.cli:main"}


def test_there_is_one_version() -> None:
    assert napari_crfdeblur.__version__ == __version__
    assert distribution("napari-crfdeblur").version == __version__
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {__version__}\n" in citation
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(r"^## \[(.+?)\]", changelog, flags=re.MULTILINE).group(1) == __version__


def test_the_manifest_at_the_top_is_the_one_in_the_package() -> None:
    # A link in the repository; a source archive may hold a copy.
    assert (ROOT / "napari.yaml").read_bytes() == MANIFEST.read_bytes()
    if (ROOT / ".git").exists():
        assert (ROOT / "napari.yaml").resolve() == MANIFEST.resolve()


def test_the_manifest_names_the_plugin() -> None:
    text = MANIFEST.read_text(encoding="utf-8")
    top = dict(re.findall(r"^(\w+):[ \t]*(.*)$", text, flags=re.MULTILINE))
    assert {"name", "display_name", "contributions"} <= set(top)
    assert top["name"] == distribution("napari-crfdeblur").metadata["Name"]
    assert 3 <= len(top["display_name"]) <= 90  # the limits that napari sets


def test_napari_finds_the_manifest() -> None:
    (entry,) = distribution("napari-crfdeblur").entry_points.select(group="napari.manifest")
    assert (entry.name, entry.value) == ("napari-crfdeblur", "napari_crfdeblur:napari.yaml")


def test_the_package_is_marked_as_typed() -> None:
    assert (PACKAGE / "py.typed").is_file()


def test_no_file_names_a_place_on_somebodys_machine() -> None:
    place = re.compile(r"(?<![\w.~])/(home|root|tmp|Users|work|mnt|opt)/|\b[A-Z]:\\\\?\w")
    for path in sorted(PACKAGE.rglob("*")):
        if path.suffix in {".py", ".yaml", ".json", ".typed", ".md", ".txt"}:
            found = place.search(path.read_text(encoding="utf-8"))
            assert not found, f"{path.relative_to(ROOT)}: {found and found.group()}"
