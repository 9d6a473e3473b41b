"""Walking R(x) = 0: points, steps, special points, the primary branch.

No single solve finds an equilibrium; a path does.  It may know `residual`.
"""
