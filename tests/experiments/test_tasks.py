"""The tasks of the library: each gives what a direct call gives, as plain data, and says what it cannot do."""

import json
from hashlib import sha256
from pathlib import Path

import pytest
from flint import fmpq
from helpers import refuses
from specs import made, member, perform

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.checks.claims import Certainty
from kahanmaps.checks.commute import check_commute
from kahanmaps.checks.conserve import check_integrals
from kahanmaps.checks.preserve import check_measure, check_poisson
from kahanmaps.checks.settings import Settings, random_starts
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import parse_system
from kahanmaps.experiments.results.store import Store
from kahanmaps.experiments.running.local import perform as done_in_child
from kahanmaps.experiments.running.run import run
from kahanmaps.experiments.spec import SpecError, parse_spec
from kahanmaps.family.system_normal_form import system_normal_form
from kahanmaps.invariants.heights import height_growth
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form.periods import period_of
from kahanmaps.maps.orbits.iteration import Orbit
from kahanmaps.paper.verify import VerifyOptions, verify

FALSE = """
name = "false claims"
variables = ["x", "y"]
[system]
rhs = ["x*(1 - y)", "y*(x - 1)"]
[integrals]
I = "x + y"
[density]
phi = "x + y"
"""


MEMBER, WRONG = member(), made(parse_system(FALSE))
LORENZ, TOP, RIVALS = (made(load(name)) for name in ("lorenz", "euler_top", "lotka_volterra"))


def start_of(system, seed=0):
    return next(random_starts(system.system.dim, derive_seed(seed, system.system.rhs)))


def normal_form(system):
    return system_normal_form(system.system, system.hamiltonian, system.member)


@pytest.mark.parametrize(
    ("name", "system", "requested", "call"),
    [
        ("check-commute", MEMBER, {"eps": "1/3"}, lambda: check_commute(MEMBER, None, Settings(eps="1/3"))),
        (
            "check-commute",
            TOP,
            {"other": TOP, "eps": 1, "eps2": "1/7", "seed": 5},
            lambda: check_commute(TOP, TOP, Settings(eps=1, seed=5), fmpq(1, 7)),
        ),
        ("check-integrals", TOP, {"steps": 3}, lambda: check_integrals(TOP, Settings(steps=3))),
        ("check-integrals", WRONG, {}, lambda: check_integrals(WRONG)),
        ("check-measure", RIVALS, {"error_bits": 60}, lambda: check_measure(RIVALS, Settings(error_bits=60))),
        ("check-poisson", MEMBER, {"start": "1,2,3,4"}, lambda: check_poisson(MEMBER, Settings(start=(1, 2, 3, 4)))),
        (
            "verify",
            MEMBER,
            {"sections": 2, "controls": True, "eps": "1/3"},
            lambda: verify(MEMBER, Settings(eps="1/3"), VerifyOptions((2,), controls=True)),
        ),
        ("verify", MEMBER, {"sections": 4, "ball_bits": 64}, lambda: verify(MEMBER, None, VerifyOptions((4,), 3, 64))),
        (
            "verify-universal",
            None,
            {"m": 2, "sections": 2, "controls": True, "order": 1},
            lambda: verify(None, None, VerifyOptions((2,), 1, None, True), m=2),
        ),
    ],
)
def test_a_check_counts_the_claims_of_the_report_and_keeps_what_does_not_hold(name, system, requested, call):
    result, report = perform(name, system, report=True, **requested), call()
    assert result["verdict"] == str(report.verdict)
    assert result["report"] == json.loads(json.dumps(report.to_json()))
    counted = [f for f in report.findings if f.applies and not f.control]
    controls = [f for f in report.findings if f.control]
    assert result["claims"] == len(counted)
    assert all(result[str(verdict)] == sum(f.verdict is verdict for f in counted) for verdict in Certainty)
    refuted = sum(f.verdict is Certainty.REFUTED for f in controls)
    assert (result["controls"], result["controls_refuted"]) == (len(controls), refuted)
    doubtful = [f for f in counted if f.verdict.holds is not True]
    assert result.get("doubtful", []) == [json.loads(json.dumps(f.to_json())) for f in doubtful]


@pytest.mark.parametrize("arithmetic", ["exact", f"mod:{2**89 - 1}", "ball:200"])
def test_an_orbit_ends_where_the_library_does(arithmetic):
    kind, _, number = arithmetic.partition(":")
    field = {"exact": lambda _: QQ, "mod": GF, "ball": RR}[kind](int(number or 0))
    result = perform("orbit", LORENZ, eps="0.1", steps=5, arithmetic=arithmetic)
    walk = Orbit(KahanMap(LORENZ.system, "1/10", field), start_of(LORENZ), 5, max_digits=None)
    expected = ",".join(list(walk)[-1].text)
    assert result["last_sha256"] == sha256(expected.encode()).hexdigest()
    assert result.get("last", expected) == expected
    assert (result["status"], result["reached"], result["method"]) == ("completed", 5, "generic")


def test_an_iterate_beyond_the_budget_leaves_the_start_as_the_last_point():
    result = perform("orbit", MEMBER, eps="1/10", at=10**6, max_digits=100, start="1,2,3,44")
    assert (result["status"], result["reached"], result["last"], result["digits"]) == ("budget", 0, "1,2,3,44", 2)


