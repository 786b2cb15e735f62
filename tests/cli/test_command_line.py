"""What holds for every command: an environment variable for each option, an example, a quick help, the version."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest
from shift_cli.entry import WITHOUT_VARIABLE, command_line, commands
from shift_cli.main import app
from shift_simulator.options import LEARNER_NAMES

COMMANDS = dict(commands(command_line(app)))
HEAVY = {"numpy", "matplotlib", "zenoh", "httpx", "mcap", "fastapi", "sqlite3", "shift_learner", "shift_recorder"}


def said(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "shift_cli.main", *words]
    env = {**os.environ, "COLUMNS": "200", **environment}
    return subprocess.run(line, capture_output=True, text=True, timeout=60, env=env, check=False)


def options(command: Any) -> Iterator[tuple[str, Any]]:
    for option in command.params:
        flags = [name for name in option.opts if name.startswith("--")]
        if flags and flags[0] not in WITHOUT_VARIABLE:
            yield flags[0], option


def test_the_commands_are_those_that_the_interface_names() -> None:
    names = {" ".join(path) for path in COMMANDS}
    assert names >= {
        *("up", "router", "doctor", "simulate", "verify", "info", "replay", "ros2", "gaze play"),
        *("evaluate table2", "evaluate users", "evaluate learners"),
    }


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_each_option_is_an_environment_variable_and_says_what_it_does(path: tuple[str, ...]) -> None:
    for flag, option in options(COMMANDS[path]):
        variable = option.envvar
        assert isinstance(variable, str), flag
        assert re.fullmatch("SHIFT_[A-Z_]+", variable), flag
        assert option.help, flag


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_each_command_has_an_example_that_its_own_options_allow(path: tuple[str, ...]) -> None:
    known = {name for option in COMMANDS[path].params for name in option.opts}
    words = " ".join(("shift-mesh", *path))
    examples = [line for line in COMMANDS[path].help.splitlines() if re.match(rf"(SHIFT_\w+=\S+ )?{words}( |$)", line)]
    assert examples, f"write one: {words}"
    for example in examples:
        given = shlex.split(example.partition(" | ")[0].partition(" --ros-args")[0], comments=True)
        assert {word for word in given if word.startswith("--")} <= known, example


def test_a_variable_that_no_command_names_for_itself_works() -> None:
    done = said("doctor", SHIFT_JSON="true", SHIFT_URL="http://127.0.0.1:9", SHIFT_ZENOH="tcp/127.0.0.1:9")
    assert done.stdout.startswith("{"), done.stdout
    assert "SHIFT_JSON" in said("doctor", "--help").stdout


@pytest.mark.parametrize("path", [(), *COMMANDS], ids=" ".join)
def test_help_imports_nothing_heavy(path: tuple[str, ...]) -> None:
    code = (
        "import sys\nfrom shift_cli.entry import outcome\nfrom shift_cli.main import app\n"
        f"code = outcome(app, [*{path!r}, '--help'])\n"
        f"print('imported', sorted(set(sys.modules) & {HEAVY!r}), code)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.splitlines()[-1] == "imported [] 0"


def test_the_version_names_python_and_where_known_the_commit() -> None:
    done = said("--version", SHIFT_REVISION="abc123")
    assert done.returncode == 0
    python = ".".join(map(str, sys.version_info[:3]))
    assert re.fullmatch(rf"shift-mesh \d+\.\d+\.\S+ \(Python {re.escape(python)}, git abc123\)\n", done.stdout)


def test_a_checkout_knows_its_own_commit() -> None:
    from shift_cli import version

    if not (version.CHECKOUT / ".git").exists():
        pytest.skip("not a checkout")
    git = ["git", "-C", str(version.CHECKOUT), "rev-parse", "--short=12", "HEAD"]
    head = subprocess.run(git, capture_output=True, text=True, check=True).stdout.strip()
    assert version.revision().removesuffix("-dirty") == head


# --- options with a fixed set of values ---


@pytest.mark.parametrize(
    ("words", "variable", "values"),
    [
        (("simulate", "--learner"), "SHIFT_LEARNER", LEARNER_NAMES),
        (("evaluate", "learners", "--learner"), "SHIFT_LEARNER", LEARNER_NAMES),
        (("evaluate", "learners", "--user"), "SHIFT_USER", ("A", "B", "C", "D")),
        (("simulate", "--user"), "SHIFT_USER", ("A", "B", "C", "D")),
        (("ros2", "--backend"), "SHIFT_BACKEND", ("native", "rclpy")),
    ],
    ids=str,
)
def test_an_option_lists_its_values_and_refuses_others_with_them(
    words: tuple[str, ...], variable: str, values: tuple[str, ...]
) -> None:
    *command, flag = words
    shown = said(*command, "--help").stdout
    for done in (said(*words, "nonsense"), said(*command, **{variable: "nonsense"})):
        assert done.returncode == 2
        assert "Traceback" not in done.stderr
        assert "nonsense" in done.stderr
        for value in values:
            assert value in shown, flag
            assert value in done.stderr, flag


@pytest.mark.parametrize(("given", "meant"), [("scorin", "scoring"), ("Q-Learning", "q-learning"), ("plan", "planner")])
def test_a_learner_that_is_misspelled_is_told_which_was_probably_meant(given: str, meant: str) -> None:
    for done in (said("simulate", "--learner", given), said("evaluate", "learners", SHIFT_LEARNER=given)):
        sentence = " ".join(done.stderr.replace("│", " ").split())  # out of its box
        assert f"did you mean '{meant}'?" in sentence
