"""docs/audit.md says what `kahanmaps verify` finds: its table is the output of the command that it names."""

from pathlib import Path

import pytest

from kahanmaps.paper.registry import claims
from kahanmaps.paper.verify import verify
from kahanmaps_cli.commands.verify import markdown

AUDIT = (Path(__file__).parent.parent / "docs" / "audit.md").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.thorough
def test_the_table_of_the_audit_is_what_verify_prints():
    assert AUDIT.split("<!-- table -->\n")[1].strip() == markdown(verify(m=3)).strip()


def test_every_misprint_among_the_claims_is_in_the_list_of_the_audit():
    listed = AUDIT.split("## Where the print fails")[1].split("Slips of the pen")[0]
    rows = [line for line in listed.splitlines() if line.startswith("| ") and "verify --section" in line]
    assert len(rows) == sum(1 for claim in claims() if claim.misprint)
