"""The part of a certificate for Coq about positive entropy, with polynomials as lists of terms, and one axiom.

The axiom is the theorem of docs/mathematics.md, section "Positive entropy, proved in the plane", with the estimates of
`entropy`: the degree of the n-th iterate is bounded above by forms, that of the 2n-th iterate below by the image of a
line modulo a prime, which Coq computes. The script proves the hypotheses; the conclusion is about degrees of iterates.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count, islice, product
from typing import Any

from flint import fmpq_mpoly, fmpz

from kahanmaps.certificates.entropy import EPS, LINE, PositiveEntropy, image_degree
from kahanmaps.errors import InputError

_MAX_PRIMES = 20  # primes from 1009 on that are tried

LIBRARY = """\
Require Import ZArith Znumtheory List.
Import ListNotations.
Open Scope R_scope.

(* Polynomials over Z in x, y, h and eps: lists of terms c x^i y^j h^k eps^l. *)
Inductive term := T (c : Z) (i j k l : nat).
Definition form := list term.
Definition eval (P : form) (x y h e : R) : R :=
  fold_right (fun t s => match t with T c i j k l => IZR c * x ^ i * y ^ j * h ^ k * e ^ l + s end) 0 P.
Definition nonzero (P : form) : Prop := exists x y h e, eval P x y h e <> 0.
Definition degree (P : form) : nat :=
  fold_right (fun t m => match t with T _ i j k _ => Nat.max (i + j + k) m end) 0%nat P.
Definition all_of_degree (d : nat) (P : form) : bool :=
  forallb (fun t => match t with T _ i j k _ => Nat.eqb (i + j + k) d end) P.

(* Maps of the plane, in homogeneous coordinates. *)
Inductive triple := Triple (F1 F2 F3 : form).
Definition degree3 (F : triple) : nat :=
  match F with Triple F1 F2 F3 => Nat.max (degree F1) (Nat.max (degree F2) (degree F3)) end.
Definition homogeneous (F : triple) : bool :=
  match F with Triple F1 F2 F3 => forallb (all_of_degree (degree3 F)) [F1; F2; F3] end.
(* F(G) = c H *)
Definition composed (F G : triple) (c : form) (H : triple) : Prop :=
  match F, G, H with Triple F1 F2 F3, Triple G1 G2 G3, Triple H1 H2 H3 => forall x y h e,
    let at_G P := eval P (eval G1 x y h e) (eval G2 x y h e) (eval G3 x y h e) e in
    at_G F1 = eval c x y h e * eval H1 x y h e /\\ at_G F2 = eval c x y h e * eval H2 x y h e /\\
    at_G F3 = eval c x y h e * eval H3 x y h e
  end.
Definition point : triple := Triple [T 1 1 0 0 0] [T 1 0 1 0 0] [T 1 0 0 1 0].
(* G is the n-th iterate of F, perhaps with a common factor. *)
Inductive iterate (F : triple) : nat -> triple -> Prop :=
  | once : iterate F 1 F
  | again n G c H : iterate F n G -> nonzero c -> composed F G c H -> iterate F (S n) H.

(* Polynomials in t modulo p, lowest coefficient first; highest first where they are divided. *)
Section Modular.
Variable p : Z.
Fixpoint add (a b : list Z) : list Z :=
  match a, b with [], _ => b | _, [] => a | x :: a, y :: b => ((x + y) mod p)%Z :: add a b end.
Definition times (c : Z) (a : list Z) : list Z := map (fun x => (c * x) mod p)%Z a.
Fixpoint mul (a b : list Z) : list Z := match a with [] => [] | x :: a => add (times x b) (0%Z :: mul a b) end.
Fixpoint to_the (a : list Z) (n : nat) : list Z := match n with O => [1%Z] | S n => mul a (to_the a n) end.
Definition value (P : form) (e : Z) (X Y W : list Z) : list Z :=
  fold_right (fun t s => match t with T c i j k l =>
    add (times (c * e ^ Z.of_nat l) (mul (to_the X i) (mul (to_the Y j) (to_the W k)))) s end) [] P.
Fixpoint strip (a : list Z) : list Z := match a with Z0 :: a => strip a | _ => a end.
Fixpoint power (x : Z) (n : positive) : Z :=
  match n with
  | xH => x
  | xO n => let y := power x n in ((y * y) mod p)%Z
  | xI n => let y := power x n in ((x * (y * y)) mod p)%Z
  end.
Definition monic (a : list Z) : list Z :=
  match strip a with [] => [] | x :: a => 1%Z :: times (power (x mod p) (Z.to_pos (p - 2))) a end.
Fixpoint minus (a b : list Z) : list Z :=
  match a, b with x :: a, y :: b => ((x - y) mod p)%Z :: minus a b | _, _ => a end.
