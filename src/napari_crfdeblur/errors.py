"""The one error that a photograph, rather than a programmer, can cause."""


class CrfDeblurError(Exception):
    """A photo, PSF or file that does not permit the step; the message says what to do."""
