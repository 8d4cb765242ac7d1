#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""tools/check_docs.py finds the faults that are planted here, and none where there is none.

usage: test_check_docs.py PROJECT
"""
import pathlib
import subprocess
import sys
import tempfile

GOOD = {
    "README.md": "# Title\n\nSee [errors](docs/howto/errors.md#-1-bad), [here](#title), `examples/a.f90`.\n\n"
                 "<!-- from examples/a.f90 -->\n```fortran\nprint *, 1\nend\n```\n",
    "docs/howto/errors.md": "# Errors\n\n## -1 `bad`\n\nText.\n\n## 3 `event`\n\nReserved.\n",
    "examples/a.f90": "! SPDX\nprint *, 1\nend\n",
    "src/core/dynstep_status.f90": "integer, parameter, public :: dynstep_bad = -1\n"
                                   "integer, parameter, public :: dynstep_event = 3\n",
    "src/dynstep.f90": "use dynstep_status, only: dynstep_bad, dynstep_event\n",
    "src/other.f90": "call status%set(dynstep_bad, 'no')\n",
}
FAULTS = {                                 # rule: (file, what is replaced, by what)
    "snippets": ("examples/a.f90", "print *, 1", "print *, 2"),
    "links": ("README.md", "errors.md#-1-bad", "errors.md#-2-bad"),
    "paths": ("README.md", "`examples/a.f90`", "`examples/b.f90`"),
    "codes": ("src/other.f90", "dynstep_bad", "dynstep_event"),
}


def failing_rules(files):
    with tempfile.TemporaryDirectory() as root:
        for name, text in files.items():
            path = pathlib.Path(root, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        output = subprocess.run([sys.executable, CHECK, root], capture_output=True, text=True).stdout
        return {line.split()[1] for line in output.splitlines() if line.startswith("FAIL ")}


CHECK = pathlib.Path(sys.argv[1], "tools/check_docs.py")
failures = [] if failing_rules(GOOD) == set() else ["a fault is found where there is none"]
for rule, (name, old, new) in FAULTS.items():
    if failing_rules({**GOOD, name: GOOD[name].replace(old, new)}) != {rule}:
        failures.append(f"the fault planted for {rule} is not found, or another one is")
print(*failures, f"{1 + len(FAULTS) - len(failures)} passed, {len(failures)} failed", sep="\n")
sys.exit(bool(failures))
