"""Verbs that keep what was done, show it as a script, and do it again."""

from pathlib import Path
from typing import Any

from napari.layers import Image as ImageLayer

from ...arguments import refusal
from ...io import read_record, record_from
from ...pipeline import Record, Repeated
from ...pipeline import repeating as doing_again
from ...pipeline.repeat import places
from ..pixels import source_of
from ..provenance import provenance
from ..script import as_script
from .memory import check_room
from .products import Product
from .step import Effects, Level, Step
from .way import how_far, record_of, way_of
from .whole import Whole, keep_whole
from .workspace import Workspace


class RecordVerbs(Workspace):
    """Verbs of a session that keep what was done, show it as a script, and do it again."""

    def record(self) -> dict[str, Any]:
        """All that was done on the photo and what came out, JSON-safe."""
        return session_record(self)

    def script(self) -> str:
        """What was done on the photo, as a Python script that runs without a display."""
        return as_script(self.record())

    def repeat(self, saved: Record | Path | str | dict[str, Any]) -> list[str]:
        """Do on this photo what was done on it before, or on another one.

        Parameters
        ----------
        saved : path, dict or Record
            A file of a record, or what :meth:`record` or the metadata of a layer hold.

        Returns
        -------
        list of str
            Whether the same came out, pixel by pixel, and if not, why; as the session says it.
        """
        return self.do(repeating_record(self, saved))


def session_record(session: Workspace) -> dict[str, Any]:
    """What was done on the photo of a session, and what came out, JSON-safe."""
    photo, source = session.source()
    state = session.state
    method = None if state.sharp is None else state.sharp.record.options.method
    record = state.record or record_of(source, way_of(state, method=method), how_far(state))
    return provenance(photo, "session", state, record)


def repeating_record(
    session: Workspace, saved: Record | Path | str | dict[str, Any]
) -> Step[Repeated, list[str]]:
    """Step of :meth:`RecordVerbs.repeat`."""
    record = _read(saved)
    photo, _ = session.source()
    white = _white(record, session, photo)
    source = source_of(photo, white)
    record.check_fits(source)
    plane, region = places(record, source)
    check_room(source, region)

    def finish(repeated: Repeated) -> Effects[list[str]]:
        if white != session.white_of(photo):
            session.set_white(photo, white)
        product = None
        if repeated.result is not None:
            product = Product(repeated.restored, repeated.photo, repeated.result)
        whole = Whole(repeated.found, product)
        yield from keep_whole(session, photo, source, whole, record.options, plane, region)
        same = repeated.same_result
        said = repeated.sentences
        session.say("\n".join(said), Level.DOUBT if same is False else Level.INFO)
        return said

    return Step("repeating", doing_again(record, source), finish)


def _white(record: Record, session: Workspace, photo: ImageLayer) -> float | None:
    """That of the record; if it had none, that of a photo of another kind of number."""
    if record.white is not None or record.photo.kind == source_of(photo, white=1.0).dtype.name:
        return record.white
    return session.white_of(photo)


def _read(saved: Record | Path | str | dict[str, Any]) -> Record:
    if isinstance(saved, Record):
        return saved
    if isinstance(saved, dict):
        return record_from(saved, "the record")
    if not isinstance(saved, str | Path):
        raise refusal("a record, or the file of one", saved)
    return read_record(Path(saved))
