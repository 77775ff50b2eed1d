"""x′ = A x by matrix exponentials, which are smooth where eigenvectors merge: nothing here needs an eigenvector."""

import numpy as np
from scipy.linalg import expm, solve_continuous_lyapunov

from tmsopt.records import Array


def sampled(A: Array, x: Array, step: float, count: int) -> Array:
    """e^(A k h) x for k = 0 … count − 1, shape (count, n), by one exponential and its squares."""
    found = np.asarray(x, dtype=float)[None]
    power = expm(A * step)
    while len(found) < count:
        found = np.concatenate([found, found @ power.T])
        power = power @ power
    return found[:count]


def at_times(A: Array, x: Array, times: Array) -> Array:
    """e^(A t) x at any few times, shape (len(times), n)."""
    found: Array = expm(A * np.asarray(times)[:, None, None]) @ x
    return found


def shaken(A: Array, x: Array, force: Array, step: float, count: int, seed: int) -> Array:
    """A path of dx = A x dt + b dW at the times k h, b the `force`: no step is too long, for each is exact.

    The covariance of a step, ∫ e^(As) b bᵀ e^(Aᵀs) ds from 0 to h, is a block of one exponential (Van Loan 1978).
    """
    n = len(A)
    whole = np.block([[-A, np.outer(force, force)], [np.zeros((n, n)), A.T]])
    power = expm(whole * step)
    forward = power[n:, n:].T
    covariance = forward @ power[:n, n:]
    sizes, axes = np.linalg.eigh((covariance + covariance.T) / 2)
    root = axes * np.sqrt(np.maximum(sizes, 0.0))
    steps = np.random.default_rng(seed).standard_normal((count - 1, n)) @ root.T
    found = np.empty((count, n))
    found[0] = x
    for k, jump in enumerate(steps):
        found[k + 1] = forward @ found[k] + jump
    return found


def stationary(A: Array, force: Array) -> Array:
    """The covariance Σ of x in the long run of dx = A x dt + b dW: A Σ + Σ Aᵀ + b bᵀ = 0; A must be stable."""
    found: Array = solve_continuous_lyapunov(A, -np.outer(force, force))
    return found
