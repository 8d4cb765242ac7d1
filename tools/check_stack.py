#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fail where a shared object asks for an executable stack.

gfortran asks for one where an internal procedure that uses variables of its host is passed as an
argument; newer C libraries refuse to load such an object.

usage: check_stack.py READELF LIBRARY
"""
import re
import subprocess
import sys

readelf, library = sys.argv[1:]
listing = subprocess.run([readelf, "-lW", library], capture_output=True, text=True, check=True).stdout
flags = re.findall(r"GNU_STACK.* ([RWE ]{3}) ", listing)
ok = flags and "E" not in flags[0]
print("flags of the stack:", flags[0] if flags else "none given, so executable")
print(f"{int(bool(ok))} passed, {int(not ok)} failed")
sys.exit(not ok)
