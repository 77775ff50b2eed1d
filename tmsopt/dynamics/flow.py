"""Solves x′ = A x by matrix exponentials, which need no eigenvectors and are smooth at exceptional points."""

import math
from itertools import accumulate

import numpy as np
from scipy.linalg import expm, solve_continuous_lyapunov

from tmsopt.records import Array


def sample_motion(A: Array, x: Array, step: float, count: int) -> Array:
    """e^(A k h) x for k = 0 … count − 1, shape (count, n), by one exponential and its squares."""
    states = np.asarray(x, dtype=float)[None]
    exponential = expm(A * step)
    while len(states) < count:
        states = np.concatenate([states, states @ exponential.T])
        exponential = exponential @ exponential
    return states[:count]


def evaluate_motion(A: Array, x: Array, times: Array) -> Array:
    """e^(A t) x at a few times of any spacing, shape (len(times), n)."""
    states: Array = expm(A * np.asarray(times)[:, None, None]) @ x
    return states


def simulate_noise(A: Array, x: Array, force: Array, step: float, count: int, seed: int) -> Array:
    """A random path of dx = A x dt + b dW at the times k h, with b = `force`; steps h of any length are exact.

    The covariance Q(h) = ∫ e^(As) b bᵀ e^(Aᵀs) ds from 0 to h is a block of one matrix exponential (Van Loan 1978). It
    is computed for a fraction of the step in which e^(−As) does not grow, and then doubled repeatedly by
    Q(2s) = Q(s) + e^(As) Q(s) e^(Aᵀs).
    """
    n = len(A)
    halvings = max(0, math.ceil(math.log2(np.linalg.norm(A, 2) * step + 1e-300)))
    matrix = np.block([[-A, np.outer(force, force)], [np.zeros((n, n)), A.T]])
    exponential = expm(matrix * (step / 2**halvings))
    propagator = exponential[n:, n:].T
    covariance = propagator @ exponential[:n, n:]
    for _ in range(halvings):
        covariance = covariance + propagator @ covariance @ propagator.T
        propagator = propagator @ propagator
    variances, axes = np.linalg.eigh((covariance + covariance.T) / 2)
    square_root = axes * np.sqrt(np.maximum(variances, 0.0))
    steps = np.random.default_rng(seed).standard_normal((count - 1, n)) @ square_root.T
    return np.array([*accumulate(steps, lambda state, jump: propagator @ state + jump, initial=x)])


def stationary_covariance(A: Array, force: Array) -> Array:
    """The stationary covariance Σ of dx = A x dt + b dW from A Σ + Σ Aᵀ + b bᵀ = 0; A must be stable."""
    return np.asarray(solve_continuous_lyapunov(A, -np.outer(force, force)), dtype=float)
