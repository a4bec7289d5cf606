"""Write the quadratic systems of dysts as system files, with exact parameters.

    python read_dysts.py dysts-0.96-py3-none-any.whl systems

dysts (https://pypi.org/project/dysts) is a collection of chaotic systems. Nothing in it is imported or run: the wheel
is read as data. Right-hand sides are the text of `_rhs`, with intermediate names replaced, and are parsed by kahanmaps.
Numbers are the rationals that their decimals denote: 2.667 is 2667/1000. Each quadratic system becomes a file in the
folder; a line for each class says what became of it.
"""

import ast
import json
import sys
from collections import Counter
from pathlib import Path
from zipfile import ZipFile

import flint

import kahanmaps as km
from kahanmaps.algebra.parsing import parse_number, parse_polynomial


class Replacement(ast.NodeTransformer):
    """Replace names by expressions, and decimals by their own text, which no double has rounded."""

    def __init__(self, source: str, values: dict[str, ast.expr]):
        self.source, self.values = source, values

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return self.values.get(node.id, node)

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        return ast.Name(ast.get_source_segment(self.source, node) or "") if isinstance(node.value, float) else node


def method(classes: dict[str, ast.ClassDef], name: str) -> ast.FunctionDef | None:
    """`_rhs` of a class or of the first of its bases that has one."""
    while name in classes:
        node = classes[name]
        for part in node.body:
            if isinstance(part, ast.FunctionDef) and part.name in ("_rhs", "rhs"):
                return part if part.name == "_rhs" else None
        name = ast.unparse(node.bases[0])
    return None


def right_hand_sides(source: str, function: ast.FunctionDef) -> list[str]:
    """The returned expressions in terms of the arguments."""
    values: dict[str, ast.expr] = {}
    for line in function.body:
        if isinstance(line, ast.Assign) and len(line.targets) == 1 and isinstance(line.targets[0], ast.Name):
            values[line.targets[0].id] = Replacement(source, values).visit(line.value)
        elif isinstance(line, ast.Return) and isinstance(line.value, ast.Tuple):
            return [ast.unparse(Replacement(source, values).visit(entry)) for entry in line.value.elts]
        else:
            raise ValueError(f"a line that is no assignment to a name: {ast.unparse(line)}")
    raise ValueError("no tuple is returned")


def polynomials(source: str, function: ast.FunctionDef, facts: dict) -> tuple[list[str], list[flint.fmpq_mpoly]]:
    """The variables and right-hand sides of a system; ValueError or km.InputError if they are not polynomials."""
    names = [argument.arg for argument in function.args.args]
    variables, parameters = names[: names.index("t")], names[names.index("t") + 1 :]
    numbers = {name: parse_number(str(facts["parameters"][name])) for name in parameters}
    return variables, [parse_polynomial(text, variables, numbers) for text in right_hand_sides(source, function)]


def document(name: str, variables: list[str], rhs: list[flint.fmpq_mpoly]) -> str:
    """The system file."""
    texts = [str(entry) for entry in rhs]
    return f"name = {json.dumps(name)}\nvariables = {json.dumps(variables)}\n\n[system]\nrhs = {json.dumps(texts)}\n"


def main(wheel: str, folder: str) -> None:
    """Write the files, and say what became of each class."""
    with ZipFile(wheel) as archive:
        source = archive.read("dysts/flows.py").decode()
        # Numbers stay text: a double of 2.667 is another number.
        facts = json.loads(archive.read("dysts/data/chaotic_attractors.json"), parse_float=str)
    classes = {node.name: node for node in ast.parse(source).body if isinstance(node, ast.ClassDef)}
    Path(folder).mkdir(exist_ok=True)
    count: Counter[str] = Counter()
    for name in sorted(facts):
        function = method(classes, name)
        if function is None:
            kind, reason = "not read", "rhs is a function of an array"
        else:
            try:
                variables, rhs = polynomials(source, function, facts[name])
                degree = max(entry.total_degree() for entry in rhs)
                kind, reason = ("quadratic", "") if degree <= 2 else ("polynomial of higher degree", f"degree {degree}")
            except (ValueError, km.InputError) as error:
                kind, reason = "not polynomial", str(error).splitlines()[0]
        if kind == "quadratic":
            (Path(folder) / f"{name}.toml").write_text(document(name, variables, rhs))
        count[kind] += 1
        print(f"{name}\t{kind}\t{reason}")
    print(", ".join(f"{number} {kind}" for kind, number in sorted(count.items())), f"of {len(facts)}")


if __name__ == "__main__":
    main(*sys.argv[1:])
