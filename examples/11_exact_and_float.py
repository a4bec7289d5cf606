"""A script to start from: one quadratic system, in exact and in floating-point arithmetic."""

import numpy as np

import kahanmaps as km

# The system x' = x (1 - y), y' = y (x - 1), given by its right-hand sides; eps is half the time step, h = 2 eps.
system = km.System({"x": "x*(1 - y)", "y": "y*(x - a)"}, a=1)
phi = system.kahan(h="1/10")
print(system)
print("f(1, 2) =", system.f([1, 2]), " phi(1, 2) =", phi([1, 2]))

# Exact orbits: the numbers get longer with every step. A point knows its step, its coordinates and their text.
orbit = km.orbit(phi, x0=[1, 2], n=6)
for point in orbit[:3]:
    print(point.step, ", ".join(point.text))
print("digits:", [point.digits for point in orbit])
assert phi.inverse(orbit[1].x) == orbit[0].x

# Floating point: an array of shape (points, dimension), and the times.
floats = km.orbit(system, x0=[1.0, 2.0], h=0.1, n=2000, exact=False)
x, y = floats.x.T
print("after t =", float(floats.t[-1]), "the orbit is", floats.end.status)

# The integral of the differential equation is not conserved, but its error stays bounded.
H = x - np.log(x) + y - np.log(y)
print("error of H below 0.01:", bool(np.abs(H - H[0]).max() < 0.01))

# The map takes arrays of points as well, and its order is 2: halving h divides the error by 4.
points = np.array([[1.0, 2.0], [0.5, 0.5]])
one = system.kahan(h="1/10")(points)
two = (system.kahan(h="1/20") ** 2)(points)
four = (system.kahan(h="1/40") ** 4)(points)
print("quotient of the errors:", np.round(np.abs(one - two).max() / np.abs(two - four).max(), 1))

# What is preserved, exactly: an invariant measure dx/phi, for every eps; no integral is found, and the degrees grow.
densities = km.invariant_measure(system)
print(densities[0].text, densities[0].verdict)
integrals = km.find_integrals(system)
print("integrals:", len(integrals))
print("dynamical degree:", km.dynamical_degree(system))

# The Euler top has two integrals; a formula can be called, with exact numbers or with arrays.
top = km.load("euler_top")
for integral in km.find_integrals(top):
    values = integral(km.orbit(top, x0=[1, 0.5, 0.25], h=0.1, n=1000, exact=False).x, 0.05)
    print(integral.text, "drifts by less than 1e-12:", bool(np.ptp(values) < 1e-12))

# A thousand orbits, computed together.
x0 = np.random.default_rng(seed=1).uniform(0.5, 1.5, (1000, 2))
many = km.ensemble(system, x0=x0, h=0.1, n=500, kernel="numpy")
print(many, many.x.shape)

# Orbits from a grid of points: which leave a ball, and how is the drift of the integrals distributed?
grid = km.ensemble(top, "x1=0:1:10, x2=0:1:10, x3=1/2", 0.05, 500, integrals=top.integrals, radius=1)
print((grid.escaped_at >= 0).sum(), "of", grid.n, "leave the ball")
print("95 % drift by less than 1e-14:", grid.statistics()["F1"]["95%"] < 1e-14)

# The verdict, with the kind of evidence.
analysis = km.analyze(system)
print("integrable:", analysis.integrable, f"({analysis.conclusion.ground})")
