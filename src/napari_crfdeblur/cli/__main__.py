"""``python -m napari_crfdeblur.cli``."""

import sys

from . import main

sys.exit(main())
