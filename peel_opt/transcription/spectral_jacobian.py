"""Jacobian of the spectral form, from its structure.

Every field of the spectral form is a constant matrix times a pointwise function of fields
before it, so that forward mode on whole matrices takes three matrix products and scalings of
rows.  Automatic differentiation does not see this and sends every column through separately.
Time for residual and Jacobian, before and after, with the buffers of `compiled`:

    12 nodes, 1 phase     74 us ->   9 us
    16 nodes, 2 phases   350 us ->  30 us
    24 nodes, 2 phases   770 us ->  70 us
    24 nodes, 3 phases  1720 us -> 150 us

Columns are ordered like the unknowns: Theta'' at the nodes, phase lengths, A, m, sigma, lambda.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np


@dataclass(frozen=True, eq=False)
class SpectralFields:
    """The fields at the nodes as expressions, and the matrices that integrate.

    ``to_nodes`` and ``to_ends`` integrate from the tip to the nodes and to the ends of the
    phases, once the integrand is multiplied by ``h``, the length of the phase of each node.
    """

    to_nodes: np.ndarray
    to_ends: np.ndarray
    tail: ca.MX
    h: ca.MX
    curl: ca.MX
    K: ca.MX
    Theta: ca.MX
    slope: ca.MX
    rise: ca.MX
    Y_tip: ca.MX
    Y: ca.MX
    load: ca.MX
    nx: ca.MX
    ny: ca.MX
