"""All Lotka-Volterra systems x_i' = x_i (A x)_i in dimension 3 with entries of A in -1, 0, 1: which are integrable?

The 19682 matrices A other than 0 fall into 503 classes under permutations and changes of sign of the variables, which
act on A by simultaneous permutations of rows and columns, and by signs of columns. A class is indecomposable if no
proper subset of the variables forms a system of its own, that is, if the graph with an edge from i to j where A_ij is
not 0 is strongly connected. The script prints the indecomposable classes whose degrees grow at most polynomially, with
independent integrals of the map, and how often the other growths occur. Singularities are traced for 20 steps. Takes
three minutes.
"""

from collections import Counter
from itertools import permutations, product

import kahanmaps as km

STEPS = 20
NAMES = ("x", "y", "z")


def class_of(A):
    """The largest of the matrices in the class of A, as rows."""
    candidates = []
    for order in permutations(range(3)):
        rows = [[A[i][j] for j in order] for i in order]
        for column in range(3):
            if next((row[column] for row in rows if row[column]), 1) < 0:
                for row in rows:
                    row[column] *= -1
        candidates.append(tuple(map(tuple, rows)))
    return max(candidates)


def is_indecomposable(A):
    """Does every proper subset of the variables need another one?"""
    subsets = (indices for indices in product((False, True), repeat=3) if 0 < sum(indices) < 3)
    return all(any(A[i][j] for i in range(3) if inside[i] for j in range(3) if not inside[j]) for inside in subsets)


def right_hand_sides(A):
    """Text for each equation, for instance x*(y - z)."""
    texts = []
    for name, row in zip(NAMES, A, strict=True):
        terms = [("-" if entry < 0 else "") + other for other, entry in zip(NAMES, row, strict=True) if entry]
        if len(terms) == 1:
            texts.append(f"{terms[0][:-1]}{name}*{terms[0][-1]}")
        else:
            texts.append(f"{name}*({' + '.join(terms)})".replace("+ -", "- ") if terms else "0")
    return texts


def main():
    """Print both tables."""
    classes = Counter(class_of((e[:3], e[3:6], e[6:])) for e in product((-1, 0, 1), repeat=9) if any(e))
    slow, counts = [], Counter()
    for A, size in sorted(classes.items(), reverse=True):
        equations = right_hand_sides(A)
        system = km.QuadraticSystem.from_text(NAMES, equations)
        growth = km.degree_growth(system, enclosed=False, max_degree=1000, steps=STEPS)
        kind, number = str(growth.growth), growth.dynamical_degree.text
        counts[number if kind == "exponential" else kind, is_indecomposable(A)] += 1
        if kind != "exponential" and is_indecomposable(A):
            integrals = [integral.text for integral in km.find_integrals(system).integrals]
            degrees = ", ".join(map(str, growth.degrees[:7]))
            slow.append((kind, degrees, f"({', '.join(equations)})", size, len(integrals), "; ".join(integrals)))
    print("| growth | degrees from n = 0 | field | matrices | integrals | formulas |")
    print("|---|---|---|---|---|---|")
    for line in sorted(slow):
        print(f"| {' | '.join(map(str, line))} |")
    print()
    print("| growth, or dynamical degree | indecomposable classes | others |")
    print("|---|---|---|")
    for kind in sorted({kind for kind, _ in counts}, key=lambda kind: (kind[0].isdigit(), kind)):
        print(f"| {kind} | {counts[kind, True]} | {counts[kind, False]} |")


if __name__ == "__main__":
    main()
