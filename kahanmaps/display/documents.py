"""How the file of a system looks in a notebook: equations, parameters, claims."""

from __future__ import annotations

from kahanmaps.algebra.written.text import format_number
from kahanmaps.display import markup
from kahanmaps.display.formulas import formula, matrix
from kahanmaps.display.systems import CHARACTERS, map_html
from kahanmaps.displayed import html_form
from kahanmaps.documents.files import SystemFile


@html_form.register
def file_html(file: SystemFile) -> str:
    """A system file: its equations, parameters and claims."""
    rows = [("equations", map_html(file.map))]
    if file.parameters:
        values = (f"{name} = {markup.shortened(format_number(v))}" for name, v in list(file.parameters.items())[:20])
        rows.append(("parameters", markup.escape(", ".join(values))))
    if file.member is not None:
        rows.append(("member of the commuting family", matrix(file.member.A, "A")))
    if file.hamiltonian is not None:
        rows.append(("Hamiltonian", formula(file.hamiltonian.H, "H", CHARACTERS)))
    rows += [
        (f"integral {markup.shortened(name)}".strip(), formula(function, characters=CHARACTERS))
        for name, function in [*file.integrals.items(), *file.integrals_in_iterates.items()][:10]
    ]
    if file.density is not None:
        rows.append(("density (claimed)", formula(file.density, "phi", CHARACTERS)))
    title = file.catalog.get("title", "")
    return markup.titled(markup.shortened(file.name), markup.definitions(rows), markup.shortened(str(title), 200))
