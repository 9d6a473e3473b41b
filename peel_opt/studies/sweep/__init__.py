"""Grids of questions, answered on all cores and resumed after an interruption."""
