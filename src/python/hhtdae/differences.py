"""Derivatives of users' functions by central differences, and the scales of their arguments, which determine the steps of the differences."""

import numpy as np


def differences(f, x, rows, scale):
    """Central differences with steps of 6e-6 times the scale of each argument: truncation and rounding errors are then about equal, 1e-10"""
    return _over(f, x, rows, 6e-6 * scale)


def slopes(f, x, rows):
    """Central differences of a linear function. The step is 1 or the magnitude of the argument; if the differences are then lost in the rounding
    of large values of f, the step is the magnitude of these values"""
    increments = np.maximum(1., np.abs(x))
    J, size = _over(f, x, rows, increments), np.max(np.abs(f(x)), initial=0.)
    drowned = np.max(np.abs(J), axis=0, initial=0.) * increments < 1e-6 * size
    if not np.any(drowned) or not np.isfinite(size):
        return J
    return np.where(drowned, _over(f, x, rows, np.where(drowned, np.maximum(increments, size), increments)), J)


def _over(f, x, rows, increments):
    J, x = np.empty((rows, len(x))), np.array(x, dtype=float)
    for k, (at, h) in enumerate(zip(x.copy(), increments)):
        up, down = at + h, at - h  # up - down is the exact step after rounding
        x[k] = up
        above = f(x)
        x[k] = down
        J[:, k] = (above - f(x)) / (up - down)
        x[k] = at
    return J


def scales(f, x):
    """The scale of each argument of f: its magnitude or 1, or a smaller one by powers of ten, so that f is nearly a parabola over the
    neighbourhood that `_scale` tests. Rows of f that are a parabola at no scale, for example at a kink, are ignored. Test: Scales of
    tests/python/test_mistakes.py."""
    return np.array([_scale(f, np.array(x, dtype=float), k) for k in range(len(x))])


def _scale(f, x, k):
    begin = max(1., abs(x[k]))
    judged = []
    for decade in range(11):
        s = begin * 10.**-decade
        if s < 1e-9 * abs(x[k]):  # differences would be rounding of the argument
            break
        good, small = _parabola(f, x, k, 1e-3 * s)
        judged.append((s, good, small))
        if decade == 0 and np.all(good | small):
            return begin
    ever = np.any([good for _, good, _ in judged], axis=0)
    return next((s for s, good, small in judged if np.all(good | small | ~ever)), begin)


def smooth(f, x, distances):
    """(rows, arguments): whether a row of f, as a function of one argument, is nearly a parabola over the given distance on both sides, or does
    not depend on it. This is false for rows with a kink or a jump there."""
    x = np.array(x, dtype=float)
    return np.array([np.logical_or(*_parabola(f, x, k, d)) for k, d in enumerate(distances)]).T


def _parabola(f, x, k, d):
    """Which rows of f are nearly parabolas from x_k - 2 d to x_k + 2 d, and which do not depend on x_k up to rounding. If f raises an exception,
    d is too large."""
    y = []
    with np.errstate(all="ignore"):
        for step in (0, d, -d, 2 * d, -2 * d):
            at = x.copy()
            at[k] += step
            try:
                y.append(f(at))
            except Exception:
                y.append(np.full(len(f(x)), np.nan))
        y0, a, b, c, e = y
        change = np.max(np.abs(np.array(y) - y0), axis=0)
        cubic = np.abs((c - e) / 4 - (a - b) / 2) + np.abs((c - 2 * y0 + e) / 4 - (a - 2 * y0 + b))
        small = change <= 1e-14 * np.max(np.abs(np.array(y)), axis=0)
        return ~small & (cubic <= 1e-4 * change), small
