#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Keep the table of methods in a page as a program prints it.

The table stands between the lines `<!-- methods -->` and `<!-- end of methods -->`.

usage: methods_table.py PROGRAM PAGE [--write]     without --write: fail where they differ
"""
import pathlib
import re
import subprocess
import sys

program, name, *options = sys.argv[1:]
page = pathlib.Path(name)
printed = subprocess.run([program], capture_output=True, text=True, check=True).stdout
text = page.read_text()
current, found = re.subn(r"(<!-- methods -->\n).*?(<!-- end of methods -->)",
                         lambda m: m[1] + printed + m[2], text, flags=re.DOTALL)
if "--write" in options and found:
    page.write_text(current)
ok = found == 1 and ("--write" in options or current == text)
if found != 1:
    print(f"{page}: expected one place for the table of methods, found {found}")
elif not ok:
    print(f"{page}: the table of methods is out of date; ninja -C build methods-table writes it")
print(f"{int(ok)} passed, {int(not ok)} failed")
sys.exit(not ok)
