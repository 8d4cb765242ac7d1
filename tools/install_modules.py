#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Install the compiler's module files, which meson leaves behind.

usage (by meson): install_modules.py FOLDER_WITH_MODULES TARGET_BELOW_THE_PREFIX
"""
import os
import pathlib
import shutil
import sys

source, target = sys.argv[1:]
target = pathlib.Path(os.environ["MESON_INSTALL_DESTDIR_PREFIX"], target)
target.mkdir(parents=True, exist_ok=True)
for module in sorted(pathlib.Path(source).glob("*.*mod")):      # .mod and .smod
    shutil.copy(module, target)
