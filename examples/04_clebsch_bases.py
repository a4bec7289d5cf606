"""The discrete Clebsch system: the Hirota-Kimura bases that Petrera, Pfadler and Suris found by experiment.

Which linear combinations of p_i^2, m_i^2, m_i p_i and 1 vanish along an orbit of the map? Coefficients that differ
between orbits are integrals. The dimensions are measured modulo primes. By the smallest basis,
c_1 p_1^2 + c_2 p_2^2 + c_3 p_3^2 = 1 on each orbit, so the c_i are integrals. They are functions of a single integral,
which is proved in the form of two claims.
"""

from flint import fmpq_mat

import kahanmaps as km

clebsch = km.load("clebsch_first_flow")
print(clebsch.system)

maps = km.Laboratory(clebsch).maps
squares, products = ["p1^2", "p2^2", "p3^2"], ["m1*p1", "m2*p2", "m3*p3"]
for functions in (
    [*squares, "1"],
    [*squares, products[0]],
    [*squares, *products],
    ["m1^2", "m2^2", "m3^2", *squares, *products, "1"],
):
    polynomials = [km.parse_polynomial(text, clebsch.variables) for text in functions]
    basis = km.hirota_kimura_basis(maps, polynomials, functions)
    print(f"null space of ({', '.join(functions)}): dimension {basis.dimension}")

eps = km.QQ.convert("1/10")
print("c_i along an orbit, from three points at a time:")
orbit = [point.x for point in km.Orbit(km.KahanMap(clebsch.system, eps), ["1/2", 1, "-1/3", 1, "1/2", "1/4"], 6)]
for k in range(3):
    rows = [[x[clebsch.variables.index(p)] ** 2 for p in ("p1", "p2", "p3")] for x in orbit[k : k + 3]]
    c = fmpq_mat(rows).solve(fmpq_mat(3, 1, [1, 1, 1]))
    print("  ", ", ".join(str(c[i, 0]) for i in range(3)))

names = [*clebsch.variables, "eps"]
for text in (
    "(1 + eps^2*(p1^2 - 2*p3^2)) / (1 + eps^2*(3*p1^2 + 2*p2^2))",
    "(1 + eps^2*(p1^2 - 3*p3^2)) / (1 + eps^2*(3*p1^2 + 2*p2^2))",
):
    for finding in km.check_integrals(clebsch, extra={"I": km.parse_rational_function(text, names)}).findings:
        if finding.claim.startswith("I "):
            print(f"{finding.verdict}: {text} is conserved")
