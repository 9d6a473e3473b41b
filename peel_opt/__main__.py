"""``python -m peel_opt`` is ``peel-opt``."""

import sys

from .cli import main

sys.exit(main())
