"""The last guard of the command line: one line, exit code 4, the traceback in a log; and other ends of a command."""

from __future__ import annotations

import logging
import re
import shlex
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import pytest
import typer

from fragfield import errors
from fragfield.cli.guard import guarded
from fragfield.errors import EXIT_FAULT, exit_code_of, message_of
from fragfield.pipeline import chain as pipeline
from fragfield.terminal.logs import hidden_in, logged, visible
from tests.fragfield.short_run import SHORT, command, environment, invoke, python


def _broken(*arguments, **options):
    message = "the third\nlaw"
    raise IndexError(message)


def test_a_fault_outside_of_a_run_has_a_log_of_its_own(tmp_path, monkeypatch):
    (tmp_path / "mine.toml").write_text(SHORT)
    monkeypatch.setattr("fragfield.checking.check.check_report", _broken)
    done = invoke("check", tmp_path / "mine.toml")
    assert done.exit_code == EXIT_FAULT == 4
    assert len(done.stderr.splitlines()) == 1
    found = re.fullmatch(
        r"fragfield: fault of the program: IndexError: the third law; please report it with (\S+)\n", done.stderr
    )
    log = Path(found[1])
    assert "Traceback" in log.read_text()
    assert "_broken" in log.read_text()
    assert log.stat().st_mode & 0o777 == 0o600
    log.unlink()


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (IndexError("the third law"), "fragfield: rank 3: fault of the program: IndexError: the third law; "),
        (errors.InputError("mine.toml: no such case file"), ""),  # which the first rank reports
    ],
)
def test_a_fault_of_another_rank_is_reported(error, words, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # where its log goes
    monkeypatch.setenv("OMPI_COMM_WORLD_RANK", "3")
    with pytest.raises(typer.Exit) as ended, guarded(json=False, quiet=True):
        raise error
    assert ended.value.exit_code == exit_code_of(error)
    said = capsys.readouterr().err
    assert said.startswith(words)
    assert bool(said) == bool(words)


def test_a_fault_of_a_run_is_in_its_log(tmp_path, monkeypatch):
    (tmp_path / "mine.toml").write_text(SHORT)
    monkeypatch.setattr(pipeline, "perform", _broken)
    done = invoke("run", tmp_path / "mine.toml", "--out", tmp_path / "run", "--json")
    assert done.exit_code == 4
    assert f"please report it with {tmp_path / 'run' / 'run.log'}" in done.stderr
    assert '"exit_code": 4' in done.stdout
    log = (tmp_path / "run" / "run.log").read_text()
    assert "Traceback" in log
    assert "IndexError" in log


def _shell(line, *arguments, **variables):
    """A command in a shell, `$FF` for the program."""
    known = {**environment(), "FF": shlex.join(command()), **variables}
    return subprocess.run(
        ["bash", "-c", line, "bash", *map(str, arguments)], capture_output=True, text=True, env=known, check=False
    )


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("$FF --version >/dev/full", 2, "fragfield: standard output: No space left on device\n"),
        ("$FF check $1 >/dev/full", 2, "fragfield: standard output: cannot be written: No space left on device\n"),
        ("$FF check none --json >/dev/full", 2, "fragfield: none: no such case file\n"),
        ("$FF check none 2>/dev/full", 2, ""),
        ("$FF check $1 >&-", 0, None),
        ("$FF check $1 <&- >&- 2>&-", 0, ""),
        # The reader of the pipe has ended before the program starts: a `| head -1` may end before or after it.
        ("exec 3> >(exec 0<&-); wait $!; $FF check $1 >&3", 2, ""),
        ("LC_ALL=C PYTHONUTF8=0 PYTHONCOERCECLOCALE=0 $FF check $1", 0, None),
    ],
)
def test_standard_streams_that_fail_are_one_message_and_no_traceback(line, code, words, tmp_path):
    (tmp_path / "mine.toml").write_text(SHORT.replace("Steel tube", "Rohr 😀"), encoding="utf-8")
    done = _shell(line, tmp_path / "mine.toml")
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    assert words is None or done.stderr == words


def test_a_closed_standard_stream_gives_its_number_to_no_file(tmp_path):
    """What a library prints would go into the file."""
    script = (
        "import os, sys\n"
        "from fragfield.cli.guard import prepare_process\n"
        "(name,) = prepare_process()\n"
        "file = open(name, 'w')\n"
        "os.write(1, b'of a library'); os.write(2, b'of a library')\n"
        "sys.stdout.write('x'); sys.stderr.write('y')\n"
        "sys.exit(0 if file.fileno() > 2 else 1)\n"
    )
    known = {**environment(), "SCRIPT": script, "PY": sys.executable}
    done = subprocess.run(
        ["bash", "-c", '"$PY" -c "$SCRIPT" "$1" <&- >&- 2>&-', "bash", str(tmp_path / "file")], env=known, check=False
    )
    assert done.returncode == 0
    assert (tmp_path / "file").read_text() == ""


