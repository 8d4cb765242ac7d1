#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fail where the objects of a static library keep data between calls.

A SAVEd, initialised or module variable is a symbol in a data section.  The compiler's own tables
of types (virtual tables, default initial values) and of `select case` over strings (jumptable) are
the only such data a re-entrant Fortran library has; -fcheck=recursion adds its marks.

usage: check_globals.py NM LIBRARY
"""
import re
import subprocess
import sys

COMPILERS_OWN = re.compile(r"__vtab_|__def_init_|^(?:jumptable|is_recursive|print_warning)\.")
HINTS = {
    "slen.": "gfortran keeps the length of a deferred-length character function's result in static storage, where"
             " it is called: threads would share it; use a subroutine, or a result with a declared length"}

nm, library = sys.argv[1:]
listing = subprocess.run([nm, "-A", library], capture_output=True, text=True, check=True).stdout
symbols = re.findall(r"([^:\n]+):[0-9a-f]+ (\w) (\S+)$", listing, re.MULTILINE)
kept = [(where, name) for where, kind, name in symbols
        if kind in "bBdDcCsSgGuVv" and not COMPILERS_OWN.search(name)]
for where, name in kept:
    print(f"data kept between calls: {name} in {where}")
for start, hint in HINTS.items():
    if any(name.startswith(start) for _, name in kept):
        print(f"{start}N: {hint}")
if not symbols:
    print("no symbols in", library)
ok = bool(symbols) and not kept
print(f"{int(ok)} passed, {int(not ok)} failed")
sys.exit(not ok)
