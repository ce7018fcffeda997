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

MINORITY, MAJORITY, LOWER, DIAGONAL, JUNCTION = range(5)  #: places in `POLICIES`
NOTHING, PAIR_AD, PAIR_BC = range(3)  #: what is joined
REACH = 3  # pixels each way from the corner in which the colours are counted


def policy_code(policy: str) -> int:
    """Return the place of `policy` in `POLICIES`, or raise `InputError`."""
    POLICY.check("policy", policy)
    return POLICIES.index(policy)


@verb
def joined_pair(colors: Labels, r: int, c: int, policy: int) -> int:
    """Return which pair is joined at the upper left corner of pixel (r, c), which is D: `PAIR_AD`, `PAIR_BC` or none.

    Parameters
    ----------
    colors : int32, shape (n_rows, n_cols)
        Labels; a border of another colour may lie around the picture.
    r, c : int
        1 or more.
    policy : int
        Place in `POLICIES`: joined is the colour with fewer pixels within `REACH` (MINORITY) or with more of them
        (MAJORITY), on a tie and with LOWER the lower one; always A and D (DIAGONAL); nothing, ever (JUNCTION).
    """
    a, b, x, d = colors[r - 1, c - 1], colors[r - 1, c], colors[r, c - 1], colors[r, c]
    if a == b or b == d or d == x or x == a or policy == JUNCTION:
        return NOTHING
    if a != d or b != x or policy == DIAGONAL:
        return PAIR_AD if a == d else (PAIR_BC if b == x else NOTHING)
    more = 0 if policy == LOWER else _surplus(colors, r, c, a, b)
    if more == 0:
        return PAIR_AD if a < b else PAIR_BC
    return PAIR_AD if (more < 0) == (policy == MINORITY) else PAIR_BC


@verb
def _surplus(colors: Labels, r: int, c: int, a: int, b: int) -> int:
    """Return by how many pixels `a` is commoner than `b` around a corner."""
    more = 0
    for i in range(max(r - REACH, 0), min(r + REACH, colors.shape[0])):
        for j in range(max(c - REACH, 0), min(c + REACH, colors.shape[1])):
            if colors[i, j] == a:
                more += 1
            elif colors[i, j] == b:
                more -= 1
    return more
