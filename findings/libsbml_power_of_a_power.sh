#!/usr/bin/env bash
# The power of a power in the formulas that libSBML writes, alone and in models that Antimony converts.
#
# Expected: what formulaToL3String writes, parseL3Formula reads as the same tree; an SBML model that is written as
#           Antimony text and read again has the same reaction rates.
# Seen:     (a^b)^c is written a^b^c, which is read as a^(b^c); a^(b^c) keeps the parentheses that it does not need.
#           The parentheses are those of an operator that groups to the left, and the reader groups powers to the
#           right. A rate k*(S^2)^3 comes back as k*S^8; (a^-1)^2 = 1/a^2 comes back as 1/a. Sums, quotients and
#           minus signs come back as they were.
# The table of operators in the documentation of both functions says that ^ groups to the left: the writer follows it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check python-libsbml==5.21.2 antimony==3.3.0
"$folder/venv/bin/python" - <<'PYTHON'
import antimony
import libsbml

print("libSBML", libsbml.getLibSBMLDottedVersion(), "Antimony", antimony.__version__)


def again(formula):
    tree = libsbml.parseL3Formula(formula)
    text = libsbml.formulaToL3String(tree)
    read = libsbml.parseL3Formula(text)
    return text, libsbml.writeMathMLToString(tree) == libsbml.writeMathMLToString(read)


print("expected: the formula that is written is read as what it was")
for formula in ("a-(b-c)", "a/(b/c)", "(-a)^2", "a^(b^c)", "(a^b)^c", "(a^-1)^2"):
    text, same = again(formula)
    print(f"  {formula:9} -> {text:11} {'the same' if same else 'another tree'}")
    assert same == (formula not in ("(a^b)^c", "(a^-1)^2"))


def sbml(text):
    antimony.clearPreviousLoads()
    assert antimony.loadAntimonyString(text) > 0, antimony.getLastError()
    return antimony.getSBMLString(antimony.getMainModuleName())


def rate(model):
    document = libsbml.readSBMLFromString(model)  # the tree lives as long as the document
    power = document.getModel().getReaction(0).getKineticLaw().getMath().getChild(1)  # of k * power
    if power.getChild(0).getNumChildren():
        return "(S^2)^3"
    return f"S^({libsbml.formulaToL3String(power.getChild(1))})"


first = sbml("model m; S = 1; k = 1; J: S -> T; k*(S^2)^3; T = 0; end")
antimony.clearPreviousLoads()
assert antimony.loadSBMLString(first) > 0, antimony.getLastError()
text = antimony.getAntimonyString(antimony.getMainModuleName())
second = sbml(text)
print("the model has the rate k *", rate(first))
print("as text:", next(line.strip() for line in text.splitlines() if "->" in line))
print("read again: k *", rate(second))
assert rate(first) == "(S^2)^3" and rate(second) == "S^(2^3)"
print("seen: S^6 has become S^8")
PYTHON
# Here: nothing depends on it; powers of powers do not occur in polynomials that are written out.
