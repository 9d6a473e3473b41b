"""What a state of a scene must satisfy beside the equations it was solved with."""

from __future__ import annotations

import numpy as np

from .defect import Tip, march
from .scene_spectral import SceneDiscretisation


def certificate_of(problem: SceneDiscretisation, x: np.ndarray) -> float:
    """How far a solution misses what it was not solved with.

    The identity of the scene over T0 eta, assembled from its parts, where it has one; where it has
    none, by how much the edge is missed by an independent integration from the tip.  On an elastic layer
    it is no less than the curvature that is left where all should have decayed.
    """
    scene, q = problem.settings.scene, problem.found(x)
    tip, first, work = problem.ends(x)
    curvature = problem.tip_curvature(x)
    if scene.has_identity:
        missed = abs(scene.identity(tip, first, work, curvature, q))
        return max(missed, problem.left_over(x)) if scene.layer is not None else missed
    Nx, Ny = (float(force) for force in scene.tip_force(tip, q))
    return march(scene, q, tip.sbar, Tip(tip.theta, tip.x, tip.y, Nx, Ny, curvature)).missed
