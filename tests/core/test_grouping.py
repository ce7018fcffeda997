"""Groups of what is linked, beside SciPy's connected components."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from imgquad_core.grouping import linked


@pytest.mark.parametrize("seed", range(20))
def test_what_is_linked_is_one_group_numbered_by_its_first_member(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 60))
    pairs = rng.integers(0, n, (int(rng.integers(0, n)), 2))
    group, count = linked(pairs[:, 0], pairs[:, 1], n)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    n_parts, part = connected_components(links, directed=False)
    assert count == n_parts
    assert np.array_equal(group, part)


def test_nothing_has_no_group() -> None:
    group, count = linked(np.empty(0, np.int64), np.empty(0, np.int64), 0)
    assert (len(group), count) == (0, 0)
