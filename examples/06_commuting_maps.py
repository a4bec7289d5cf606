"""The theorem of Petrera and Suris for m = 3, with a control.

The script constructs a random member of the family, lists its four associated systems, composes two of their Kahan
maps in both orders at a rational point, and proves that they commute pairwise. The maps of H_0 and H_1 do not commute.
"""

import kahanmaps as km

member = km.random_member_with_eigenvalues([1, -2, 3], seed=7)
print("A has eigenvalues", ", ".join(str(factor.root) for factor in member.factors), "each twice")

associated = list(member.associated())
for g in associated:
    powers = ", ".join(str(c) for c in g.coefficients)
    print(f"signs {g.label}: B = [{powers}] in 1, A, A^2")

f, g = associated[0], associated[1]
phi_f, phi_g = km.KahanMap(f.system, "1/10"), km.KahanMap(g.system, "1/10")
x = phi_f.point(["1/2", "-1/3", 0, 1, "2/5", -1])
print("x =", ", ".join(map(str, x)))
print("first coordinate of Phi_g(Phi_f(x)) =", phi_g.step(phi_f.step(x))[0])
print("first coordinate of Phi_f(Phi_g(x)) =", phi_f.step(phi_g.step(x))[0])

report = km.check_commute(km.SystemFile.from_member(member))
for finding in report.findings:
    print(f"{finding.verdict}: {finding.claim}")
print("together:", report.verdict)
