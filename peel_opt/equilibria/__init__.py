"""Questions in, certified results out: `Equilibrium` and `Branch`.

It may know `continuation`; every number it returns has its error and its certificate.
"""