(* Quotient and remainder, n steps, by the monic polynomial with the further coefficients b. *)
Fixpoint divide (n : nat) (a b : list Z) : list Z * list Z :=
  match n, a with S n, x :: a => let (q, r) := divide n (minus a (times x b)) b in (x :: q, r) | _, _ => ([], a) end.
Fixpoint common (n : nat) (a b : list Z) : list Z :=
  match n, monic b with
  | S n, y :: b => common n (y :: b) (strip (snd (divide (length a - length b) a b)))
  | _, _ => monic a
  end.
Definition gcd (a b : list Z) : list Z := common (length a + length b) a b.
(* The degree of the image of a curve under some steps of F at eps = e, without its common factors. *)
Fixpoint image_degree (F : triple) (e : Z) (steps : nat) (X Y W : list Z) : option nat :=
  match steps, F with
  | O, _ => Some (Nat.max (length X) (Nat.max (length Y) (length W)) - 1)%nat
  | S steps, Triple F1 F2 F3 =>
    let high P := strip (rev (value P e X Y W)) in
    match gcd (gcd (high F1) (high F2)) (high F3) with
    | [] => None
    | _ :: g => let less P := rev (fst (divide (length (high P) - length g) (high P) g)) in
      image_degree F e steps (less F1) (less F2) (less F3)
    end
  end.
End Modular.

Lemma is_prime (p : Z) : (1 < p)%Z ->
  forallb (fun n => Z.eqb (Z.gcd (Z.of_nat n) p) 1) (seq 1 (Z.to_nat p - 1)) = true -> prime p.
Proof.
  intros H1 H. apply prime_intro; [exact H1 |]. intros n [Hn Hp]. apply Zgcd_1_rel_prime.
  rewrite forallb_forall in H. specialize (H (Z.to_nat n)). rewrite Z2Nat.id in H; [| now apply Z.le_trans with 1%Z].
  apply Z.eqb_eq, H, in_seq. split; [now apply (Z2Nat.inj_le 1); [| apply Z.le_trans with 1%Z |] |].
  replace (1 + (Z.to_nat p - 1))%nat with (Z.to_nat p).
  - apply Z2Nat.inj_lt; [now apply Z.le_trans with 1%Z | | exact Hp].
    apply Z.lt_le_incl, Z.lt_trans with 1%Z; [reflexivity | exact H1].
  - symmetry. rewrite Nat.add_comm. apply Nat.sub_add. change 1%nat with (Z.to_nat 1). apply Z2Nat.inj_le;
      [discriminate | apply Z.lt_le_incl, Z.lt_trans with 1%Z; [reflexivity | exact H1] | now apply Z.lt_le_incl].
Qed.

(* The theorem that is assumed. f is birational over Q(eps), with the inverse B; D_n, the degree of f^n, is at most that
   of G, and D_2n is at least d, the degree of the image of a line (a1 + b1 t : a2 + b2 t : a3 + b3 t) modulo p. The
   dynamical degree lambda of f has 2 cosh(n log lambda) + 2 >= (D_2n - 1)/(D_n - 1), and is the infimum of D_k^(1/k).
   Here it is more than P/Q > 1: the entropy of f is positive. *)
Axiom degrees_grow_exponentially : forall (F B G : triple) (g : form) (n d : nat) (p e P Q a1 b1 a2 b2 a3 b3 : Z),
  homogeneous F = true -> nonzero g -> composed B F g point -> iterate F n G ->
  prime p -> image_degree p F e (2 * n) [a1; b1] [a2; b2] [a3; b3] = Some d ->
  (0 < Q < P)%Z -> ((P ^ Z.of_nat n + Q ^ Z.of_nat n) ^ 2 * (Z.of_nat (degree3 G) - 1) <
    (Z.of_nat d - 1) * (P ^ Z.of_nat n * Q ^ Z.of_nat n))%Z ->
  forall (k : nat) (H : triple), iterate F k H -> (IZR P / IZR Q) ^ k <= INR (degree3 H).
