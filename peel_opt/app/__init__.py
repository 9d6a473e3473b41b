"""What people touch: cards, reports, the command line, the explorer.

Nothing below knows it.
"""
