"""Two systems whose flows commute, but whose Kahan maps do not: commuting Kahan maps are special to associated systems.

H_0 and H_1 with grad H_1 = A grad H_0 are in involution, so the flows of J grad H_0 and J grad H_1 commute. Their Kahan
maps do not: Phi_0(Phi_1(x)) and Phi_1(Phi_0(x)) differ by a gap that shrinks like a power of eps. For two associated
systems both points are equal, at every eps.
"""

from itertools import pairwise
from math import log2

import kahanmaps as km

member = km.random_member_with_eigenvalues([1, -2], seed=7)
h_0, h_1 = member.hamiltonians
f_0, f_1 = h_0.system, h_1.system
f_s = member.associate([1, -1]).system

d = [[h.H.derivative(i) for i in range(4)] for h in (h_0, h_1)]
bracket = sum(d[0][i] * d[1][i + 2] - d[0][i + 2] * d[1][i] for i in range(2))
print("{H_0, H_1} =", bracket)


def gap(f, g, eps):
    """The largest difference between a coordinate of the two points, an exact number."""
    phi_f, phi_g = km.KahanMap(f, eps), km.KahanMap(g, eps)
    x = phi_f.point(["1/20", "-1/30", 0, "1/10"])
    one, other = phi_f.step(phi_g.step(x)), phi_g.step(phi_f.step(x))
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


for eps in ("1/10", "1/1000"):
    print(f"associated systems, eps = {eps}: gap {gap(f_0, f_s, eps)}")

steps = ["1/1000", "1/2000", "1/4000", "1/8000"]
gaps = [float(gap(f_0, f_1, eps)) for eps in steps]
for eps, size in zip(steps, gaps, strict=True):
    print(f"H_0 and H_1, eps = {eps}: gap {size:.3g}")
orders = [log2(a / b) for a, b in pairwise(gaps)]
print("halving eps divides the gap by 2 to the power", ", ".join(f"{order:.2f}" for order in orders))
