"""R(x) = 0: the equations discretised, closed by a question, and solved where the start is near.

It may know `model`; it knows no branch and no state's name.
"""
