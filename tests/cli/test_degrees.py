"""kahanmaps degrees: the sequence, its recurrence, what is told where there is none, and exit statuses."""


def test_the_degrees_of_the_euler_top(kahanmaps):
    outcome = kahanmaps("degrees euler_top")
    assert (outcome.status, outcome.err) == (0, "")
    assert outcome.out.splitlines() == [
        "# euler_top, generic eps, 2 random lines modulo primes of 61 bits: measured, not proved",
        "degrees\t1, 3, 9, 19, 33, 51, 73, 99, 129, 163, 201, 243",
        "growth\tquadratic growth, dynamical degree 1",
        "recurrence\ta(n) = 3*a(n-1)-3*a(n-2)+a(n-3) for n >= 3, explained by the singularities; 12 measured terms "
        "agree",
        "characteristic polynomial\t(t - 1)^3",
        "closed form\t2*n^2 + 1",
        "generating function\t(1 + 3*z^2) / (1 - 3*z + 3*z^2 - z^3)",
        "singularities\tnothing new after step 3",
        *(
            f"contracted\tC{k}: 2*x1^2*eps^2 + x2^2*eps^2 {sign} 4*x1*x3*eps^2 + 2*x3^2*eps^2 {linear} + 1 = 0, "
            f"degree 2: contracted, a hypersurface again after 3 steps; costs 2 at step 3; meets {met}"
            for k, sign, linear, met in (
                (1, "-", "+ 2*x2*eps", "C1 at step 2, C2 at step 2 (order 2)"),
                (2, "+", "- 2*x2*eps", "C1 at step 2 (order 2), C2 at step 2"),
            )
        ),
        "ended\tthe singularities explain the degrees, and those measured agree",
    ]


def test_generic_eps_is_told_as_such(kahanmaps):
    found = kahanmaps("degrees weierstrass --terms 3 --json").json
    assert (found["eps"], found["time_step"]) == ("generic", "generic")
    assert found["lines"][0]["eps_residue"] != found["lines"][1]["eps_residue"]
