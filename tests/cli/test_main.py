"""The entry point: whatever happens inside or to the streams, a user sees a sentence and an exit status."""

import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from unittest.mock import Mock

import click
import pytest
from cli_helpers import shell

from kahanmaps.errors import InputError, SingularStep


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (InputError("found 1, expected 2"), 2, "Error: found 1, expected 2"),
        (click.UsageError("found 1, expected 2"), 2, "Error: found 1, expected 2"),
        (OSError(28, "No space left on device", "x.csv"), 3, "Error: No space left on device: x.csv"),
        (OSError(2, "No such file or directory", ""), 2, "Error: No such file or directory: ''"),
        (SingularStep("det(I - eps f'(x)) = 0"), 3, "Error: det(I - eps f'(x)) = 0"),
        (MemoryError(), 3, "out of memory"),
        (OSError(12, "Cannot allocate memory"), 3, "out of memory"),
        (ImportError("libx.so: failed to map segment from shared object", name="numpy"), 3, "out of memory"),
        (ImportError("cannot import name 'nothing'", name="numpy"), 3, "numpy cannot be loaded: cannot import"),
        (ImportError("numpy is half there"), 3, "a library cannot be loaded: numpy is half there; install it again"),
        (ImportError("cannot import name 'nothing'", name="kahanmaps.maps"), 70, "Internal error: ImportError"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (RuntimeError("all wrong"), 70, "Internal error: RuntimeError: all wrong"),
        (RuntimeError(), 70, "This is a bug in kahanmaps. KAHANMAPS_DEBUG=1 shows where it happened."),
        (RecursionError("too deep"), 70, "Internal error: RecursionError"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else None,
)
def test_an_error_becomes_a_message_and_an_exit_status(kahanmaps, monkeypatch, error, status, words):
    monkeypatch.setattr("kahanmaps_cli.commands.version.version_of", Mock(side_effect=error))
    outcome = kahanmaps("version")
    assert outcome.status == status
    assert words in outcome.err
    assert "Traceback" not in outcome.err


def test_an_internal_error_names_the_file_that_was_being_read(kahanmaps, monkeypatch, tmp_path):
    path = tmp_path / "a.toml"
    path.write_text('variables = ["x"]\n[system]\nrhs = ["x"]')
    monkeypatch.setattr("kahanmaps.documents.files.DocumentReader", lambda *_: None)  # has no method `read`
    outcome = kahanmaps("systems", path)
    assert outcome.status == 70
    assert f"Either {path}, which was being read, is damaged, or this is a bug in kahanmaps" in outcome.err


def test_ctrl_c_while_libraries_are_loaded_is_reported_without_a_traceback():
    script = """
import builtins, os, signal, sys
from kahanmaps_cli import __main__
load = builtins.__import__
def pressed(name, *rest):
    if name == "click":
        os.kill(os.getpid(), signal.SIGINT)
    return load(name, *rest)
builtins.__import__ = pressed
sys.argv = ["kahanmaps", "version"]
sys.exit(__main__.main())
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


LOST = """
import os, signal, sys
from kahanmaps_cli import __main__, main

def command(*_, **__):
    try:
        type("A", (), {"f": type("F", (), {"__set_name__": lambda *_: os.kill(os.getpid(), signal.SIGINT)})()})
    except Exception as error:
        print(type(error).__name__, flush=True)
    while True:
        pass

main.cli.main = command
sys.exit(__main__.main())
"""


def test_an_interrupt_that_a_library_loses_is_raised_again():
    done = subprocess.run([sys.executable, "-c", LOST], capture_output=True, text=True, timeout=100, check=False)
    assert (done.returncode, done.stderr) == (130, "interrupted\n")
    # What loses it: since Python 3.12 the error of __set_name__ keeps its class.
    assert done.stdout == ("RuntimeError\n" if sys.version_info < (3, 12) else "")


@pytest.mark.parametrize("megabytes", [100, 250])
def test_lack_of_memory_is_reported_and_never_ends_with_the_status_of_a_refuted_claim(tmp_path, megabytes):
    # OpenBLAS ends the process with 1 where it finds no memory; at 100 MB numpy itself cannot be loaded.
    script = f"ulimit -v {megabytes * 1000}; $KAHANMAPS_PYTHON -m kahanmaps_cli orbit"
    outcome = shell(f"{script} harmonic --start 1,2 --eps 1/10 --steps 1 --arithmetic float", tmp_path)
    assert outcome.status == 3
    assert outcome.err.startswith("Error: out of memory (not enough memory to load numpy)")


def test_nothing_in_a_message_can_steer_a_terminal(kahanmaps):
    outcome = kahanmaps("systems", Path("\x1b[31mred\x07.toml"))
    assert outcome.status == 2
    assert r"\x1b[31mred\x07.toml" in outcome.err
    assert outcome.err.replace("\n", "").isprintable()


def test_a_reader_that_has_seen_enough_changes_no_verdict(tmp_path):
    # More claims than a pipe can hold, so that the reader is gone before the end.
    claims = "".join(f'I{k} = "x + {k}"\n' for k in range(200))
    (tmp_path / "a.toml").write_text(f'variables = ["x"]\n[system]\nrhs = ["x"]\n[integrals]\n{claims}')
    script = 'kahanmaps check-integrals a.toml --json | head -c 10; echo "${PIPESTATUS[0]}"'
    outcome = shell(script, tmp_path)
    assert outcome.out[10:] == "1\n"
    assert outcome.err == ""


READY = "import os, sys; from kahanmaps_cli import __main__; os.write(2, b'ready\\n'); sys.exit(__main__.main())"


@pytest.mark.parametrize(
    ("words", "number"),
    [
        ("plot portrait lotka_volterra --eps 1/20 --steps 200000 -o FOLDER/o.svg", signal.SIGINT),
        ("report paper_m3 -o FOLDER/o.html", signal.SIGTERM),
        *(
            pytest.param(words, number, marks=pytest.mark.slow)
            for number in (signal.SIGINT, signal.SIGTERM)
            for words in [
                "cycles paper_m3_irreducible --prime 11",
                "find-integrals kirchhoff_case",
                "find-density so4_euler_manakov",
                "degrees zhukovski_volterra_2 --terms 100 --effort 5",
                "singularities paper_m2 --steps 10000",
                "scan lotka_volterra --over a,b,c,d",
                "heights henon_heiles --effort 5 --max-digits 1000000",
                "lyapunov lorenz --random 3 --box 5 --eps 1/400 --steps 100000000",
                "verify --m 4",
            ]
        ),
    ],
    ids=lambda value: value.split()[0] if isinstance(value, str) else value.name,
)
def test_a_signal_at_any_moment_ends_a_command_with_130_and_a_word(number, words, tmp_path):
    line = [sys.executable, "-c", READY, *words.replace("FOLDER", str(tmp_path)).split()]
    for delay in (0.2, 1.0):
        with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            try:
                assert process.stderr.readline() == "ready\n"  # before it Python itself tells of Ctrl-C
                time.sleep(delay)
                process.send_signal(number)
                _, err = process.communicate(timeout=100)  # much less on a quiet machine
            finally:
                process.kill()
        assert (process.returncode, "interrupted" in err, "Traceback" in err) == (130, True, False)
        assert list(tmp_path.iterdir()) == []


def test_output_to_a_closed_stream_is_an_error():
    outcome = shell("exec $KAHANMAPS_PYTHON -m kahanmaps_cli version >&-", Path())
    assert (outcome.status, outcome.out) == (3, "")
    assert "standard output is closed" in outcome.err


IN_FLINT = """
import os
from flint import fmpz
from kahanmaps_cli.signals import interruptible
with interruptible(lambda: os.write(1, b"asked to end\\n")):  # print may be in the middle of the line below
    print("ready", flush=True)
    fmpz.fac_ui(10_000_000)  # ten seconds and more in one call
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_signals_in_a_row_end_a_call_of_flint_that_holds_them_back(number):
    with subprocess.Popen([sys.executable, "-c", IN_FLINT], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        for _ in range(10):  # the first one may have come before the call
            process.send_signal(number)
            with suppress(subprocess.TimeoutExpired):
                process.wait(0.2)
                break
        else:
            process.kill()
        assert process.returncode == -number  # which shells call 130, or 143
        assert process.stdout.read() in ("", "asked to end\n")
