"""What is true on paper: rod, bond, groups, equations, series.

No solver is in here.  It may know `base`.
"""
