"""Maps that are not Kahan's, written for other programs: what runs gives the values of the library."""

import re

import pytest
from flint import fmpq
from helpers import DIMENSION
from language_helpers import run_python

import kahanmaps as km
from kahanmaps.documents.catalog import load, map_names
from kahanmaps.documents.files import parse_system
from kahanmaps.errors import InputError
from kahanmaps.languages.convert import convert
from kahanmaps.languages.language import LANGUAGES

FILES = {name: load(name) for name in map_names() if DIMENSION[name] < 4}
FILES["adjusted"] = parse_system('variables = ["x", "y"]\n[system]\nrhs = ["x*y + eps*x^2", "y^2 - eps"]', "adjusted")
PARTS = ["map", "map-formulas", "inverse"]
EPS = "1/3"


def start_of(file: km.SystemFile) -> list[str]:
    return [f"{k + 2}/{2 * k + 7}" for k in range(file.dim)]


def script(file: km.SystemFile) -> str:
    point = f"[{', '.join(f'Rational({text!r})' for text in start_of(file))}]"
    eps = f", Rational('{EPS}')" if file.map.has_eps else ""
    return convert(file, "sympy", PARTS) + (
        f"\nfrom sympy import Rational\nimage = list(map_step({point}{eps}))\n"
        f"print(image)\nprint(list(map_step_formula({point}{eps})))\n"
        f"print(list(map_inverse(image{eps})))\n"
    )


@pytest.fixture(scope="module")
def printed() -> dict[str, list[str]]:
    """What the scripts print, all run by one process."""
    scripts = {name: script(file) for name, file in FILES.items()}
    symbolic = convert(load("lyness"), "sympy", ["map", "integrals"], symbols=["a"])
    scripts["symbolic"] = symbolic + ("\nfrom sympy import Rational\nprint(list(map_step([1, 2], Rational('7/2'))))\n")
    return run_python(scripts)


@pytest.mark.parametrize("name", FILES)
def test_the_map_the_formulas_and_the_inverse_are_those_of_the_library(
    name: str, printed: dict[str, list[str]]
) -> None:
    file = FILES[name]
    start = tuple(fmpq(*map(int, text.split("/"))) for text in start_of(file))
    image = file.map.at(EPS).step(start)
    shown = [line.strip("[]").split(", ") for line in printed[name]]
    assert shown == [[str(entry) for entry in point] for point in (image, image, start)]


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", ["lyness", "duffing_polarised", "lotka_volterra_symplectic_euler", "hky"])
def test_every_language_takes_every_kind(language: str, name: str) -> None:
    text = convert(load(name), language)
    assert "Kahan map" not in text
    assert ("time step" in text) == bool(load(name).map.time_steps)
    assert bool(re.search(r"\beps\b", text)) == load(name).map.has_eps


@pytest.mark.parametrize(
    ("name", "call"),
    [("lyness", "map_step([1, 2])"), ("repaired_octahedral", "map_step([1, 2], Rational(1, 10))")],
)
def test_the_example_gives_eps_to_maps_that_have_one(name: str, call: str) -> None:
    assert f"# For example: {call}\n" in convert(load(name), "sympy")


def test_a_map_has_no_vector_field() -> None:
    for part in ("system", "jacobian"):
        with pytest.raises(InputError, match=f"found the part {part} of an explicit map, expected map"):
            convert(load("lyness"), "pari", ["map", part])


def test_parameters_stay_symbols(printed: dict[str, list[str]]) -> None:
    assert printed["symbolic"] == ["[2, 11/2]"]
