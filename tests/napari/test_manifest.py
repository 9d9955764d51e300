"""What the manifest promises is there: `npe2 validate` passes misspelt keys and unknown names."""

import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace, UnionType
from typing import Annotated, Any, Union, get_args, get_origin
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from napari.components import ViewerModel
from npe2 import PluginManager, PluginManifest
from pydantic import BaseModel

import napari_crfdeblur
from napari_crfdeblur._napari import commands, preferences
from napari_crfdeblur._napari.preferences import Preferences
from napari_crfdeblur.methods import DECONVOLUTIONS, RESPONSES, words

NAME = "napari-crfdeblur"
PACKAGE = Path(napari_crfdeblur.__file__).parent
RAW = yaml.safe_load((PACKAGE / "napari.yaml").read_text(encoding="utf-8"))
GIVEN = RAW["contributions"]
COMMANDS = {command["id"]: command for command in GIVEN["commands"]}
WIDGETS = [widget["display_name"] for widget in GIVEN["widgets"]]
STEPS = ["1 Edges", "2 Response", "3 Blur", "4 Restore", "Deblur (all in one)", "Batch and export"]

# Where each entry of a menu appears, as napari shows it; in the order of the work.
STEP_BY_STEP = "Deblur in linear light, step by step"
ENTRIES = [
    ("Annotate", "Draw edges"),
    ("Measure", "Find straight edges"),
    ("Measure", "Estimate camera response"),
    ("Measure", "Estimate PSF"),
    ("Filter", "Deblur in linear light"),
    *(("Filter", STEP_BY_STEP, step) for step in STEPS),
]


def unknown_keys(raw: Any, kind: Any, where: str = "manifest") -> list[str]:
    """Keys of the raw manifest that no field of npe2's models takes."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return unknown_keys(raw, arguments[0], where)
    if origin in (Union, UnionType):
        members = [arm for arm in arguments if arm is not type(None)]
        return min((unknown_keys(raw, arm, where) for arm in members), key=len)
    if origin is list and isinstance(raw, list):
        own = (unknown_keys(e, arguments[0], f"{where}[{n}]") for n, e in enumerate(raw))
        return [key for keys in own for key in keys]
    if origin is dict and isinstance(raw, dict):
        own = (unknown_keys(e, arguments[1], f"{where}.{n}") for n, e in raw.items())
        return [key for keys in own for key in keys]
    if not (inspect.isclass(kind) and issubclass(kind, BaseModel) and isinstance(raw, dict)):
        return []
    fields = {key: f for name, f in kind.model_fields.items() for key in {name, f.alias or name}}
    found = [f"{where}.{key}" for key in raw if key not in fields]
    for key in raw.keys() & fields.keys():
        found += unknown_keys(raw[key], fields[key].annotation, f"{where}.{key}")
    return found


def referenced() -> Iterator[str]:
    """Every command that a contribution refers to."""
    for kind in ("widgets", "readers", "writers", "sample_data"):
        yield from (item["command"] for item in GIVEN[kind])
    for items in GIVEN["menus"].values():
        yield from (item["command"] for item in items if "command" in item)


def resolved(python_name: str) -> Any:
    module, _, name = python_name.partition(":")
    return getattr(import_module(module), name)


def entries_of(menu: Any, above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Path and action of every entry of a menu of the window, as it opens."""
    menu.aboutToShow.emit()
    for action in menu.actions():
        title = action.text().removesuffix(f" ({NAME})")
        if action.menu() is None:
            yield (*above, title), action
        else:
            yield from entries_of(action.menu(), (*above, title))


def test_every_key_of_the_manifest_is_one_that_npe2_knows() -> None:
    assert unknown_keys(RAW, PluginManifest) == []


@pytest.mark.parametrize(
    "misspelt",
    [
        {"display_nam": "x"},
        {"contributions": {"widget": []}},
        {"contributions": {"sample_data": [{"command": "a", "key": "b", "name": "c"}]}},
        {"contributions": {"menus": {"napari/layers/filter": [{"comand": "x"}]}}},
        {"contributions": {"configurations": {"a": {"properties": {"b": {"defaults": 1}}}}}},
    ],
)
def test_a_misspelt_key_is_seen_at_any_depth(misspelt: dict[str, Any]) -> None:
    assert len(unknown_keys(misspelt, PluginManifest)) == 1


def test_the_manifest_is_valid_and_napari_finds_it(manifest: PluginManifest) -> None:
    assert manifest.name == NAME
    assert len(manifest.contributions.commands or []) == len(COMMANDS) == len(GIVEN["commands"])


def test_a_dock_has_one_name_however_it_is_opened(manifest: PluginManifest) -> None:
    # Menus put the display name in a dock's name, `add_plugin_dock_widget` the plugin's.
    assert manifest.display_name == manifest.name


