"""Table look-ups of the right-hand side: features to loads. Compiled."""

from __future__ import annotations

import numpy as np

from sim.compiled import inlined, inner, merged
from sim.kernel.layout import (
    AT_AXES,
    AT_FRACTIONS,
    AT_GROUPS,
    AT_MULTIPLIERS,
    AT_PRODUCTS,
    AXIS,
    CELL,
    LOADS,
    N_AXES,
    N_GROUPS,
    N_MULTIPLIERS,
    N_OUT,
    N_PAIRS,
    OUT_DEDUCTION,
    OUT_THRUST,
    WIDTH,
)
from sim.kernel.rows import add_rows


@inner
def _search(m: np.ndarray, w: np.ndarray, axis: int, x: float, k: np.ndarray, place: int) -> float:
    """Find the cell of ``x`` along an axis; its fraction, by the rule beyond the nodes."""
    start, count, cells = w[axis + 2], w[axis + 3], w[axis + 4]
    if x != x:
        # Not a number must not look like a held value.
        return x
    i = 0
    while i < count and x >= m[start + i]:
        i += 1
    at = cells + CELL * i
    k[place], k[place + 1] = at, min(max(i - 1, 0), count - 2)
    if m[at] > m[at + 1]:
        # Goes on as a load does: straight in 1/x.
        a, b = m[start + k[place + 1]], m[start + k[place + 1] + 1]
        return (1.0 / x - 1.0 / a) / (1.0 / b - 1.0 / a)
    return m[at + 4] + (x - m[at + 2]) * m[at + 3]


@merged
def _locate(m: np.ndarray, w: np.ndarray, s: np.ndarray, k: np.ndarray) -> None:
    """Fraction along every axis, into the scratch: quickly in the cell of the last call."""
    axis, fraction = w[AT_AXES], w[AT_FRACTIONS]
    for a in range(w[N_AXES]):
        x, at = s[w[axis]], k[2 * a]
        if m[at] <= x < m[at + 1]:
            s[fraction + a] = m[at + 4] + (x - m[at + 2]) * m[at + 3]
        else:
            s[fraction + a] = _search(m, w, axis, x, k, 2 * a)
        axis += AXIS


@merged
def _multiply(w: np.ndarray, s: np.ndarray) -> None:
    """Products of the features that stand beside the coefficients, into the scratch."""
    at, product = w[AT_MULTIPLIERS], w[AT_PRODUCTS]
    for i in range(w[N_PAIRS]):
        s[product + i] = s[w[at]] * s[w[at + 1]]
        at += 4
    for i in range(w[N_PAIRS], w[N_MULTIPLIERS]):
        s[product + i] = s[w[at]] * s[w[at + 1]] * s[w[at + 2]] * s[w[at + 3]]
        at += 4


@merged
def add_up_loads(m: np.ndarray, w: np.ndarray, s: np.ndarray, k: np.ndarray) -> None:
    """Hydrodynamic loads X Y Z K M N of the features in the scratch, into the scratch.

    One loop for each number of axes up to three: the corners are a tuple of known length, for which ``add_rows`` is
    one straight piece of vector code. The loop over corners, which would do for all, decides at every corner.

    Parameters
    ----------
    m, w : Model, floats and whole numbers. s, k : Scratch, likewise.
    """
    _locate(m, w, s, k)
    _multiply(w, s)
    for j in range(N_OUT):
        s[LOADS + j] = 0.0
    f, p, at = w[AT_FRACTIONS], w[AT_PRODUCTS], w[AT_GROUPS]
    for _ in range(w[N_GROUPS]):
        add_rows(s, LOADS, m, (w[at],), (1.0,), s, p, w, at + 1)
        at += 1 + WIDTH
    for _ in range(w[N_GROUPS + 1]):
        a = w[at + 1]
        row, t = w[at] + k[2 * a + 1] * w[at + 2], s[f + a]
        add_rows(s, LOADS, m, (row, row + w[at + 2]), (1.0 - t, t), s, p, w, at + 3)
        at += 3 + WIDTH
    for _ in range(w[N_GROUPS + 2]):
        a, b, da, db = w[at + 1], w[at + 3], w[at + 2], w[at + 4]
        row = w[at] + k[2 * a + 1] * da + k[2 * b + 1] * db
        t, u = s[f + a], s[f + b]
        weights = ((1.0 - t) * (1.0 - u), t * (1.0 - u), (1.0 - t) * u, t * u)
        add_rows(s, LOADS, m, (row, row + da, row + db, row + da + db), weights, s, p, w, at + 5)
        at += 5 + WIDTH
    for _ in range(w[N_GROUPS + 3]):
        _add_cube(m, w, s, k, w[at], 1.0, at + 1, at + 7)
        at += 7 + WIDTH
    for _ in range(w[N_GROUPS + 4]):
        at = _add_corners(m, w, s, k, at)
    s[LOADS] += (1.0 - s[LOADS + OUT_DEDUCTION]) * s[LOADS + OUT_THRUST]


@inlined
def _add_cube(
    m: np.ndarray, w: np.ndarray, s: np.ndarray, k: np.ndarray, row: int, share: float, links: int, places: int
) -> None:
    """Add a share of a table along the three axes that ``links`` names."""
    f = w[AT_FRACTIONS]
    a, b, c = w[links], w[links + 2], w[links + 4]
    da, db, dc = w[links + 1], w[links + 3], w[links + 5]
    r = row + k[2 * a + 1] * da + k[2 * b + 1] * db + k[2 * c + 1] * dc
    t, u, v = s[f + a], s[f + b], s[f + c]
    w0, w1, w2, w3 = (1.0 - t) * (1.0 - u), t * (1.0 - u), (1.0 - t) * u, t * u
    x, y = share * (1.0 - v), share * v
    q = r + dc
    rows = (r, r + da, r + db, r + da + db, q, q + da, q + db, q + da + db)
    weights = (x * w0, x * w1, x * w2, x * w3, y * w0, y * w1, y * w2, y * w3)
    add_rows(s, LOADS, m, rows, weights, s, w[AT_PRODUCTS], w, places)


@inner
def _add_corners(m: np.ndarray, w: np.ndarray, s: np.ndarray, k: np.ndarray, at: int) -> int:
    """Add a table of four axes or more, corner by corner of those beyond the third; where the next starts."""
    count, f = w[at], w[AT_FRACTIONS]
    places = at + 2 + 2 * count
    for corner in range(1 << (count - 3)):
        row, share = w[at + 1], 1.0
        for i in range(3, count):
            a, step = w[at + 2 + 2 * i], w[at + 3 + 2 * i]
            t = s[f + a]
            upper = (corner >> (i - 3)) & 1
            row += (k[2 * a + 1] + upper) * step
            share *= t if upper else 1.0 - t
        if share != 0.0:
            _add_cube(m, w, s, k, row, share, at + 2, places)
    return places + WIDTH
