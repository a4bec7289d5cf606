"""A question to PARI (cypari): reads the input as JSON, writes the answer and its time. Run by peers.py."""

import json
import sys
import time

from cypari import pari

MOST_RUNS = 200


def code_for(question, entry):
    """The line of GP whose value is the answer."""
    if question == "orbit":
        start, steps = ", ".join(entry["start"]), entry["steps"]
        return f"p = [{start}]~; r = List([p]); for(k = 1, {steps}, p = kahan_map(p, 1/10); listput(r, p)); Vec(r)"
    point = f"[{', '.join(entry['affine'])}]~"
    for k, text in enumerate(entry["integrals"]):
        names = "; ".join(f"my({name} = v[{i + 1}])" for i, name in enumerate(entry["affine"]))
        pari(f"I{k}(v) = {names}; {text}")
    return " && ".join(
        f"I{k}(kahan_map_formula({point}, eps)) == I{k}({point})" for k in range(len(entry["integrals"]))
    )


def main(question):
    """Answer it until a third of a second has passed."""
    entry = json.load(sys.stdin)
    pari.allocatemem(2**30, silent=True)
    for line in entry["pari"].splitlines():
        pari(line)
    code = code_for(question, entry)
    started, count, seconds = time.process_time(), 0, 0.0
    while seconds < 0.3 and count < MOST_RUNS:
        text = str(pari(code))
        count, seconds = count + 1, time.process_time() - started
    print(json.dumps({"text": text, "seconds": seconds / count}))


main(sys.argv[1])
