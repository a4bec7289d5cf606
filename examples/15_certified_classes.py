"""Certify the integrals in the tables of the examples 13 and 14: another program checks each of them without kahanmaps.

    python 15_certified_classes.py          SymPy checks; two minutes
    python 15_certified_classes.py gp       PARI/GP checks

Every formula of the tables becomes a certificate for every eps. A script that prints "true" for each of its identities,
and ends with status 0, is accepted. As a control, the formula plus x is refuted in every case.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import kahanmaps as km
from kahanmaps.certificates.identities import FalseClaim

HERE = Path(__file__).parent
COMMANDS = {"sympy": [sys.executable], "gp": ["gp", "-q"]}


def rows(path):
    """The field and the integrals of each row of the first table."""
    first, *_ = path.read_text(encoding="utf-8").split("\n\n")
    head, _, *lines = ([cell.strip() for cell in line.strip("| ").split(" | ")] for line in first.splitlines())
    where = next(k for k, name in enumerate(head) if name in ("integral of the map", "formulas"))
    for cells in lines:
        formulas = [] if cells[where] == "none found" else cells[where].split("; ")
        yield cells[head.index("field")][1:-1].split(", "), formulas


def main(checker="sympy"):
    """Certify every integral, and count."""
    for name in ("13_planar_fields", "14_lotka_volterra_fields"):
        classes, accepted, formulas, refuted = 0, 0, 0, 0
        for right_hand_sides, integrals in rows(HERE / f"{name}.out"):
            system = km.QuadraticSystem.from_text(["x", "y", "z"][: len(right_hand_sides)], right_hand_sides)
            classes += bool(integrals)
            for integral in integrals:
                formulas += 1
                with tempfile.NamedTemporaryFile("w", suffix=".txt") as script:
                    script.write(km.certificate(system, checker, integrals={"I": integral}))
                    script.flush()
                    done = subprocess.run([*COMMANDS[checker], script.name], capture_output=True, text=True)
                said = done.stdout.splitlines()
                accepted += done.returncode == 0 and bool(said) and all(line.endswith("true") for line in said)
                try:
                    km.certificate(system, checker, integrals={"I": f"{integral} + x"})
                except FalseClaim:
                    refuted += 1
        print(f"{name}: {accepted} of {formulas} integrals of {classes} classes accepted, {refuted} controls refuted")


if __name__ == "__main__":
    main(*sys.argv[1:])
