#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Add up what the tests of one or more build folders counted, after `meson test`.

A test program ends with "N passed, N failed", pytest with a summary of its own.  A test without
such a line counts as one; so does one that fails otherwise (crash, time-out, not run).  A suite
whose folder has tests but which did not run is a failure.

usage: count_results.py BUILD[:SUITE,SUITE...] ...        (all suites where none is named)
"""
import json
import pathlib
import re
import sys

SUITES = ("fortran", "f77", "c", "papers", "python", "machine", "docs", "examples")
ROOT = pathlib.Path(__file__).resolve().parent.parent
COUNTED = re.compile(r"\b(\d+) (passed|failed|errors?|skipped)\b")


def counts(output):
    """(passed, failed, skipped) of the last line that counts, or None."""
    for line in reversed(output.splitlines()):
        found = COUNTED.findall(line)
        if found:
            n = {"passed": 0, "failed": 0, "error": 0, "skipped": 0}
            for number, word in found:
                n[word.replace("errors", "error")] += int(number)
            return n["passed"], n["failed"] + n["error"], n["skipped"]
    return None


def judge(test):
    """(passed, failed, skipped) of one entry of meson's log; None means that it never ran."""
    if test is None:
        return 0, 1, 0
    if test["result"] in ("EXPECTEDFAIL", "SKIP"):
        return (1, 0, 0) if test["result"] == "EXPECTEDFAIL" else (0, 0, 1)
    ok = test["result"] == "OK"
    found = counts(test.get("stdout") or "")
    if found is None:
        return (1, 0, 0) if ok else (0, 1, 0)
    passed, failed, skipped = found
    if not ok and failed == 0:
        failed = 1
    return passed, failed, skipped


def has_tests(suite):
    folder = ROOT / "examples" if suite == "examples" else ROOT / "tests" / suite
    kinds = {".f90", ".f", ".c", ".py"}
    return any(path.suffix in kinds for path in folder.rglob("*") if "__pycache__" not in path.parts)


def collect(build, suites):
    """Yield (suite, test, counts)."""
    declared = json.loads((build / "meson-info" / "intro-tests.json").read_text())
    log = build / "meson-logs" / "testlog.json"
    ran = {}
    if log.exists():
        for line in log.read_text().splitlines():
            entry = json.loads(line)
            ran[re.split(" / |:", entry["name"])[-1]] = entry      # "suite - project:test", or "project:suite / test"
    for suite in suites:
        # meson writes a suite as "project:suite"
        tests = [t["name"] for t in declared if any(s.endswith(":" + suite) for s in t["suite"])]
        for name in tests:
            yield suite, name, judge(ran.get(name))
        if not tests and has_tests(suite):
            yield suite, "(whole suite not run)", (0, 1, 0)


def main(arguments):
    passed = failed = 0
    print(f"\n{'build':<14}{'suite':<12}{'passed':>8}{'failed':>8}{'skipped':>9}")
    complaints = []
    for argument in arguments:
        build, _, names = argument.partition(":")
        sums = {}
        for suite, name, (p, f, s) in collect(ROOT / build, names.split(",") if names else SUITES):
            old = sums.get(suite, (0, 0, 0))
            sums[suite] = (old[0] + p, old[1] + f, old[2] + s)
            if f:
                complaints.append(f"{build}: {suite}: {name}: {f} failed")
        for suite, (p, f, s) in sums.items():
            print(f"{build:<14}{suite:<12}{p:>8}{f:>8}{s:>9}")
            passed, failed = passed + p, failed + f
    print(*complaints, sep="\n")
    print(f"{passed} passed, {failed} failed")
    return failed > 0 or passed == 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
