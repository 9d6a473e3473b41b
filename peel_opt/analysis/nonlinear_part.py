"""The nonlinear remainder B of (29) with the amplitude divided out, and its derivative."""

from __future__ import annotations

import numpy as np

from ..model.equations import sin_over, versine_over
from .linear_operator import FIELDS


def remainder(beta0: float, V: np.ndarray, A: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """Nonlinear part B(A V)/A of (29), at A = 0 too."""
    A, lam = A[..., None], lam[..., None]
    theta, nx, ny, y, alpha1 = (V[..., i, :] for i in range(FIELDS))
    slope, versine = sin_over(A, theta), versine_over(A, theta)
    b = np.zeros_like(V)
    b[..., 0, :] = A * (nx * slope + ny * versine)
    b[..., 1, :] = beta0 * (slope - theta) + A * alpha1 * slope
    b[..., 2, :] = (beta0 + A * alpha1) * versine - lam * y
    b[..., 3, :] = theta - slope
    return b


def remainder_derivative(beta0: float, V: np.ndarray, A: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """Derivative of b with respect to V: equation by field by node."""
    A, lam = A[..., None], lam[..., None]
    theta, nx, ny, _, alpha1 = (V[..., i, :] for i in range(FIELDS))
    sine, cosine = A * sin_over(A, theta), np.cos(A * theta)
    versine = versine_over(A, theta)
    load = beta0 + A * alpha1
    D = np.zeros((*V.shape[:-2], FIELDS, FIELDS, V.shape[-1]))
    D[..., 0, 0, :] = A * (nx * cosine + ny * sine)
    D[..., 0, 1, :] = sine
    D[..., 0, 2, :] = A * versine
    D[..., 1, 0, :] = load * cosine - beta0
    D[..., 1, 4, :] = sine
    D[..., 2, 0, :] = load * sine
    D[..., 2, 3, :] = -lam
    D[..., 2, 4, :] = A * versine
    D[..., 3, 0, :] = A * versine
    return D
