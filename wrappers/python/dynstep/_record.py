# SPDX-License-Identifier: BSD-3-Clause
"""Where the library writes the points of a run: arrays that grow."""

import numpy as np

# Numbers in the first block of each array, 16 MiB: a shorter record is never moved, a longer one doubles
_FIRST_BLOCK = 2**21

_NOTHING = np.empty(0)


class Record:
    """Points of a run of n coordinates, at most `expected` of them."""

    def __init__(self, n, expected):
        self.count = 0
        self._n = n
        self._expected = max(1, expected)
        capacity = min(self._expected, max(2, _FIRST_BLOCK//n))
        try:
            self._t = np.empty(capacity)
            self._qva = [np.empty((capacity, n)) for _ in range(3)]
        except (MemoryError, ValueError):
            raise self._no_memory(capacity) from None

    def room(self):
        """Room for t, q, v, a of the points not yet written, one or more, as vectors."""
        if self.count == self._t.size:
            self._resize(min(2*self.count, max(self._expected, self.count + 2)))
        return (self._t[self.count:], *(x[self.count:].reshape(-1) for x in self._qva))

    def finish(self, order):
        """t [nt] and q, v, a [n, nt], in the user's order; the record is used up."""
        self._resize(self.count)
        if order is not None:
            place = np.argsort(order)
            for x in self._qva:
                for i in range(0, self.count, 1024):             # no second copy of the whole
                    x[i:i + 1024] = x[i:i + 1024, place]
        return (self._t, *(x.T for x in self._qva))

    def _resize(self, capacity):
        # the system moves large blocks without a copy; no view of them is used any more
        try:
            self._t.resize(capacity, refcheck=False)
            for x in self._qva:
                x.resize((capacity, self._n), refcheck=False)
        except (MemoryError, ValueError):
            raise self._no_memory(capacity) from None

    def _no_memory(self, points):
        size = 8*points*(3*self._n + 1)/2**30
        return MemoryError(f"no memory for {points} points of {self._n} coordinates ({size:.3g} GiB); "
                           "record fewer of them with every=... or t_eval=...")


class NoRecord:
    """For runs that record nothing."""

    def __init__(self, n):
        self.count = 0
        self._n = n

    def room(self):
        return (_NOTHING,)*4

    def finish(self, order):
        return (_NOTHING.copy(), *(np.empty((self._n, 0)) for _ in range(3)))
