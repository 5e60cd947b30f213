"""A file that cannot be used gives one sentence with file, line and remedy, and exit status 2."""

import re
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import impactjax as ij
from bad_files import GOOD, RECORDINGS, SIDECARS, Bad, beside, rows
from impactjax._cli.main import app
from tiers import quick

pytestmark = quick

CASES = {**RECORDINGS, **{f"sidecar, {name}": bad for name, bad in SIDECARS.items()}}
IN_THE_COMMAND = ("oscillator", "parameter", "start", "law", "impossible")
BY_THE_READER = {
    name: bad
    for name, bad in CASES.items()
    if not (name.startswith("sidecar") and any(word in name for word in IN_THE_COMMAND))
}


def assert_one_sentence(message: str, says: tuple[str, ...]):
    position = 0
    for words in says:
        assert words in message[position:], (words, message)
        position = message.index(words, position)
    assert message.isprintable()
    assert re.fullmatch(r"[^;]+(, line \d+)?: .+; .+\.", message)
    assert len(message) < 600


@pytest.mark.parametrize("name", BY_THE_READER)
def test_reader_error_messages(name, tmp_path):
    bad = CASES[name]
    with pytest.raises(ij.io.FileError) as caught:
        ij.io.read_recording(bad.write(tmp_path))
    assert str(tmp_path) in str(caught.value)
    assert_one_sentence(str(caught.value), bad.says)


@pytest.mark.parametrize("name", CASES)
def test_command_shows_reader_error_messages(name, tmp_path):
    bad = CASES[name]
    run = CliRunner().invoke(app, ["fit", str(bad.write(tmp_path)), "--out", str(tmp_path / "out")])
    assert run.exit_code == 2
    assert run.stdout == ""
    (line,) = run.stderr.splitlines()
    assert_one_sentence(line.removeprefix("impactjax: "), bad.says)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["missing.csv"], ("missing.csv", "No such file", "check the name")),
        (["good.csv", "--sidecar", "missing.toml"], ("missing.toml", "No such file", "check")),
        (["good.csv", "--sidecar", "."], ("Is a directory", "check")),
        (["good.csv", "--law", "kelvin"], ("`kelvin`", "kelvin-voigt")),
        (["good.csv", "--system", "ball"], ("`ball`", "bouncing-ball")),
        (["good.csv", "--system", "bouncing-ball"], ("angle does not suit", "pendulum")),
        (["good.csv", "--out", "good.csv"], ("good.csv", "folder")),
        (["good.csv", "--out", "good.csv/below"], ("good.csv/below", "folder")),
        (["good.csv", "--out", "full"], ("fit.json exists", "--force")),
        (["good.csv", "--law", "none"], ("too few",)),
        (["missing [/b].csv"], ("missing [/b].csv", "check the name")),
    ],
)
def test_command_refuses_impossible_arguments(arguments, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.csv").write_bytes(GOOD)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "fit.json").write_text("mine")
    run = CliRunner().invoke(app, ["fit", *arguments])
    assert run.exit_code == 2
    assert run.stdout == ""
    (line,) = run.stderr.splitlines()
    for words in says:
        assert words in line
    assert (tmp_path / "full" / "fit.json").read_text() == "mine"


def test_process_shows_no_traceback(tmp_path):
    path = RECORDINGS["word in a cell"].write(tmp_path)
    command = [sys.executable, "-W", "error", "-m", "impactjax", "fit", str(path)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert run.stdout == ""
    expected = f"impactjax: {path}, line 3: `oops` is not a number; correct or delete the row.\n"
    assert run.stderr == expected


CELLS = st.one_of(
    st.floats().map(repr),
    st.integers().map(str),
    st.text(max_size=8),
    st.sampled_from(["", '"', "time [s]", "angle [deg]", "impact time [ms]", "-", "1e5"]),
)
LINES = st.lists(st.lists(CELLS, max_size=3).map(", ".join), max_size=5)


@settings(max_examples=300, deadline=None)
@given(
    content=st.one_of(
        st.binary(max_size=60),
        LINES.map(lambda x: rows(*x)),
        LINES.map(lambda x: "\n".join(x).encode("utf-8", "surrogatepass")),
    )
)
def test_arbitrary_content_is_read_or_refused(content, tmp_path_factory):
    path = Bad(content, ()).write(tmp_path_factory.mktemp("any"))
    try:
        ij.io.read_recording(path)
    except ij.io.FileError as error:
        assert_one_sentence(str(error), ())


TABLES = st.sampled_from(["read", "fixed", "system", "sensor", "start", "truth", "nothing"])
KEYS = st.sampled_from(
    ["column", "quantity", "unit", "window", "time_column", "laws", "gain", "order", "r", '"a b"']
)
VALUES = st.sampled_from(
    ["0", "-1", "1.5", "nan", "true", '"angle"', '"deg"', "[1, 2]", "{a = 1}", "2020-01-01", "~"]
)


def toml(tables: dict[str, dict[str, str]]) -> str:
    lines = [
        [f"[{name}]", *(f"{key} = {value}" for key, value in table.items())]
        for name, table in tables.items()
    ]
    return "\n".join(line for table in lines for line in table)


@settings(max_examples=300, deadline=None)
@given(tables=st.dictionaries(TABLES, st.dictionaries(KEYS, VALUES, max_size=3), max_size=3))
def test_arbitrary_sidecar_is_read_or_refused(tables, tmp_path_factory):
    path = beside(toml(tables)).write(tmp_path_factory.mktemp("any"))
    try:
        ij.io.read_recording(path)
    except ij.io.FileError as error:
        assert_one_sentence(str(error), ())
