#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Run programs that solve the same problems (README.md) and compare the bits that they print.

usage: compare.py LINES NAME=PROGRAM NAME=PROGRAM ...     LINES: what a complete output has; 0: as many as
the first one's, where steps are chosen by an error estimate
"""
import shlex
import subprocess
import sys

LINES = int(sys.argv[1])

passed = failed = 0


def check(ok, what):
    global passed, failed
    passed, failed = passed + ok, failed + (not ok)
    if not ok:
        print("FAIL", what)


outputs = {}
for argument in sys.argv[2:]:
    name, _, program = argument.partition("=")
    run = subprocess.run(shlex.split(program), capture_output=True, text=True)
    check(run.returncode == 0, f"{name} ends with {run.returncode}: {run.stderr}")
    outputs[name] = run.stdout.splitlines()
    LINES = LINES or len(outputs[name])
    check(len(outputs[name]) == LINES > 20, f"{name} prints {len(outputs[name])} lines, not {LINES}")

first, *others = outputs
for other in others:
    for number, (line, expected) in enumerate(zip(outputs[other], outputs[first]), 1):
        check(line == expected, f"line {number}\n  {first:<8} {expected}\n  {other:<8} {line}")
print(f"{', '.join(outputs)}: {LINES} points each")
print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0 or not others)
