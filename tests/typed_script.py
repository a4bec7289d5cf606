"""A script as users write them: `make types` checks it as strictly as the library, nobody calls it.

Each line at the end is wrong; the checker objects to a comment that ignores an error where there is none.
"""

from fractions import Fraction
from pathlib import Path

import numpy as np

import kahanmaps as km


def script() -> None:
    top = km.load("euler_top", a1=2)
    fish = km.System({"q": "p", "p": "a*q^2 - q"}, a=Fraction(1, 2))
    growth: km.DegreeGrowth = km.degrees("euler_top", max_terms=4)
    print(growth.growth_text, km.degrees(top, eps="1/10").rows(), km.degrees(Path("mine.toml"), time_step="1/5"))
    search: km.IntegralSearch = km.find_integrals("x' = y; y' = 6*x^2 - 2", effort=1)
    print([integral.text for integral in search.integrals], km.find_density(fish).densities[0].text)
    report: km.Report = km.check_commute("euler_top", top, eps="1/10")
    print(report.verdict is km.Certainty.PROVED, km.check_measure("euler_top", eps="1/10").holds)
    walk = km.orbit("euler_top", [1, 2, 3], "1/10", 5)
    print(len(walk), walk[-1].text, [point.step for point in walk[1:3]], [point.x for point in walk])
    phi = km.map("euler_top", "1/10")
    print(phi([1, 2, 3]), (phi**-2 @ phi)([1, 2, 3]), top.at("1/10").inverse, top("1/10"))
    print(km.cycles("weierstrass", eps="1/10", prime=101).lengths, km.lyapunov("lorenz", [1, 2, 3], "1/100", 100).mean)
    print(km.orbit(phi @ phi, np.array([1, 2, 3]), steps=2), km.orbit(fish, [1, 0], "1/10", 5, arithmetic=km.GF(7)))
    print(km.check_integrals(fish, "p^2", eps="1/10").holds, km.check_measure(fish, "p").rows())
    print(km.check_poisson(fish, [["0", "1"], ["-1", "0"]]).to_json(), km.heights(fish, "1/5", starts=[1, 2]).to_json())
    member = km.random_member_with_eigenvalues([2, -3], seed=1)
    print(km.check_commute(member.associate([1, 1]), member.associate([1, -1])).verdict, km.degrees(member).degrees)
    print(
        km.heights(top.map, "1/10", effort=0).kind, km.verify(m=1).verdict, km.analyze(top.system).conclusion.sentence
    )

    for integral in km.find_integrals({"x": "y", "y": "6*x^2 - 2"}):
        print(integral.latex(), integral.to_sympy(), integral([1, 2], "1/10"))
    floats = km.orbit(top, x0=[1.0, 0.5, 0.25], h=0.1, n=5, exact=False)
    print(floats.x.mean(), floats.t, floats["x1"], floats.write(Path("o.parquet")).status, top.f([1, 2, 3]), hash(top))
    print(km.analyze(fish).integrable is True, km.dynamical_degree(fish), fish.kahan(h="1/5").h, len(km.catalogue()))
    print(km.ensemble(fish, x0=np.zeros((5, 2)), h=0.1, n=5).x, km.singularities(fish).to_dict(), top.subs(a1=3).dim)

    km.degrees(3)  # type: ignore[arg-type]
    km.degrees("euler_top", max_tems=4)  # type: ignore[call-arg]
    print(km.degrees("euler_top").growth_txt)  # type: ignore[attr-defined]
    km.check_commute("euler_top", 3)  # type: ignore[arg-type]
