# SPDX-License-Identifier: BSD-3-Clause
"""A bar on stderr: tqdm's where it is installed, else a plain line."""

import sys
import time


class Progress:
    """Shows how many of `expected` steps have been made; None: it is not known how many there will be."""

    def __init__(self, expected):
        self._expected = expected
        self._made = 0
        self._next = 0.0
        try:
            from tqdm import tqdm
        except ImportError:
            self._bar = None
        else:
            self._bar = tqdm(total=expected, unit="step", unit_scale=True, file=sys.stderr)

    def show(self, made):
        if self._bar is not None:
            self._bar.update(made - self._made)
        elif time.monotonic() >= self._next:
            self._next = time.monotonic() + 0.2
            self._line(made)
        self._made = made

    def close(self):
        if self._bar is not None:
            self._bar.close()
        else:
            self._line(self._made)
            print(file=sys.stderr)

    def _line(self, made):
        if self._expected is None:
            shown = f"{made} steps"
        else:
            shown = f"{100*made//max(1, self._expected):3d} % of {self._expected} steps"
        print(f"\r{shown}", end="", file=sys.stderr, flush=True)
