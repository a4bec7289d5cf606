"""Proofs as scripts that other programs check: Coq (Rocq), PARI/GP and SymPy."""
