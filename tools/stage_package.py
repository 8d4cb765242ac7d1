#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Put the Python files and the extension into one folder that can be imported.

usage: stage_package.py FOLDER FILE ...
"""
import pathlib
import shutil
import sys

target = pathlib.Path(sys.argv[1])
shutil.rmtree(target, ignore_errors=True)
target.mkdir(parents=True)
for name in sys.argv[2:]:
    shutil.copy(name, target)
