"""Verbs of a session that keep, write and repeat what was done."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from ...errors import CrfDeblurError
from .. import provenance, script, steps
from ..step import Step
from ..workspace import Workspace


class RecordVerbs(Workspace):
    """Verbs of a session that keep, write and repeat what was done."""

    def script(self) -> str:
        """What was done on the photo, as a Python script that runs without a display."""
        return script.as_script(self.record())

    def export(self, what: str, path: Path | str) -> Path:
        """Write a part of the session to a file.

        Parameters
        ----------
        what : str
            ``report``, ``response``, ``edges``, ``PSF``, ``session``, ``Python script``, or
            ``plot of the`` ``response``, ``profiles``, ``edges`` or ``PSF``.
        path : Path
            Its suffix says the kind: ``.html`` or ``.png`` for the report, ``.json`` or
            ``.csv`` for edges, ``.npy``, ``.tif``, ``.png`` or ``.json`` for the PSF (only the
            last keeps those of all parts), ``.png``, ``.svg`` or ``.pdf`` for plots, ``.json``
            and ``.py`` for the rest.

        Raises
        ------
        CrfDeblurError
            There is no such part yet, or the file cannot be written.
        """
        return self.do(steps.exporting(self, what, path))

    def save(self, path: Path | str) -> None:
        """Save what was done, to be loaded and repeated."""
        self.export("session", path)

    def repeat(self, saved: Path | str | dict[str, Any]) -> None:
        """Do on this photo what was done on another one.

        Parameters
        ----------
        saved : path or dict
            A session file, or what :meth:`record` or the metadata of a layer hold.
        """
        for make in self.repeating(saved):
            self.do(make())

    def repeating(self, saved: Path | str | dict[str, Any]) -> list[Callable[[], Step[Any, Any]]]:
        """The steps of :meth:`repeat`, each to be made when the one before is done."""
        if isinstance(saved, dict):
            actions = provenance.actions_of(saved, "the session")
        else:
            actions = provenance.read_session(Path(saved))
        unknown = [action.verb for action in actions if action.verb not in steps.REPEATABLE]
        if unknown:
            raise CrfDeblurError(f"“{unknown[0]}” cannot be repeated; the session is damaged")
        self._required_photo()
        return [
            partial(steps.REPEATABLE[action.verb], self, **action.arguments) for action in actions
        ]
