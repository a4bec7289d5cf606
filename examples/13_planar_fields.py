"""All homogeneous quadratic planar fields with coefficients from -2 to 2: which of their Kahan maps are integrable?

The 15624 fields f = (a x^2 + b x y + c y^2, ...) other than 0 fall into 1132 classes under linear changes of variables
over the algebraic numbers. f is determined by its divergence D and by the cubic form C = x f_2 - y f_1, whose roots are
the invariant lines. If C has three roots and D is not 0, the class is the point (C(d) : H(d) : disc C) of the plane,
with d the root of D and H the Hessian of C; the other classes have one parameter or none. The maps of a class have the
same degrees. The script prints the classes whose degrees grow at most polynomially, with an integral of the map, and
how often the other dynamical degrees occur. Singularities are traced for 30 steps. Takes three minutes.
"""

from collections import Counter, defaultdict
from fractions import Fraction
from itertools import product
from math import gcd

import kahanmaps as km

STEPS = 30
MONOMIALS = ("x^2", "x*y", "y^2")


def projective(numbers):
    """Integers up to a common factor."""
    common = gcd(*numbers)
    sign = next((1 if number > 0 else -1 for number in numbers if number), 1)
    return tuple(number * sign // common for number in numbers) if common else numbers


def double_root_parameter(C, H, D):
    """D at the simple root over the coefficient of C, in coordinates whose axes are the roots; is D 0 at the other one?

    H is a square up to a factor, and its root r the double root: C = L^2 M with L(r) = 0. The simple root is s.
    """
    p, q, _ = H
    r = (-q, 2 * p) if p else (1, 0)
    L = (r[1], -r[0])
    if L[0]:
        m = Fraction(C[0], L[0] ** 2)
        M = (m, (Fraction(C[1]) - 2 * L[0] * L[1] * m) / L[0] ** 2)
    else:
        M = (Fraction(C[2], L[1] ** 2), Fraction(C[3], L[1] ** 2))
    s = (-M[1], M[0])
    factor = (L[0] * s[0] + L[1] * s[1]) ** 2 * (M[0] * r[0] + M[1] * r[1]) / (s[0] * r[1] - s[1] * r[0])
    return (D[0] * s[0] + D[1] * s[1]) / factor, D[0] * r[0] + D[1] * r[1] == 0


def class_of(field):
    """The kind of the roots of C, and the invariants that distinguish the classes of this kind."""
    (a1, b1, c1), (a2, b2, c2) = field
    a, b, c, d = C = (a2, b2 - a1, c2 - b1, -c1)
    D = (2 * a1 + b2, b1 + 2 * c2)
    H = (b * b - 3 * a * c, b * c - 9 * a * d, c * c - 3 * b * d)
    disc = b * b * c * c - 4 * a * c**3 - 4 * b**3 * d + 18 * a * b * c * d - 27 * a * a * d * d
    roots = 3 if disc else 2 if any(H) else 1 if any(C) else 0
    if not any(D):
        return roots, "D = 0"
    u, v = -D[1], D[0]
    if roots == 3:
        at_C = a * u**3 + b * u * u * v + c * u * v * v + d * v**3
        return roots, projective((at_C, H[0] * u * u + H[1] * u * v + H[2] * v * v, disc))
    if roots == 2:
        return roots, double_root_parameter(C, H, D)
    if roots == 1:
        r = (-b, 3 * a) if a else (1, 0)
        return roots, D[0] * r[0] + D[1] * r[1] == 0
    return roots, "D not 0"


def classes():
    """The fields other than 0 by their class; the first of each has the fewest and smallest coefficients."""
    results = defaultdict(list)
    for entries in product(range(-2, 3), repeat=6):
        if any(entries):
            results[class_of((entries[:3], entries[3:]))].append(entries)
    return {
        key: sorted(fields, key=lambda f: (sum(map(bool, f)), sum(map(abs, f)), [-entry for entry in f]))
        for key, fields in results.items()
    }


def polynomial(coefficients):
    """Text, for instance x^2 - 2*x*y."""
    text = " + ".join(f"{c}*{name}" for c, name in zip(coefficients, MONOMIALS, strict=True) if c) or "0"
    return f" {text}".replace("+ -", "- ").replace(" 1*", " ").replace(" -1*", " -").strip()


def system_of(field):
    """The system of a field."""
    return km.QuadraticSystem.from_text(["x", "y"], [polynomial(field[:3]), polynomial(field[3:])])


def main():
    """Print both tables."""
    slow, fast = [], Counter()
    for (roots, _), fields in sorted(classes().items(), key=lambda item: item[1][0]):
        system = system_of(fields[0])
        growth = km.degree_growth(system, enclosed=False, max_degree=1000, steps=STEPS)
        if str(growth.growth) == "exponential":
            fast[growth.dynamical_degree.text] += 1
            continue
        search = km.find_integrals(system)
        integral = search.integrals[0].text if search.integrals else "none found"
        closed = growth.recurrence.closed_form.split(";")[0]
        equations = f"({', '.join(map(polynomial, (fields[0][:3], fields[0][3:])))})"
        slow.append((str(growth.growth), closed, equations, roots, len(fields), integral))
    print("| growth | degrees | field | roots of C | fields | integral of the map |")
    print("|---|---|---|---|---|---|")
    for line in sorted(slow):
        print(f"| {' | '.join(map(str, line))} |")
    print()
    print("| classes of exponential growth | dynamical degree |")
    print("|---|---|")
    for text, count in sorted(fast.items(), key=lambda item: (-item[1], item[0])):
        print(f"| {count} | {text} |")


if __name__ == "__main__":
    main()