@pytest.mark.parametrize("kind", ["SIGTERM", "SIGINT"])
def test_a_signal_after_the_work_changes_nothing(kind):
    """Python takes its handlers back while it ends: then a signal would end the process with another code."""
    script = (
        "import atexit, os, signal, sys\n"
        "from fragfield.cli import main\n"
        "class Last:\n"
        "    def __del__(self, kill=os.kill, process=os.getpid(), number=signal." + kind + "):\n"
        "        kill(process, number)\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "atexit.register(lambda: signal.raise_signal(signal." + kind + "))\n"
        "sys.last_of_all = Last()\n"
        "sys.argv = ['fragfield', '--version']\n"
        "main()\n"
    )
    done = python(script)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_signal_that_a_library_turns_into_another_error_is_an_interruption(monkeypatch):
    monkeypatch.setattr(errors, "_interrupts", [])
    with pytest.raises(KeyboardInterrupt):
        errors.interrupt(signal.SIGTERM, None)
    assert exit_code_of(ImportError("initialization failed")) == 130
    assert message_of(ImportError("initialization failed")).startswith("interrupted; what was written stays")
    assert exit_code_of(errors.InputError("mine")) == 2


def test_a_signal_while_modules_are_loaded_waits_for_them(tmp_path):
    (tmp_path / "slow.py").write_text(
        "import os, signal, time\nos.kill(os.getpid(), signal.SIGTERM)\ntime.sleep(0.2)\nprint('loaded', flush=True)\n"
    )
    script = (
        "import signal, sys, time\n"
        "from fragfield.errors import interrupt\n"
        "signal.signal(signal.SIGTERM, interrupt)\n"
        f"sys.path.append({str(tmp_path)!r})\n"
        "try:\n"
        "    import slow\n"
        "    time.sleep(5.0)\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted')\n"
    )
    assert python(script).stdout.split() == ["loaded", "interrupted"]


def test_what_libraries_log_is_no_message_of_a_command():
    """Python itself shows it where no handler is; rasterio reports what GDAL says of a broken file so."""
    script = (
        "import logging\n"
        "from fragfield.terminal.logs import to_stderr\n"
        "with to_stderr(quiet=False):\n"
        "    logging.getLogger('rasterio').error('of a library')\n"
        "    logging.getLogger('fragfield.some').warning('of ours')\n"
        "logging.getLogger('rasterio').error('afterwards')\n"
    )
    done = python(script)
    assert done.stderr == "warning: of ours\nafterwards\n"


@pytest.mark.parametrize("kind", ["SIGTERM", "SIGHUP"])
def test_a_signal_within_a_call_back_of_a_library_is_not_lost(kind):
    """Python drops what is raised there, with a traceback: a command that compiled went on after SIGTERM."""
    script = (
        "import ctypes, os, signal, sys, time\n"
        "import fragfield.interface.checking as checking\n"
        "from fragfield.cli import main\n"
        "def work(*arguments, **options):\n"
        "    call = ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), signal." + kind + "))\n"
        "    call()\n"
        "    for _ in range(200):\n"
        "        time.sleep(0.05)\n"
        "checking.case_of = work\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "signal.signal(signal.SIGHUP, signal.SIG_DFL)\n"  # nohup has it ignored
        "sys.argv = ['fragfield', 'check', 'none.toml']\n"
        "main()\n"
    )
    done = python(script)
    assert done.returncode == 130, done.stderr
    assert done.stderr == "fragfield: interrupted; what was written stays, --resume goes on from there\n"


# --- Texts of unknown origin do not control a terminal: neither in messages and tables nor in the log


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain é – 😀\n\tnext", "plain é – 😀\n\tnext"),
        ("\x1b[31mred", "\\x1b[31mred"),
        ("a\x9b2J\x7f\r", "a\\x9b2J\\x7f\\r"),
        ("abc\u202edcb", "abc\\u202edcb"),
        ("no\udcffname", "no\\udcffname"),
    ],
)
def test_control_characters_are_shown_as_python_writes_them(text, shown):
    assert visible(text) == shown
    assert visible({"a": [text, (1, text)], text: None}) == {"a": [shown, (1, shown)], shown: None}
    assert [sign for _, sign in hidden_in({"a": [{"b": text}]})] == ([] if text == shown else [_sign(text)])


def _sign(text):
    return next(f"U+{ord(one):04X}" for one in text if visible(one) != one)


def test_a_file_from_elsewhere_commands_no_terminal(tmp_path):
    path = tmp_path / "theirs.h5"
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "x\x1b]0;title\x07"
        file["a\x1b[2J"] = 1.0
    done = invoke("info", path)
    assert done.exit_code == 0
    assert "\x1b" not in done.stdout
    assert "x\\x1b]0;title\\x07" in done.stdout
    done = invoke("info", tmp_path / "no\x1b[2J\udcff.h5")
    assert done.exit_code == 2
    assert "no\\x1b[2J\\udcff.h5: a name that is not UTF-8" in done.stderr


def test_a_log_holds_no_control_characters(tmp_path):
    with logged(tmp_path / "run.log", fresh=True):
        logging.getLogger("fragfield.some").warning("of %s", "\x1b[31mred")
    assert "of \\x1b[31mred" in (tmp_path / "run.log").read_text()
