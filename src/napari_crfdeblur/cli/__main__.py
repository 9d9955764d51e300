"""``python -m napari_crfdeblur.cli``, the same as the command ``crfdeblur``."""

import sys

from . import main

if __name__ == "__main__":
    sys.exit(main())
