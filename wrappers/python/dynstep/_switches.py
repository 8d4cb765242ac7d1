# SPDX-License-Identifier: BSD-3-Clause
"""Switches of the right side of a system, and their sides."""

import threading

import numpy as np

from ._arguments import LARGEST_INTEGER, integer


class Switches:
    """Switch functions of a system (None: there are none) and the array where the library writes their sides.

    The sides belong to one run at a time: runs of one system exclude each other.
    """

    def __init__(self, function, number, side):
        self._function = function
        self._lock = self.side = None
        if function is None:
            if number not in (None, 0) or side is not None:
                raise ValueError("n_switches and side go with switches, which are not given")
            return
        if side is None:
            side = np.ones(1 if number is None else integer("n_switches", number, 1, LARGEST_INTEGER), np.int32)
        elif not (isinstance(side, np.ndarray) and side.dtype == np.int32 and side.ndim == 1 and side.size
                  and side.flags.c_contiguous and side.flags.writeable):
            raise TypeError("side must be a vector of int32, such as np.ones(k, np.int32), that can be written to")
        elif number is not None and number != side.size:
            raise ValueError(f"n_switches = {number}, but side has {side.size} places")
        self._lock, self.side = threading.Lock(), side

    def install(self, handle):
        """Give them to a handle."""
        if self._function is not None:
            handle.bind_switches(self._function, self.side, self._lock)
