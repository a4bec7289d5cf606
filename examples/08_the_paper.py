"""The paper of Petrera and Suris, statement by statement, for a member whose eigenvalues are not rational.

chi = t^3 - 2 is irreducible with two complex roots, so f_0 is the only rational associated system. All claims of the
paper are proved nevertheless. Then each hypothesis of Theorem 9 is violated in turn, and the theorem fails.
"""

from collections import Counter

from flint import fmpq_poly

import kahanmaps as km

member = km.random_member_with_chi(fmpq_poly([-2, 0, 0, 1]), seed=1)
file = km.SystemFile.from_member(member, "cube root of 2")

report = km.verify(file)
claims = [finding for finding in report.findings if not finding.control]
print(f"{len(claims)} claims:", dict(Counter(str(finding.verdict) for finding in claims)))
for finding in report.findings:
    if finding.place["place"].startswith("Theorem") and "proof" not in finding.place["place"]:
        print(f"{finding.verdict}: {finding.place['place']}, {finding.formula}")

print("misprints of the paper, refuted as printed:")
for finding in report.findings:
    if "misprint" in finding.place:
        print(f"  {finding.verdict}: {finding.place['place']}, {finding.formula}")

print("what makes Theorem 9 fail:")
for finding in km.verify(file, options=km.VerifyOptions(sections=(6,), controls=True)).findings:
    if finding.place.get("key") == "commutativity":
        print(f"  {finding.verdict} if {finding.place['violation']}")
