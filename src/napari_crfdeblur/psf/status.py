"""How far a PSF can be trusted."""

from enum import Enum


class PsfStatus(Enum):
    """How far a PSF can be trusted; the value is the sentence that the user reads."""

    GOOD = "the PSF is clearly determined"
    GIVEN = "the PSF was given"
    EDITED = "the PSF was estimated, and edited by hand"
    BORROWED = "the PSF of this part follows from those of the others"
    DOUBTFUL = (
        "the PSF is uncertain: give its size, choose a sharper-edged region, or point to a streak"
    )
    INCOMPLETE = (
        "the edges leave the PSF open: add edges of other orientations, or find it from the picture"
    )

    @property
    def doubted(self) -> bool:
        """Whether the user should look at the PSF before it is used."""
        return self in (PsfStatus.DOUBTFUL, PsfStatus.INCOMPLETE)
