"""``shift-mesh ros2``: wrong use is said in a sentence, with exit code 2."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--ros-args", "-p", "sesion:=s1"], "'sesion' is not a parameter of the bridge"),
        (["--ros-args", "-r", "shift/gaze:=/a/**"], "name '/a/**'"),
        (["--session", "../s1"], "SHIFT_SESSION"),
        (["--backend", "rclpy"], "needs ROS 2"),
        (["--ros-router", "nonsense", "--session", "s1"], "ros_router nonsense"),
    ],
)
def test_wrong_use_is_a_sentence(words: list[str], said: str) -> None:
    command = [sys.executable, "-m", "shift_cli.main", "ros2", "--zenoh", "tcp/127.0.0.1:9", *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2, done.stderr
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_the_environment_is_below_what_the_line_says() -> None:
    env = {**os.environ, "SHIFT_SESSION": "of-the-environment", "SHIFT_ZENOH": "tcp/127.0.0.1:9"}
    command = [sys.executable, "-m", "shift_cli.main", "ros2", "--ros-router", "tcp/127.0.0.1:9"]
    for words, session in (([], "of-the-environment"), (["--ros-args", "-p", "session:=of-the-line"], "of-the-line")):
        process = subprocess.Popen([*command, *words], env=env, stderr=subprocess.PIPE, text=True)
        assert process.stderr is not None
        started = next(line for line in process.stderr if " started " in line)
        process.terminate()
        process.stderr.read()
        assert process.wait(20) == 0
        assert f"session={session}" in started