"""


def entropy_proof(script: Any, claim: PositiveEntropy, theorem: str) -> Iterator[str]:
    """Yield the lines that prove the hypotheses of the axiom; `script` is the script about the map."""
    n = len(claim.forms)
    # Coq proves by trial that a number is prime: take a small one for which the image of the line has this degree.
    for prime in islice((p for p in count(1009, 2) if fmpz(p).is_prime()), _MAX_PRIMES):
        if image_degree(claim.forms[0], 2 * n, prime) == claim.line_degree:
            break
    else:
        raise InputError("the image of the line has a smaller degree modulo small primes: ask for --for gp")
    x, y, eps = (script.letters[name] for name in (*script.data.variables, script.data.names[-1]))
    for k, (triple, factor) in enumerate(zip(claim.forms, claim.factors, strict=True), 1):
        yield from (f"Definition F{k}_{i} : form := {_form_text(P)}." for i, P in enumerate(triple, 1))
        yield f"Definition F{k} : triple := Triple F{k}_1 F{k}_2 F{k}_3."
        yield f"Definition c{k} : form := {_form_text(factor)}."
        yield from _nonzero_lemma(f"c{k}", factor)
    gens = claim.forms[0][0].context().gens()
    B_at_F1 = claim.inverse[2].compose(*claim.forms[0][:2], *gens[2:-1], claim.forms[0][2], ctx=gens[0].context())
    g, remainder = divmod(B_at_F1, gens[-1])
    if remainder:
        raise InputError("the inverse is another map: no certificate is written")
    yield f"Definition B : triple := Triple {' '.join(f'({_form_text(P)})' for P in claim.inverse)}."
    yield f"Definition g : form := {_form_text(g)}."
    yield from _nonzero_lemma("g", g)
    forms = " ".join(f"F{k}_{i}" for k in range(1, n + 1) for i in (1, 2, 3))
    unfold = f"cbv beta iota zeta delta [{forms} {' '.join(f'F{k} c{k}' for k in range(1, n + 1))} eval fold_right"
    compose = f"{unfold} B g point composed]; intros; split; [| split]; ring."
    coordinates = [f"eval c1 {x} {y} 1 {eps} * eval F1_{i} {x} {y} 1 {eps}" for i in (1, 2, 3)]
    images = [*(f"det * {name}" for name in script.ys), "det"]
    equations = " /\\ ".join(f"{a} = {b}" for a, b in zip(coordinates, images, strict=True))
    yield f"Theorem {theorem}_coordinates : {equations}."
    yield f"Proof. rewrite cramer1, cramer2, det_value. {unfold} n1 n2 d]. split; [| split]; ring. Qed."
    yield f"Lemma inverse : composed B F1 g point. Proof. {compose} Qed."
    yield "Definition F1_iterate : iterate F1 1 F1 := once F1."
    for k in range(2, n + 1):
        yield f"Lemma F{k}_composed : composed F1 F{k - 1} c{k} F{k}. Proof. {compose} Qed."
        proof = f"again F1 {k - 1} F{k - 1} c{k} F{k} F{k - 1}_iterate c{k}_nonzero F{k}_composed"
        yield f"Definition F{k}_iterate : iterate F1 {k} F{k} := {proof}."
    line = " ".join(f"[{a}; {b}]%Z" for a, b in LINE)
    yield f"Lemma {theorem}_prime : prime {prime}. Proof. apply is_prime; [reflexivity | vm_compute; reflexivity]. Qed."
    yield f"Lemma line : image_degree {prime} F1 {EPS % prime} (2 * {n}) {line} = Some {claim.line_degree}%nat."
    yield "Proof. vm_compute. reflexivity. Qed."
    lower_bound = claim.lower
    yield f"(* Degrees of the iterates: the dynamical degree is more than {lower_bound} > 1. *)"
    yield f"Theorem {theorem} : forall (k : nat) (H : triple), iterate F1 k H ->"
    yield f"  ({lower_bound.numerator} / {lower_bound.denominator}) ^ k <= INR (degree3 H)."
    arguments = (
        f"F1 B F{n} g {n} {claim.line_degree} {prime} {EPS % prime} {lower_bound.numerator} {lower_bound.denominator}"
    )
    arguments += "".join(f" {a} {b}" for a, b in LINE)
    yield f"Proof. apply (degrees_grow_exponentially {arguments}); [reflexivity | exact g_nonzero | exact inverse |"
    yield f"  exact F{n}_iterate | exact {theorem}_prime | exact line | split; reflexivity | vm_compute; reflexivity]."
    yield "Qed."


def _form_text(polynomial: fmpq_mpoly) -> str:
    """Return a polynomial in x, y, eps and the homogenizing variable h as a list of terms."""
    terms = [(int(c.p), tuple(map(int, e))) for e, c in polynomial.terms()]
    return f"[{'; '.join(f'T ({c}) {e[0]} {e[1]} {e[-1]} {e[-2]}' for c, e in terms)}]"


def _nonzero_lemma(name: str, polynomial: fmpq_mpoly) -> Iterator[str]:
    """Yield the lines of the lemma that a polynomial is not 0: its value at a point with small coordinates is not."""
    for x, y, h, e in product(range(1, polynomial.total_degree() + 2), repeat=4):
        if value := polynomial(x, y, e, h):
            yield f"Lemma {name}_nonzero : nonzero {name}. Proof. exists {x}, {y}, {h}, {e}."
            yield f"  replace (eval {name} {x} {y} {h} {e}) with ({value}) by (cbv [{name} eval fold_right]; ring)."
            yield "  apply not_0_IZR; discriminate. Qed."
            return
