"""The references that docstrings, catalogue files and evidence cite by their keys.

In petrera-suris-2016 definitions, propositions, lemmas and theorems share one numbering: Theorem 9 is commutativity,
Theorem 11 the integrals, Theorem 12 the Poisson structure. Displayed equations of this paper are cited by their labels
in its LaTeX source.
"""

from __future__ import annotations

SOURCES: dict[str, str] = {
    "petrera-suris-2016": (
        "M. Petrera, Yu. B. Suris. A construction of commuting systems of integrable symplectic birational maps. "
        "arXiv:1607.07085"
    ),
    "petrera-suris-4d": (
        "M. Petrera, Yu. B. Suris. A construction of a large family of commuting pairs of integrable symplectic "
        "birational 4-dimensional maps. arXiv:1606.08238"
    ),
    "petrera-suris-euler": (
        "M. Petrera, Yu. B. Suris. On the Hamiltonian structure of Hirota-Kimura discretization of the Euler top. "
        "Math. Nachr. 283 (2010), 1654-1663. arXiv:0707.4382"
    ),
    "petrera-pfadler-suris-2011": (
        "M. Petrera, A. Pfadler, Yu. B. Suris. On integrability of Hirota-Kimura type discretizations. "
        "Regul. Chaotic Dyn. 16 (2011), 245-289. arXiv:1008.1040"
    ),
    "cmoq-2013": (
        "E. Celledoni, R. I. McLachlan, B. Owren, G. R. W. Quispel. Geometric properties of Kahan's method. "
        "J. Phys. A 46 (2013), 025201. arXiv:1209.1164"
    ),
    "cmoq-2015": (
        "E. Celledoni, R. I. McLachlan, D. I. McLaren, B. Owren, G. R. W. Quispel. Discretization of polynomial vector "
        "fields by polarization. Proc. R. Soc. A 471 (2015), 20150390. arXiv:1506.03855"
    ),
    "mcmillan-1971": (
        "E. M. McMillan. A problem in the stability of periodic systems. In: Topics in modern physics, a tribute to "
        "E. U. Condon, Colorado Associated University Press, 1971, 219-244"
    ),
    "salmon-1879": "G. Salmon. A treatise on the higher plane curves. 3rd edition, Hodges and Foster, Dublin, 1879",
    "lyness-1945": "R. C. Lyness. Cycles. Math. Gazette 29 (1945), 231-233",
    "qrt-1988": (
        "G. R. W. Quispel, J. A. G. Roberts, C. J. Thompson. Integrable mappings and soliton equations. "
        "Phys. Lett. A 126 (1988), 419-421"
    ),
    "hietarinta-viallet-1998": (
        "J. Hietarinta, C.-M. Viallet. Singularity confinement and chaos in discrete systems. Phys. Rev. Lett. 81 "
        "(1998), 325-328. arXiv:solv-int/9711014"
    ),
    "grammaticos-ramani-2004": (
        "B. Grammaticos, A. Ramani. Discrete Painleve equations: a review. Lecture Notes in Phys. 644 (2004), 245-321"
    ),
    "hone-2005": (
        "A. N. W. Hone. Elliptic curves and quadratic recurrence sequences. Bull. London Math. Soc. 37 (2005), 161-171"
    ),
    "hone-2007": (
        "A. N. W. Hone. Sigma function solution of the initial value problem for Somos 5 sequences. Trans. Amer. Math. "
        "Soc. 359 (2007), 5019-5034"
    ),
    "cima-gasull-manosa-2007": (
        "A. Cima, A. Gasull, V. Manosa. Dynamics of the third order Lyness' difference equation. J. Difference Equ. "
        "Appl. 13 (2007), 855-884"
    ),
    "kassotakis-joshi-2010": (
        "P. Kassotakis, N. Joshi. Integrable non-QRT mappings of the plane. Lett. Math. Phys. 91 (2010), 71-81. "
        "arXiv:0906.2815"
    ),
    "hairer-lubich-wanner-2006": (
        "E. Hairer, C. Lubich, G. Wanner. Geometric numerical integration. 2nd edition, Springer, 2006"
    ),
    "hirota-kimura-2000": (
        "R. Hirota, K. Kimura. Discretization of the Euler top. J. Phys. Soc. Japan 69 (2000), 627-630"
    ),
    "kahan-1993": "W. Kahan. Unconventional numerical methods for trajectory calculations. Lecture notes, 1993",
    "sanz-serna-1994": (
        "J. M. Sanz-Serna. An unconventional symplectic integrator of W. Kahan. Appl. Numer. Math. 16 (1994), 245-250"
    ),
    "fiat-shamir-1987": (
        "A. Fiat, A. Shamir. How to prove yourself: practical solutions to identification and signature problems. "
        "Advances in Cryptology - CRYPTO '86, Lecture Notes in Computer Science 263, Springer 1987, 186-194"
    ),
    "bellare-rogaway-1993": (
        "M. Bellare, P. Rogaway. Random oracles are practical: a paradigm for designing efficient protocols. "
        "1st ACM Conference on Computer and Communications Security, 1993, 62-73"
    ),
    "canetti-2004": (
        "R. Canetti, O. Goldreich, S. Halevi. The random oracle methodology, revisited. J. ACM 51 (2004), 557-594"
    ),
    "albrecht-2018": (
        "M. R. Albrecht, J. Massimo, K. G. Paterson, J. Somorovsky. Prime and prejudice: primality testing under "
        "adversarial conditions. ACM Conference on Computer and Communications Security, 2018, 281-298"
    ),
    "ward-1948": "M. Ward. Memoir on elliptic divisibility sequences. Amer. J. Math. 70 (1948), 31-74",
    "fassbender-1999": (
        "H. Fassbender, D. S. Mackey, N. Mackey, H. Xu. Hamiltonian square roots of skew-Hamiltonian matrices. "
        "Linear Algebra Appl. 287 (1999), 125-159"
    ),
    "henon-heiles-1964": (
        "M. Henon, C. Heiles. The applicability of the third integral of motion: some numerical experiments. "
        "Astron. J. 69 (1964), 73-79"
    ),
    "lorenz-1963": "E. N. Lorenz. Deterministic nonperiodic flow. J. Atmos. Sci. 20 (1963), 130-141",
    "rosser-schoenfeld-1962": (
        "J. B. Rosser, L. Schoenfeld. Approximate formulas for some functions of prime numbers. "
        "Illinois J. Math. 6 (1962), 64-94"
    ),
    "schwartz-1980": (
        "J. T. Schwartz. Fast probabilistic algorithms for verification of polynomial identities. "
        "J. ACM 27 (1980), 701-717"
    ),
    "shioda-1990": "T. Shioda. On the Mordell-Weil lattices. Comment. Math. Univ. St. Pauli 39 (1990), 211-240",
    "tate-1983": (
        "J. Tate. Variation of the canonical height of a point depending on a parameter. "
        "Amer. J. Math. 105 (1983), 287-294"
    ),
    "kimura-hirota-2000": (
        "K. Kimura, R. Hirota. Discretization of the Lagrange top. J. Phys. Soc. Japan 69 (2000), 3193-3199"
    ),
    "petrera-pfadler-suris-2009": (
        "M. Petrera, A. Pfadler, Yu. B. Suris. On integrability of Hirota-Kimura-type discretizations: experimental "
        "study of the discrete Clebsch system. Exp. Math. 18 (2009), 223-247. arXiv:0808.3345"
    ),
    "petrera-suris-2018": (
        "M. Petrera, Yu. B. Suris. New results on integrability of the Kahan-Hirota-Kimura discretizations. In: "
        "Nonlinear Systems and Their Remarkable Mathematical Structures, CRC Press, 2018. arXiv:1805.12490"
    ),
    "itoh-1987": (
        "Y. Itoh. Integrals of a Lotka-Volterra system of odd number of variables. Progr. Theoret. Phys. 78 (1987), "
        "507-510"
    ),
    "bogoyavlenskij-1988": (
        "O. I. Bogoyavlensky. Integrable discretizations of the KdV equation. Phys. Lett. A 134 (1988), 34-38"
    ),
    "damianou-2017": (
        "P. A. Damianou, C. A. Evripidou, P. Kassotakis, P. Vanhaecke. Integrable reductions of the "
        "Bogoyavlenskij-Itoh Lotka-Volterra systems. J. Math. Phys. 58 (2017), 032704"
    ),
    "kouloukas-quispel-vanhaecke-2016": (
        "T. E. Kouloukas, G. R. W. Quispel, P. Vanhaecke. Liouville integrability and superintegrability of a "
        "generalized Lotka-Volterra system and its Kahan discretization. J. Phys. A 49 (2016), 225201. arXiv:1601.05006"
    ),
    "laska-1982": (
        "M. Laska. An algorithm for finding a minimal Weierstrass equation for an elliptic curve. Math. Comp. 38 "
        "(1982), 257-260"
    ),
    "kraus-1989": (
        "A. Kraus. Quelques remarques a propos des invariants c4, c6 et Delta d'une courbe elliptique. Acta Arith. 54 "
        "(1989), 75-80"
    ),
    "mazur-1977": ("B. Mazur. Modular curves and the Eisenstein ideal. Publ. Math. IHES 47 (1977), 33-186."),
    "zander-2021": (
        "R. Zander. On the singularity structure of Kahan discretizations of a class of quadratic vector fields. "
        "Eur. J. Math. 7 (2021), 1046-1073. arXiv:2003.01659"
    ),
    "petrera-suris-zander-2020": (
        "M. Petrera, Yu. B. Suris, R. Zander. How one can repair non-integrable Kahan discretizations. "
        "J. Phys. A 53 (2020), 37LT01. arXiv:2003.12596"
    ),
    "schmalian-suris-tumarkin-2021": (
        "M. Schmalian, Yu. B. Suris, Yu. Tumarkin. How one can repair non-integrable Kahan discretizations. II. A "
        "planar system with invariant curves of degree 6. Math. Phys. Anal. Geom. 24 (2021), 40. arXiv:2106.14301"
    ),
    "bellon-viallet-1999": "M. P. Bellon, C.-M. Viallet. Algebraic entropy. Comm. Math. Phys. 204 (1999), 425-437",
    "boucksom-favre-jonsson-2008": (
        "S. Boucksom, C. Favre, M. Jonsson. Degree growth of meromorphic surface maps. "
        "Duke Math. J. 141 (2008), 519-538"
    ),
    "cantat-lamy-2013": (
        "S. Cantat, S. Lamy. Normal subgroups in the Cremona group. With an appendix by Y. de Cornulier. "
        "Acta Math. 210 (2013), 31-94"
    ),
    "hasselblatt-propp-2007": (
        "B. Hasselblatt, J. Propp. Degree-growth of monomial maps. "
        "Ergodic Theory Dynam. Systems 27 (2007), 1375-1397. arXiv:math/0604521"
    ),
    "diller-favre-2001": (
        "J. Diller, C. Favre. Dynamics of bimeromorphic maps of surfaces. Amer. J. Math. 123 (2001), 1135-1169"
    ),
    "mumford-1970": "D. Mumford. Abelian varieties. Oxford University Press, 1970",
    "hartshorne-1977": "R. Hartshorne. Algebraic geometry. Graduate Texts in Mathematics 52, Springer, 1977",
    "fatou-1906": "P. Fatou. Series trigonometriques et series de Taylor. Acta Math. 30 (1906), 335-400",
    "massey-1969": (
        "J. L. Massey. Shift-register synthesis and BCH decoding. IEEE Trans. Inform. Theory 15 (1969), 122-127"
    ),
    "roberts-vivaldi-2009": (
        "J. A. G. Roberts, F. Vivaldi. A combinatorial model for reversible rational maps over finite fields. "
        "Nonlinearity 22 (2009), 1965-1982"
    ),
    "roberts-jogia-vivaldi-2003": (
        "J. A. G. Roberts, D. Jogia, F. Vivaldi. The Hasse-Weil bound and integrability detection in rational maps. "
        "J. Nonlinear Math. Phys. 10 (2003), suppl. 2, 166-180"
    ),
    "grammaticos-ramani-papageorgiou-1991": (
        "B. Grammaticos, A. Ramani, V. Papageorgiou. Do integrable mappings have the Painleve property? "
        "Phys. Rev. Lett. 67 (1991), 1825-1828"
    ),
    "benettin-1980": (
        "G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn. Lyapunov characteristic exponents for smooth dynamical "
        "systems and for Hamiltonian systems. Meccanica 15 (1980), 9-20"
    ),
    "pereira-2001": (
        "J. V. Pereira. Vector fields, invariant varieties and linear systems. Ann. Inst. Fourier 51 (2001), 1385-1405"
    ),
    "celledoni-2019": (
        "E. Celledoni, C. Evripidou, D. I. McLaren, B. Owren, G. R. W. Quispel, B. K. Tapley, P. H. van der Kamp. "
        "Using discrete Darboux polynomials to detect and determine preserved measures and integrals of rational maps. "
        "J. Phys. A 52 (2019), 31LT01. arXiv:1902.04715"
    ),
}


def source(key: str) -> str:
    """Return the full reference for the key of a citation.

    >>> source("kahan-1993")
    'W. Kahan. Unconventional numerical methods for trajectory calculations. Lecture notes, 1993'
    """
    return SOURCES[key]
