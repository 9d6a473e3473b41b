"""Points of a chunk that are answered together, as the rows that single calls would make of them."""

from __future__ import annotations

import math

import numpy as np

from ...equilibria.answers import found_together
from ...equilibria.question import ASKS, RATIO, known_law
from ...equilibria.unfolded import Many
from ...model.groups import PI4
from ...model.rod import MATERIAL
from .plan import GIVEN, Task, given_among

#: Numbers and texts of an answer by the names that a sweep has for them, where they are others.
NAMES = {
    **{"error": "errors", "certificate": "certificates", "condition": "conditions"},
    **{"status": "statuses", "state": "states", "law": "laws", "message": "reasons"},
}


def answered_together(task: Task, numbers: tuple[str, ...], texts: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Return these numbers and texts of all points; the status is empty where there is no answer yet."""
    points = dict(zip(task.names, task.values.T, strict=True))
    options = task.options
    name = given_among(points)
    asks = GIVEN.get(name) or ASKS[name]
    is_rod = asks.held is RATIO
    if is_rod:
        ratio, units = _rods(points, task)
        held, number = ratio, points[name] / units[name] if name == asks.given.name else points[name]
    else:
        held, number = np.cbrt(points["beta0"]), points[name] - PI4 if name == "beta1" else points[name]
    law = known_law(options.law or ("auto" if is_rod else "linear"))
    question = Many(asks, held, number, law, options.state)
    found = found_together(question, float(options.tol), {asks.given.attribute: question.number})
    columns = {own: found[theirs] for own in (*numbers, *texts) if (theirs := NAMES.get(own, own)) in found}
    columns["beta1"] = PI4 + found["lam"]
    if is_rod:
        for measure in asks:
            columns[measure.name] = units[measure.name] * columns[measure.attribute]
    else:  # without a rod p is measured in k/sbar^3, where it is alpha, and sbar is 1
        columns["pressure"], columns["length"] = found["beta0"] + found["alpha1"], np.ones(len(task.values))
    # What was given stays as it is: on the way through the groups it may lose its last digit.
    return columns | {own: column for own, column in points.items() if own in numbers and own != "ratio"}


def _rods(points: dict[str, np.ndarray], task: Task) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return eta/y0 of the rod of each point, and what its pressures and lengths are measured in."""
    count = len(task.values)
    if "ratio" in points:
        return points["ratio"], {"pressure": np.ones(count), "length": np.ones(count)}
    named = [points.get(name, np.full(count, getattr(task.subject, name, math.nan))) for name in MATERIAL]
    # A rod that is none is left to the single call, which says why.
    stiffness, strength, reach = np.where(np.all(np.array(named) > 0.0, axis=0), named, math.nan)
    eta = np.cbrt(stiffness / strength)
    return eta / reach, {"pressure": strength, "length": eta}
