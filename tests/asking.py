"""Put a reference problem to the library."""

from __future__ import annotations

from typing import Any

import peel_opt as po

from .registry import Reference

LAWS: dict[str, Any] = {"exponential": po.exponential()}


def ask(reference: Reference, **options: Any) -> po.Equilibrium:
    """Ask the question of a reference that is not a fold."""
    question = dict(reference.question)
    law = LAWS.get(str(question["law"]), question["law"])
    if "beta0" in question:
        groups = {key: question[key] for key in ("beta0", "beta1", "lam") if key in question}
        if "spurious" in reference.tags:
            options["state"] = "spurious"
        return po.equilibrium(law=law, **groups, **options)
    rod = po.Rod.from_ratio(question["ratio"])
    state = question.get("state")
    if "pressure_ratio" in question:
        return po.length_given_pressure(rod, question["pressure_ratio"], law=law, state=state, **options)
    return po.pressure_given_length(rod, question["length_ratio"], law=law, state=state, **options)
