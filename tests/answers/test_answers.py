"""What the commands print for ten systems is what they printed before: a net under every rebuilding.

answers.txt has command lines, which begin with `$ kahanmaps`, each with what it printed below it. The answers are right
as far as the other tests know; here they need only be the same, on any machine. The units of work are left out: they
may be counted better without any other change. After an intended change this writes the file anew, and the commit
shows the difference:

    python tests/answers/test_answers.py
"""

import io
import re
import shlex
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from kahanmaps_cli.main import main

FILE = Path(__file__).with_name("answers.txt")
DRAWN = re.compile(r"modulo [0-9]{12,}(?:, [0-9]{12,})*")  # primes, which are random
WORK = re.compile(r"[0-9.]+ million units")


def sessions(text: str) -> list[tuple[str, str]]:
    """The command lines of a text with what stands below each."""
    parts = re.split(r"^\$ kahanmaps (.*)\n", text, flags=re.MULTILINE)[1:]
    return list(zip(parts[::2], parts[1::2], strict=True))


def printed(command: str) -> str:
    """What a command prints, and its exit status where that is not 0."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        status = main(shlex.split(command))
    text = DRAWN.sub("modulo primes", out.getvalue() + err.getvalue())
    return WORK.sub("million units", text) + f"exit status {status}\n" * (status != 0)


SESSIONS = sessions(FILE.read_text(encoding="utf-8")) if FILE.exists() else []


@pytest.mark.parametrize(("command", "answer"), SESSIONS, ids=[command for command, _ in SESSIONS])
def test_a_command_prints_what_it_printed(command, answer):
    assert printed(command) == answer


def test_a_text_is_taken_apart_into_commands_and_answers():
    assert sessions("about this\n$ kahanmaps a b\none\ntwo\n$ kahanmaps c\n") == [("a b", "one\ntwo\n"), ("c", "")]


if __name__ == "__main__":
    text = FILE.read_text(encoding="utf-8")
    head = text[: text.index("$ kahanmaps")]
    FILE.write_text(
        head + "".join(f"$ kahanmaps {command}\n{printed(command)}" for command, _ in SESSIONS), encoding="utf-8"
    )
    print(f"{len(SESSIONS)} answers written", file=sys.stderr)
