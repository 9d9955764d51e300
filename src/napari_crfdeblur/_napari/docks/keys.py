"""Keys of a viewer that work while a widget is open, and leave those of others alone."""

from collections.abc import Callable, Mapping
from typing import Any
from weakref import WeakValueDictionary

from napari.components import ViewerModel
from napari.utils.key_bindings import coerce_keybinding

FLIP = "Control-Alt-B"
FIND_EDGES = "Control-Alt-E"
UNDO_EDGES = "Control-Alt-Z"
PREVIEW = "Control-Alt-R"  # Control-Alt-P plays a stack in napari

_KEYS: "WeakValueDictionary[int, Keys]" = WeakValueDictionary()


class Keys:
    """The keys of one viewer: bound as long as an open widget offers them.

    A key that has another meaning already, in this viewer or in napari, keeps it.

    Parameters
    ----------
    viewer : napari.components.ViewerModel
        Whose canvas listens to the keys.
    """

    def __init__(self, viewer: ViewerModel) -> None:
        self._viewer = viewer
        self._offers: dict[int, Mapping[str, Callable[[], Any]]] = {}
        self._bound: dict[str, Callable[[ViewerModel], None]] = {}
        _KEYS[id(viewer)] = self

    @classmethod
    def of(cls, viewer: ViewerModel) -> "Keys":
        """The keys that all widgets of a viewer share; made on first use."""
        return _KEYS.get(id(viewer)) or cls(viewer)

    @property
    def in_use(self) -> bool:
        """Whether a widget is open."""
        return bool(self._offers)

    def add(self, owner: object, acts: Mapping[str, Callable[[], Any]]) -> None:
        """A widget was opened: its keys work from now on, instead of those of others."""
        self._offers[id(owner)] = acts
        self._update()

    def remove(self, owner: object) -> None:
        """A widget was closed: what no other offers is unbound."""
        self._offers.pop(id(owner), None)
        self._update()

    def _update(self) -> None:
        offered = {key for acts in self._offers.values() for key in acts}
        for key in self._bound.keys() - offered:
            self._unbind(key)
        for key in offered - self._bound.keys():
            self._bind(key)

    def _bind(self, key: str) -> None:
        binding = coerce_keybinding(key)
        if binding in self._viewer.keymap or binding in type(self._viewer).class_keymap:
            return

        def press(_: ViewerModel) -> None:
            newest = [acts[key] for acts in self._offers.values() if key in acts][-1]
            newest()

        press.__doc__ = f"{key} of napari-crfdeblur"
        self._viewer.bind_key(key, press)
        self._bound[key] = press

    def _unbind(self, key: str) -> None:
        press = self._bound.pop(key)
        # Whoever has bound it anew with overwrite=True keeps it.
        if self._viewer.keymap.get(coerce_keybinding(key)) is press:
            self._viewer.bind_key(key, None)
