"""What does this Kahan map preserve, and is it integrable? The input is only the right-hand sides.

Formulas of integrals are found, with symbolic parameters, and proved. The degrees of the iterates distinguish
integrable maps from other maps, independently of integrals: zhukovski_volterra_2 has an integral and is not
integrable. At a single eps a map may look integrable by accident.
"""

import kahanmaps as km

top = km.find_integrals(km.load("euler_top"), symbols=["a1", "a2", "a3"])
print(f"euler_top: {len(top.integrals)} integrals found, {top.codimension} shown by orbits")
for integral in top.integrals:
    print(f"  {integral.verdict} for every eps, a1, a2, a3: {integral.text}")

(density,) = km.find_densities(km.load("lotka_volterra")).densities
print(f"lotka_volterra: {density.verdict}: dx/phi is invariant, phi = {density.text}")

for name in ("euler_top", "lotka_volterra", "zhukovski_volterra_2"):
    growth = km.degree_growth(km.load(name).system, max_degree=2000)
    print(f"{name}: degrees {', '.join(map(str, growth.degrees[1:6]))}, ...: {growth.growth_text}")

gyrostat = km.find_integrals(km.load("zhukovski_volterra_2"), max_degree=3)
print(f"  and yet {gyrostat.integrals[0].verdict}: {gyrostat.integrals[0].text} is an integral")

spring = km.parse_system('variables = ["q", "p"]\n[system]\nrhs = ["p", "-q + q^2"]')
for eps in ("1", "1/2"):
    search = km.find_integrals(spring, eps=eps)
    print(f"q'' = -q + q^2 at eps = {eps}: independent integrals: {search.codimension}. {search.note}".rstrip())

report = km.analyze(km.load("nahm_tetrahedral"))
print(f"nahm_tetrahedral: {report.conclusion.kind}")
for title, lines in report.sections:
    print(f"  {title}:", ", ".join(sorted({line.status for line in lines})))