@pytest.mark.parametrize("command", COMMANDS.values(), ids=lambda command: command["id"])
def test_every_command_is_a_callable_of_the_package(command: dict[str, Any]) -> None:
    assert command["python_name"].startswith("napari_crfdeblur._napari.")
    assert callable(resolved(command["python_name"]))


def test_every_command_is_used_and_every_used_command_exists() -> None:
    assert set(referenced()) == set(COMMANDS)


def test_a_sample_does_not_take_the_name_of_a_command() -> None:
    # napari registers both under PLUGIN.NAME.
    keys = {f"{NAME}.{sample['key']}" for sample in GIVEN["sample_data"]}
    assert len(keys) == len(GIVEN["sample_data"])
    assert not keys & set(COMMANDS)


def test_widgets_come_in_the_order_of_the_work() -> None:
    assert WIDGETS == STEPS


@pytest.mark.parametrize("name", WIDGETS)
def test_every_widget_works_without_a_window(name: str, qtbot: Any, viewer: ViewerModel) -> None:
    (command,) = (w["command"] for w in GIVEN["widgets"] if w["display_name"] == name)
    dock = resolved(COMMANDS[command]["python_name"])(napari_viewer=viewer)
    qtbot.addWidget(dock.native)
    assert dock.photo is None
    assert not dock.busy


@pytest.mark.usefixtures("plugin")
def test_every_entry_appears_in_its_menu(make_napari_viewer: Any) -> None:
    window = make_napari_viewer().window
    ours = [path for path, _ in entries_of(window.layers_menu) if path in ENTRIES]
    assert sorted(ours) == sorted(ENTRIES)
    assert [path for path in ours if STEP_BY_STEP in path] == ENTRIES[-len(STEPS) :]
    assert [path for path in ours if path[0] == "Measure"] == ENTRIES[1:4]
    plugins = [path for path, _ in entries_of(window.plugins_menu)]
    assert {(NAME, step) for step in STEPS} <= set(plugins)
    samples = {path[-1] for path, _ in entries_of(window.file_menu) if NAME in path}
    assert samples == {sample["display_name"] for sample in GIVEN["sample_data"]}


def test_the_list_of_entries_is_complete() -> None:
    submenus = {menu["id"]: menu["label"] for menu in GIVEN["submenus"]}
    count = 0
    for menu, items in GIVEN["menus"].items():
        assert menu in submenus or menu.startswith("napari/layers/")
        assert {item["submenu"] for item in items if "submenu" in item} <= set(submenus)
        count += sum("command" in item for item in items)
    assert count == len(ENTRIES)
    assert set(submenus.values()) == {STEP_BY_STEP}


@pytest.mark.usefixtures("plugin")
def test_commands_wait_for_a_layer(make_napari_viewer: Any) -> None:
    viewer = make_napari_viewer()
    immediate = [path for path in ENTRIES if STEP_BY_STEP not in path]
    for expected in (False, True):
        actions = dict(entries_of(viewer.window.layers_menu))
        assert [actions[path].isEnabled() for path in immediate] == [expected] * len(immediate)
        viewer.add_image(np.eye(9, 12))


@pytest.mark.usefixtures("plugin")
def test_menus_and_scripts_open_the_same_dock(make_napari_viewer: Any) -> None:
    viewer = make_napari_viewer()
    before = len(viewer.window.dock_widgets)
    name = "Deblur (all in one)"
    dict(entries_of(viewer.window.plugins_menu))[NAME, name].trigger()
    viewer.window.add_plugin_dock_widget(NAME, name)
    assert len(viewer.window.dock_widgets) == before + 1


