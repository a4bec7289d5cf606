"""The discrete Euler top of Hirota and Kimura: an exact orbit, two integrals, and a function that is not an integral.

Every iterate is a triple of rational numbers, and both integrals keep their exact value. The map does not conserve the
integral of the differential equation, which differs from one of the map by a term in eps^2: a witness refutes it.
"""

import kahanmaps as km

top = km.load("euler_top", {"a1": 1, "a2": -2, "a3": 1})
print(top.system)

orbit = km.Orbit(km.KahanMap(top.system, "1/10"), ["1", "1/2", "1/3"], 4)
for point in orbit:
    values = [integral.value(km.QQ, (*point.x, km.QQ.convert("1/10"))) for integral in top.integrals.values()]
    print(point.step, "digits:", point.digits, "integrals:", ", ".join(map(str, values)))
print(orbit.end.status)

of_the_flow = km.parse_rational_function("2*x1^2 + x2^2", [*top.variables, "eps"])
for finding in km.check_integrals(top, extra={"of the flow": of_the_flow}, known=True).findings:
    print(f"{finding.verdict}: {finding.claim}")
    if finding.witness:
        print(f"  at x = {finding.witness.point}, eps = {finding.witness.eps}:", end=" ")
        print(f"I(x~) = {finding.witness.left[0]}, I(x) = {finding.witness.right[0]}")
