"""When a widget is docked in a window, and when it or the window is closed."""

from collections.abc import Callable
from weakref import WeakMethod

from qtpy.QtCore import QEvent, QObject
from qtpy.QtWidgets import QWidget


class Lifetime(QObject):
    """Tells when a widget gets into a window, and when it is out of it again.

    napari closes a dock by taking the widget out of its frame (the widget lives on). It deletes
    a window with all that is in it: sooner or later after it was closed, which is told while
    all still exists, or at once. A dock that is merely hidden stays.

    Parameters
    ----------
    widget : QWidget
        The widget.
    on_open, on_close : callable
        Called in turn.
    """

    def __init__(
        self, widget: QWidget, on_open: Callable[[], object], on_close: Callable[[], object]
    ) -> None:
        super().__init__(widget)
        self._widget, self._on_open, self._on_close = widget, on_open, on_close
        self._open = False
        widget.installEventFilter(self)
        # Not a bound method, which Qt forgets with this object; weak, or nothing is ever freed.
        close = WeakMethod(self._close)

        def gone() -> None:
            _GONE.discard(gone)
            _call(close)

        _GONE.add(gone)
        widget.destroyed.connect(gone)

    def eventFilter(self, _: QObject | None, event: QEvent | None) -> bool:
        """Watch the widget, its frame and its window; never keep an event from them."""
        kind = None if event is None else event.type()
        if kind == QEvent.Type.ParentChange:
            self._parent_changed()
        elif kind == QEvent.Type.DeferredDelete:
            self._close()
        return False

    def _parent_changed(self) -> None:
        above = self._widget.parentWidget()
        if above is None:
            self._close()
            return
        while above is not None:
            above.installEventFilter(self)  # again, it counts once
            above = above.parentWidget()
        if not self._open:
            self._open = True
            self._on_open()

    def _close(self) -> None:
        if self._open:
            self._open = False
            self._on_close()


# What Qt calls when a widget is gone. Kept here: Python would empty a function that is collected
# together with the widget before Qt calls it, and that crashes.
_GONE: set[Callable[[], None]] = set()


def _call(method: WeakMethod[Callable[[], None]]) -> None:
    act = method()
    if act is not None:
        act()
