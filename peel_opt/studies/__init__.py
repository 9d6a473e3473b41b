"""Many answers: sweep, uncertainty, calibrate, design, tradeoff, a folder each.

None imports another's inside.  It may know all that answers, and draws nothing.
"""
