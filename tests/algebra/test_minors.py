"""Kernel vectors by minors: the matrix sends them to zero, and they are FLINT's minors."""

from __future__ import annotations

import pytest
from flint import fmpz_mat, fmpz_poly
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.minors import kernel_minors


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
@given(data=st.data())
def test_the_minors_are_those_of_flint(n, data):
    entry = st.integers(-20, 20)
    rows = data.draw(st.lists(st.lists(entry, min_size=n + 1, max_size=n + 1), min_size=n, max_size=n))
    found = kernel_minors(rows)
    for k in range(n + 1):
        rest = fmpz_mat([[row[j] for j in range(n + 1) if j != k] for row in rows])
        assert found[k] == (-1) ** k * rest.det()
    assert all(sum(a * b for a, b in zip(row, found, strict=True)) == 0 for row in rows)


def test_entries_may_be_of_any_ring():
    t = fmpz_poly([0, 1])
    assert kernel_minors([[t, t + 1]]) == [t + 1, -t]


def test_a_product_of_ones_own():
    """Modulo 7 by hand: 4*6 - 5*2, 5*1 - 3*6, 3*2 - 4*1."""
    found = kernel_minors([[3, 4, 5], [1, 2, 6]], times=lambda a, b: a * b % 7)
    assert [entry % 7 for entry in found] == [14 % 7, -13 % 7, 2]
