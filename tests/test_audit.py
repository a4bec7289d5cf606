"""docs/audit.md says what `kahanmaps verify` finds: its table is the output of the command that it names."""

from pathlib import Path

import pytest

from kahanmaps.paper.verify import verify
from kahanmaps_cli.commands.verify import markdown

AUDIT = (Path(__file__).parent.parent / "docs" / "audit.md").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.thorough
def test_the_table_of_the_audit_is_what_verify_prints():
    assert AUDIT.split("<!-- table -->\n")[1].strip() == markdown(verify(m=3)).strip()