@pytest.mark.parametrize(
    ("command", "dock", "act"),
    [
        (commands.find_edges, "1 Edges", "run"),
        (commands.draw_edges, "1 Edges", "draw"),
        (commands.estimate_response, "2 Response", "run"),
        (commands.estimate_psf, "3 Blur", "run"),
        (commands.deblur, "Deblur (all in one)", "run"),
    ],
)
@pytest.mark.usefixtures("plugin")
def test_a_menu_command_starts_its_dock_on_the_selected_photo(
    command: Any, dock: str, act: str, make_napari_viewer: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    title = COMMANDS[f"{NAME}.{command.__name__}"]["title"]
    viewer = make_napari_viewer()
    first, second = viewer.add_image(np.eye(9, 12)), viewer.add_image(np.eye(7, 11))
    viewer.layers.selection.active = first
    stub, said = SimpleNamespace(photo=second), []
    stub.run = lambda *, block: said.append(("run", block, stub.photo))
    stub.draw = lambda: said.append(("draw", False, stub.photo))
    frame = SimpleNamespace(show=lambda: said.append("shown"), raise_=lambda: None)

    def opened(plugin: str, name: str) -> tuple[Any, Any]:
        assert (plugin, name) == (NAME, dock)
        return frame, stub

    monkeypatch.setattr(viewer.window, "add_plugin_dock_widget", opened)
    (action,) = (
        a
        for path, a in entries_of(viewer.window.layers_menu)
        if path in ENTRIES and path[-1] == title
    )
    action.trigger()
    assert said == ["shown", (act, False, first)]


def test_a_command_keeps_the_photo_if_a_result_is_selected() -> None:
    viewer = ViewerModel()
    viewer.add_image(np.eye(9, 12), name="PSF", metadata={NAME: {"kind": "PSF"}})
    chosen = object()
    dock = SimpleNamespace(photo=chosen, run=lambda **_: None)
    frame = SimpleNamespace(show=lambda: None, raise_=lambda: None)
    window = SimpleNamespace(add_plugin_dock_widget=lambda *_: (frame, dock))
    for active in (*viewer.layers, viewer.add_shapes(), None):
        viewer.layers.selection.active = active
        commands.estimate_psf(SimpleNamespace(window=window, layers=viewer.layers))
        assert dock.photo is chosen


@pytest.mark.usefixtures("plugin_settings")
def test_the_settings_start_with_the_defaults_of_the_code(npe2pm: Any) -> None:
    assert NAME not in npe2pm
    assert preferences.preferences() == Preferences()
    npe2pm.register(PluginManifest.from_distribution(NAME))
    from napari.settings import get_plugin_settings

    assert NAME in get_plugin_settings()
    assert preferences.preferences() == Preferences()


@pytest.mark.usefixtures("plugin_settings")
def test_what_the_user_sets_is_preferred(npe2pm: Any) -> None:
    npe2pm.register(PluginManifest.from_distribution(NAME))
    from napari.settings import get_plugin_settings

    defaults = get_plugin_settings(NAME).defaults
    defaults.blur_extent, defaults.response, defaults.live = 12.5, "srgb", False
    defaults.deconvolution, defaults.compare = "wiener", True
    expected = Preferences(12.5, "srgb", "wiener", compare=True, live=False)
    assert preferences.preferences() == expected
    preferences.prefer_cameras(Path("cameras"))
    assert preferences.preferences() == replace(expected, cameras="cameras")
    npe2pm.disable(NAME)
    preferences.prefer_cameras(Path("others"))
    assert preferences.preferences() == Preferences()


def test_the_settings_offer_what_the_code_documents() -> None:
    properties = GIVEN["configurations"]["defaults"]["properties"]
    assert list(properties) == list(Preferences.__dataclass_fields__)
    for choice in properties["response"]["enum"] + properties["deconvolution"]["enum"]:
        assert f"``{choice}``" in (Preferences.__doc__ or "")
    assert properties["deconvolution"]["enum"] == [*words(DECONVOLUTIONS)]
    assert {*properties["response"]["enum"]} - {"gamma", "srgb"} <= {*words(RESPONSES)}


def test_the_icon_is_a_drawing_inside_the_package(manifest: PluginManifest) -> None:
    package, _, name = str(manifest.icon).partition(":")
    resource = files(package) / name
    assert Path(str(resource)).is_relative_to(PACKAGE)
    drawing = ElementTree.fromstring(resource.read_text(encoding="utf-8"))
    assert drawing.tag.endswith("svg")
    colors = set(re.findall(r"#[0-9a-f]{6}", resource.read_text(encoding="utf-8")))
    levels = [int(color[i : i + 2], 16) for color in colors for i in (1, 3, 5)]
    luminances = np.reshape(levels, (-1, 3)) @ [0.21, 0.72, 0.07]
    assert np.all((luminances > 60) & (luminances < 200)), "lost on a dark or a light ground"


def test_the_manifest_at_the_root_is_a_link_to_that_of_the_package() -> None:
    link = Path(__file__).parents[2] / "napari.yaml"
    if not (link.parent / ".git").exists():
        pytest.skip("a source archive may hold a copy")
    assert link.is_symlink()
    assert link.resolve() == PACKAGE / "napari.yaml"


def test_loading_the_plugin_loads_no_library() -> None:
    code = (
        "import sys, napari_crfdeblur._napari, napari_crfdeblur._napari.commands\n"
        "print(*{name.split('.')[0] for name in sys.modules} & "
        "{'numpy', 'scipy', 'napari', 'magicgui', 'qtpy', 'matplotlib'})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []


def test_registering_the_plugin_imports_nothing_of_it(plugin: PluginManager) -> None:
    assert NAME in plugin
    code = (
        "import sys\n"
        "from npe2 import PluginManager\n"
        "PluginManager.instance().discover()\n"
        f"assert {NAME!r} in PluginManager.instance()\n"
        "print(*(name for name in sys.modules if name.startswith('napari_crfdeblur.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.split()) <= {"napari_crfdeblur._version"}
