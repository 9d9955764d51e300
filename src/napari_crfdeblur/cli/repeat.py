"""``crfdeblur repeat``: what a record says, done again, and whether the same comes out."""

from argparse import Namespace
from pathlib import Path

from ..errors import CrfDeblurError
from ..io import Output, images, read_photo, read_record, write_photo
from ..io.limits import Limits
from ..large import open_source
from ..large.deblur import stored_stack
from ..pipeline import PhotoStack, Pixels, Record, repeating
from ..pipeline.record import identifying
from ..pipeline.repeat import told
from .bar import run
from .choices import limits_of
from .files import photo_or_zarr, writing
from .large import ENDINGS, check_place, deblur_in_tiles
from .terminal import say

PLANE = 2  # axes


def repeat(arguments: Namespace) -> bool:
    """``crfdeblur repeat``; whether the same came out, as far as that can be compared."""
    record = read_record(arguments.record_file)
    if record.tiled:
        return _in_tiles(arguments, record)
    output = arguments.output
    with writing(arguments, [Output(output, images.WRITABLE)] if output else []) as outputs:
        again = run(repeating(record, _stack(arguments.photo, record, limits_of(arguments))))
        if output:
            if again.restored.photo is None or again.restored.photo.ndim > PLANE + 1:
                raise CrfDeblurError(
                    f"{output}: the record is not of a single photo that was deblurred; leave "
                    "out -o, or repeat it in the window"
                )
            write_photo(outputs[output], again.restored.photo, like=arguments.photo)
    return _said(record, again.photo, again.same_result, output)


def _in_tiles(arguments: Namespace, record: Record) -> bool:
    photo, output = arguments.photo, arguments.output
    if output is None:
        raise CrfDeblurError("this was done in tiles, whose result needs a file: give -o FILE")
    check_place(photo, output)
    with writing(arguments, [photo_or_zarr(output, ENDINGS)]) as outputs:
        source = open_source(photo, limits=limits_of(arguments))
        place = outputs[output]
        deblur_in_tiles(photo, source, place, record.options, None)
        before = run(identifying(stored_stack(source, photo.name)))
        after = run(identifying(stored_stack(open_source(place), output.name)))
    same = None
    if record.result is not None and before.same_as(record.photo):
        same = after.same_as(record.result)
    return _said(record, before, same, output)


def _stack(path: Path, record: Record, limits: Limits) -> PhotoStack:
    """The photo as the record's was: a single one, or a stack that is read slice by slice."""
    colored = len(record.photo.shape) > PLANE and record.photo.shape[-1] in (3, 4)
    if len(record.photo.shape) - colored > PLANE or path.is_dir():
        return stored_stack(open_source(path, limits=limits), path.name, record.white)
    photo = read_photo(path, limits=limits)
    return PhotoStack(photo, photo.ndim > PLANE, record.white, path.name)


def _said(record: Record, photo: Pixels, same: bool | None, output: Path | None) -> bool:
    for sentence in told(record, photo, same):
        say(sentence)
    if output:
        say(f"wrote {output}")
    return same is not False