@pytest.mark.parametrize("name", ["orbit", "period"])
def test_a_start_is_drawn_from_the_seed_unless_given(name):
    drawn = perform(name, MEMBER, eps="1/10", seed=5)
    point = ",".join(map(str, start_of(MEMBER, 5)))
    assert drawn["start"] == point
    assert perform(name, MEMBER, eps="1/10", start=point) == drawn


@pytest.mark.parametrize(("system", "steps", "growth"), [(MEMBER, 40, "quadratic"), (LORENZ, 9, "exponential")])
def test_heights_are_those_of_the_library(system, steps, growth):
    phi, known = KahanMap(system.system, "1/10"), normal_form(system)
    outcome = height_growth(phi, start_of(system), steps, normal_form=known).to_json()
    result = perform("heights", system, eps="1/10", steps=steps)
    assert result["growth"] == outcome["kind"] == growth
    assert {name: result[name] for name in ("heights", "constant")}.items() <= outcome.items()
    assert result["reached"] == steps


@pytest.mark.parametrize("prime", [None, 10007])
def test_a_period_is_that_of_the_library(prime):
    period = period_of(normal_form(MEMBER), "1/10", start_of(MEMBER), prime)
    result = perform("period", MEMBER, eps="1/10", **({} if prime is None else {"prime": prime}))
    assert result["period"] == (None if period.period is None else str(period.period))
    assert (result["status"], result["meets_pole"]) == (period.status, period.meets_pole)
    assert result["planes"] == [plane.text for plane in period.planes]


@pytest.mark.parametrize(
    ("name", "system", "requested", "words"),
    [
        ("check-commute", LORENZ, {}, "kind \\[family\\]"),
        ("check-commute", TOP, {"other": TOP, "eps2": 1}, "a second step needs the first one as well"),
        ("family-space", LORENZ, {}, "lorenz is of kind \\[system\\], expected one of kind \\[family\\]"),
        ("orbit", LORENZ, {"eps": 1, "at": 5, "method": "doubling"}, "needs a normal form, and there is none"),
        ("orbit", LORENZ, {"eps": 1, "at": 5, "arithmetic": "float"}, "need exact, mod:P or ball:BITS arithmetic"),
        ("period", LORENZ, {"eps": 1}, "no period of lorenz can be computed"),
        ("period", MEMBER, {"eps": 1, "start": "1,2"}, "found a point with 2 coordinates, expected 4"),
        ("find-integrals", TOP, {"symbolic": "b"}, "found the symbol 'b'"),
        ("scan", TOP, {"over": "a1", "by": "integrals"}, "expected one of degrees"),
        ("degrees", TOP, {"max_degree": 0}, "found the largest degree 0, expected at least 1"),
        ("singularities", TOP, {"steps": 0}, "found 0 steps, expected 1 to 10000"),
        ("cycles", TOP, {"prime": 31, "steps": 5}, "found steps = 5 without samples"),
        ("cycles", TOP, {"prime": 7, "eps": "1/7"}, "the prime 7 divides the denominator of 1/7"),
        ("lyapunov", TOP, {"eps": 1, "steps": 1}, "found steps = 1 and transient = 0, expected at least 2"),
    ],
)
def test_an_impossible_task_is_refused_in_a_sentence(name, system, requested, words):  # others are in wrong_use.txt
    refuses(words, perform, name, system, **requested)


FILES = sorted((Path(__file__).parents[2] / "examples" / "maps").glob("*.toml"))


def spec_for(systems, axes):
    """A spec with an experiment about these systems for each task."""
    heads = ((task, f'[experiments.{task}]\ntask = "{task}"\nsystem = {list(map(str, systems))}\n') for task in axes)
    return "".join(f"{head}axes = {{ {axes[task]} }}\n" for task, head in heads)


def test_a_batch_takes_all_kinds_of_map_and_says_of_each_task_that_does_not(tmp_path):
    axes = {"degrees": "terms = 3", "singularities": 'eps = "1/3"', "check-measure": "", "find-integrals": ""}
    axes["orbit"] = 'eps = "1/10", steps = 3, arithmetic = ["exact", "float", "mod:10007"]'
    list(run(spec_for(FILES, axes), tmp_path / "maps.db"))
    answer, verdicts = {}, set()
    with Store.open(tmp_path / "maps.db") as store:
        for row in store.rows():
            answer.setdefault(row.task.kind, []).append((row.record.outcome, row.record.result or {}))
            verdicts.add((row.task.kind, row.record.verdict))
    assert sorted(result["degrees"][3] for _, result in answer["degrees"]) == [8, 9, 19, 19, 74]
    assert [outcome for outcome, _ in answer["singularities"]] == ["ok"] * 5
    assert {(outcome, result["status"]) for outcome, result in answer["orbit"]} == {("ok", "completed")}
    assert {verdict for kind, verdict in verdicts if kind == "check-measure"} == {"proved"}
    assert [outcome for outcome, _ in answer["find-integrals"]] == ["ok"] * 5


def test_no_eps_is_asked_for_where_no_map_depends_on_it():
    many = "steps = 12, orbits = 2"
    axes = {"orbit": "steps = 3", "heights": "steps = 12", "lyapunov": many, "ensemble": many}
    spec = parse_spec(spec_for(["lyness", "somos_4"], axes))
    tasks = [task for experiment in spec.experiments for task in experiment.tasks()]
    assert [done_in_child(task, None, spec.documents)["outcome"] for task in tasks] == ["ok"] * 8
    missing = r"axes\.eps: missing, expected half the time step"
    refuses(missing, parse_spec, spec_for(["lyness", "euler_top"], {"orbit": "steps = 3"}), error=SpecError)
