"""Asking for files and names: the only dialogs of the widgets."""

from collections.abc import Sequence
from pathlib import Path

from qtpy.QtWidgets import QFileDialog, QInputDialog, QWidget


def ask_open(parent: QWidget, title: str, suffixes: Sequence[str]) -> Path | None:
    """File to be opened; None if the user thinks better of it."""
    path, _ = QFileDialog.getOpenFileName(parent, title, "", _pattern(suffixes))
    return Path(path) if path else None


def ask_open_many(parent: QWidget, title: str, suffixes: Sequence[str]) -> list[Path]:
    """Files to be opened, none if the user thinks better of it."""
    paths, _ = QFileDialog.getOpenFileNames(parent, title, "", _pattern(suffixes))
    return [Path(path) for path in paths]


def ask_save(parent: QWidget, title: str, suffixes: Sequence[str]) -> Path | None:
    """File to be written, with the first suffix if it is given without; None for none."""
    path, _ = QFileDialog.getSaveFileName(parent, title, "", _pattern(suffixes))
    if not path:
        return None
    return Path(path) if Path(path).suffix else Path(path).with_suffix(suffixes[0])


def ask_folder(parent: QWidget, title: str) -> Path | None:
    """Folder to write to; None if the user thinks better of it."""
    path = QFileDialog.getExistingDirectory(parent, title)
    return Path(path) if path else None


def ask_name(parent: QWidget, title: str, what: str) -> str | None:
    """A name; None if the user thinks better of it."""
    name, given = QInputDialog.getText(parent, title, what)
    return name.strip() or None if given else None


def _pattern(suffixes: Sequence[str]) -> str:
    return f"({' '.join('*' + suffix for suffix in suffixes)})"
