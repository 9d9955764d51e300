"""All outputs of a run: apart from its inputs, and there together or not at all."""

import os
import unicodedata
import weakref
from collections.abc import Iterable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from ..errors import CrfDeblurError
from ..interrupts import uninterrupted
from .files import check_folder, check_output, make_folder
from .places import Place, resolved, unwritable


@dataclass(frozen=True, slots=True)
class Output:
    """A file or folder that a run is to write.

    Parameters
    ----------
    path : Path
    suffixes : sequence of str
        Kinds of file that can be written, such as ``.png``.
    folder : bool
        Whether it is a folder, such as one of zarr, which is replaced as a whole.
    """

    path: Path
    suffixes: Sequence[str]
    folder: bool = False

    def check(self) -> None:
        """Refuse what could not be written."""
        if self.folder:
            check_folder(resolved(self.path).parent)
        else:
            check_output(self.path, self.suffixes)


class Outputs:
    """Everything that a run writes; in a ``with`` around the work and the writing.

    On entry, what cannot be written or would destroy an input is refused. Inside, each output is
    written to ``outputs[path]``, beside its place. At the end all of them appear, or, if the work
    or one of them fails, none does: what was there before is there again. What was not written
    by then stays as it was.

    Parameters
    ----------
    inputs : iterable of Path
        All files and folders that the run reads.
    outputs : iterable of Output
        All that it may write.
    folders : iterable of Path
        Made if they are missing, and taken away if the run fails.

    Raises
    ------
    CrfDeblurError
        On entry, an output that is an input or another output, lies in one or holds one, or
        that could not be written; at the end, one that cannot be written.
    """

    def __init__(
        self, inputs: Iterable[Path], outputs: Iterable[Output], folders: Iterable[Path] = ()
    ) -> None:
        self._inputs, self._planned, self._folders = [*inputs], [*outputs], [*folders]
        self._places: dict[Path, Place] = {}
        self._made: list[Path] = []
        self._drop = weakref.finalize(self, _take_away, self._made)

    def __enter__(self) -> "Outputs":
        planned, self._planned = self._planned, []
        with ExitStack() as undoing:
            undoing.callback(self._drop)
            for folder in self._folders:
                self._made += _missing(folder)
                make_folder(folder)
            for each in planned:
                self.add(each)
            undoing.pop_all()
        return self

    def add(self, output: Output) -> None:
        """Plan one more output, whose name is known only now.

        Raises
        ------
        CrfDeblurError
            As on entry.
        """
        check_apart([*self._inputs, *(each.path for each in self._planned)], [output.path])
        output.check()
        self._planned.append(output)
        self._places[output.path] = Place(output.path)

    @property
    def planned(self) -> tuple[Output, ...]:
        """All outputs, whether they are written yet or not."""
        return tuple(self._planned)

    def __getitem__(self, path: Path) -> Path:
        """Where an output is to be written until the end of the run; its name is the same."""
        return self._places[path].make()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if kind is None:
                with uninterrupted():
                    self._appear()
            elif isinstance(error, CrfDeblurError):
                self._say_where(error)
        finally:
            with uninterrupted():
                for place in self._places.values():
                    place.drop()
                self._drop()

    def _appear(self) -> None:
        places = [*self._places.values()]
        for number, place in enumerate(places):
            try:
                place.appear()
            except OSError as error:
                for each in reversed(places[: number + 1]):
                    each.back()
                raise unwritable(place.path, error) from error
        self._made.clear()

    def _say_where(self, error: CrfDeblurError) -> None:
        """Name the output, not what is beside its place, in the sentence of its writer."""
        for place in self._places.values():
            sentence = str(error)
            if sentence.startswith(str(place.new)):
                raise CrfDeblurError(f"{place.path}{sentence[len(str(place.new)) :]}") from error


def check_apart(inputs: Iterable[Path], outputs: Iterable[Path]) -> None:
    """Refuse outputs that would destroy an input, or each other.

    Files are the same by any of their names, links and hard links; a name that differs in
    capitals alone counts as the same, unless both are there and are two files.

    Parameters
    ----------
    inputs, outputs : iterable of Path
        Files and folders; those that are not there have nothing but their names.

    Raises
    ------
    CrfDeblurError
        An output is an input, lies in one or holds one; or so for two outputs.
    """
    others = [(_Spot.of(each), "is read by this run") for each in inputs]
    for path in outputs:
        target = _Spot.of(path)
        for other, what in others:
            _check_pair(target, other, what)
        others.append((target, "is written by this run already"))


def _check_pair(target: "_Spot", other: "_Spot", what: str) -> None:
    if target.is_at(other):
        alias = "" if target.path == other.path else f", as {other.path}"
        raise CrfDeblurError(f"{target.path}: {what}{alias}; choose another name")
    if target.is_in(other):
        raise CrfDeblurError(
            f"{target.path}: lies in {other.path}, which {what}; choose another place"
        )
    if other.is_in(target):
        raise CrfDeblurError(
            f"{target.path}: holds {other.path}, which {what}; choose another name"
        )


Mark = tuple[int, int, str]
"""Device and number of a file; or those of a folder, and a name in it."""


@dataclass(frozen=True, slots=True)
class _Spot:
    """What a path is, and what it lies in, whatever its name.

    Parameters
    ----------
    path : Path
        As the user calls it.
    own : str or Mark
        The file; None if it is not there.
    named : Mark
        The folder and the name in it, regardless of capitals.
    holders : frozenset of Mark
        All folders that it is in.
    """

    path: Path
    own: Mark | None
    named: Mark
    holders: frozenset[Mark]

    @classmethod
    def of(cls, path: Path) -> "_Spot":
        target = resolved(path)
        chain = [target, *target.parents]
        named = [_named(each) for each in chain]
        there = [_number(each) for each in chain]
        holders = {mark for mark in (*there[1:], *named[1:]) if mark is not None}
        return cls(path, there[0], named[0], frozenset(holders))

    def is_at(self, other: "_Spot") -> bool:
        """Whether both are one file or folder."""
        if self.own is not None and other.own is not None:
            return self.own == other.own
        return self.named == other.named

    def is_in(self, other: "_Spot") -> bool:
        """Whether the other one is a folder that this one is in."""
        return (other.own or other.named) in self.holders


def _number(path: Path) -> Mark | None:
    try:
        found = path.stat()
    except (OSError, ValueError):  # not there, or no name that a file can have: refused later
        return None
    return found.st_dev, found.st_ino, ""


def _named(path: Path) -> Mark:
    folder = _number(path.parent)
    name = path.name if folder else str(path)
    same = unicodedata.normalize("NFC", os.path.normcase(name)).casefold()
    device, number, _ = folder or (0, 0, "")
    return device, number, same


def _missing(folder: Path) -> list[Path]:
    """Folders that have to be made for this one, the outermost first."""
    return [each for each in (*reversed(folder.parents), folder) if _number(each) is None]


def _take_away(folders: list[Path]) -> None:
    """Take away folders, the innermost first, in which there is nothing else."""
    for each in reversed(folders):
        with suppress(OSError):  # something is in it, so that it is needed, or it was never made
            each.rmdir()
