#!/usr/bin/env bash
# Integers and rational numbers above 2^31 in the formulas of libSBML.
#
# Expected: 3000000000 is refused, or becomes a double, as 3000000000*x does in parseL3Formula; a rational number that
#           libSBML accepts and writes is read back as it was.
# Seen:     parseL3Formula keeps (3000000000/7)*x as a rational number, and from there it has three values: its MathML
#           says 3000000000/7, formulaToL3String -1294967296/7, and the document that it is written to is read as
#           2147483647/7, with an error in the log of the document and no exception. The consistency check of the
#           document finds only missing units, and quotes the negative number. parseFormula wraps integers as well.
# SBML itself restricts integers to 32 bits, so that 3000000000 should not have been written as one.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check python-libsbml==5.21.2
"$folder/venv/bin/python" - <<'PYTHON'
import libsbml

print("libSBML", libsbml.getLibSBMLDottedVersion())
formula = "(3000000000/7)*x"
tree = libsbml.parseL3Formula(formula)
document = libsbml.SBMLDocument(3, 2)
model = document.createModel()
for name in ("x", "y"):
    parameter = model.createParameter()
    parameter.setId(name)
    parameter.setConstant(False)
    parameter.setValue(1)
rule = model.createAssignmentRule()
rule.setVariable("y")
assert rule.setMath(tree) == libsbml.LIBSBML_OPERATION_SUCCESS
document.checkConsistency()
found = [document.getError(n) for n in range(document.getNumErrors())]
severe = [error for error in found if error.getSeverity() >= libsbml.LIBSBML_SEV_ERROR]
text = libsbml.writeSBMLToString(document)
read = libsbml.readSBMLFromString(text)
print("expected: one value, or an error, for", formula)
written = next(line.strip() for line in text.splitlines() if "<cn" in line)
as_text = libsbml.formulaToL3String(tree)
from_document = libsbml.formulaToL3String(read.getModel().getRule(0).getMath())
print("  MathML:           ", written)
print("  formulaToL3String:", as_text)
print("  document, read:   ", from_document)
print("  log of the reader:", read.getError(0).getMessage().strip())
print("  errors found by the check of the document written:", len(severe))
old = libsbml.formulaToString(libsbml.parseFormula("3000000000*x"))
new = libsbml.formulaToL3String(libsbml.parseL3Formula("3000000000*x"))
print("  3000000000*x by parseFormula:", old, " by parseL3Formula:", new)
assert "3000000000 <sep/> 7" in written and as_text == "(-1294967296/7) * x" and from_document == "(2147483647/7) * x"
assert not severe and read.getNumErrors() == 1 and (old, new) == ("-1294967296 * x", "3000000000 * x")
print("seen: three values of one rational number")
PYTHON
# Here: nothing depends on it; the project does not write SBML.
