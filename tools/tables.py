#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Keep the tables of the pages as the program `tables` prints them.

A table stands between the lines `<!-- table ARGUMENTS -->` and `<!-- end of table -->` of README.md
or of a page in docs/.

usage: tables.py PROGRAM PROJECT [--write]     without --write: fail where one differs
"""
import pathlib
import re
import subprocess
import sys

PLACE = re.compile(r"(<!-- table ([^\n]*?) -->\n)(.*?)(<!-- end of table -->)", re.DOTALL)

program, root, *options = sys.argv[1:]
passed = failed = 0
for page in [pathlib.Path(root, "README.md"), *sorted(pathlib.Path(root, "docs").rglob("*.md"))]:
    text = page.read_text()
    for start, arguments, table, end in PLACE.findall(text):
        printed = subprocess.run([program, *arguments.split()], capture_output=True, text=True, check=True).stdout
        if printed == table or "--write" in options:
            passed += 1
        else:
            failed += 1
            print(f"{page}: table {arguments} is out of date; ninja -C build tables writes it")
        text = text.replace(start + table + end, start + printed + end)
    if "--write" in options:
        page.write_text(text)
print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0 or passed == 0)
