"""The one rule of the ambiguous corner: which of four pixels are connected over a corner that no side connects.

Regions, the clusters of noise removal and the boundary between them all ask here, so that they agree by construction::

      A | B
     ---+---      no two of them that share a side are alike: A is not B, B is not D, D is not C, C is not A
      C | D

    neither A = D nor B = C    nothing is joined
    one of the two             that pair is joined (the boundary passes it on both sides)
    both                       the policy says which pair is joined
"""

from __future__ import annotations

from imgquad_core.arrays import Labels
from imgquad_core.declared import POLICIES, POLICY
from imgquad_core.jit import verb

N_POLICIES = len(POLICIES)
MINORITY, MAJORITY, LOWER, DIAGONAL, JUNCTION = range(5)  #: places in `POLICIES`
NOTHING, PAIR_AD, PAIR_BC = range(3)  #: what is joined
REACH = 3  #: data points each way from the corner in which the colours are counted


def corner_rule(policy: str, step: float = 1.0) -> int:
    """Return the rule of a policy as one number, or raise `InputError`.

    Parameters
    ----------
    policy : str
        One of `POLICIES`.
    step : float
        Width of the picture's data points in pixels.

    Returns
    -------
    int
        The policy's place in `POLICIES`, and that many times the pixels each way in which colours are counted.
    """
    POLICY.check("policy", policy)
    return POLICIES.index(policy) + N_POLICIES * round(REACH * step)


@verb
def joined_pair(colors: Labels, r: int, c: int, rule: int) -> int:
    """Return which pair is joined at the upper left corner of pixel (r, c), which is D: `PAIR_AD`, `PAIR_BC` or none.

    Parameters
    ----------
    colors : int32, shape (n_rows, n_cols)
        Labels; a border of another colour may lie around the picture.
    r, c : int
        1 or more.
    rule : int
        See `corner_rule`: joined is the colour with fewer pixels within reach (MINORITY) or with more of them
        (MAJORITY), on a tie and with LOWER the lower one; always A and D (DIAGONAL); nothing, ever (JUNCTION).
    """
    policy, reach = rule % N_POLICIES, rule // N_POLICIES
    a, b, x, d = colors[r - 1, c - 1], colors[r - 1, c], colors[r, c - 1], colors[r, c]
    if a == b or b == d or d == x or x == a or policy == JUNCTION:
        return NOTHING
    if a != d or b != x or policy == DIAGONAL:
        return PAIR_AD if a == d else (PAIR_BC if b == x else NOTHING)
    more = 0 if policy == LOWER else _surplus(colors, r, c, a, b, reach)
    if more == 0:
        return PAIR_AD if a < b else PAIR_BC
    return PAIR_AD if (more < 0) == (policy == MINORITY) else PAIR_BC


@verb
def _surplus(colors: Labels, r: int, c: int, a: int, b: int, reach: int) -> int:
    """Return by how many pixels `a` is commoner than `b` around a corner."""
    more = 0
    for i in range(max(r - reach, 0), min(r + reach, colors.shape[0])):
        for j in range(max(c - reach, 0), min(c + reach, colors.shape[1])):
            if colors[i, j] == a:
                more += 1
            elif colors[i, j] == b:
                more -= 1
    return more
