"""Measured figures beside what is asked: ``python -m benchmarks.run``."""
