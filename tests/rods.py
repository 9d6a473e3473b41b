"""The rod of many tests."""

from __future__ import annotations

import peel_opt as po

#: The aortic flap of the paper.
FLAP = po.Rod(bending_stiffness=2.3e-5, adhesion_strength=140e3, adhesion_range=0.73e-3)
