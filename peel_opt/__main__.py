"""``python -m peel_opt`` is ``peel-opt``."""

import sys

from .app.cli.main import main

sys.exit(main())
