"""How the numbers of exact orbits grow: an integrable map compared with one that is not integrable.

The digits of an orbit of an integrable map grow like the square of the step; those of the Lotka-Volterra map double
with every step, until the limit on digits ends the orbit with a status instead of an exception.
"""

import kahanmaps as km

for name, start, budget in (("weierstrass", ["1", "1/2"], 20000), ("lotka_volterra", ["1/2", "2/3"], 20000)):
    orbit = km.Orbit(km.KahanMap(km.load(name).system, "1/10"), start, 24, max_digits=budget)
    digits = [point.digits for point in orbit]
    print(f"{name}: digits at every fourth step: {digits[::4]}")
    print(f"  {orbit.end.status}: {orbit.end.message}")
