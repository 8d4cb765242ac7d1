# SPDX-License-Identifier: BSD-3-Clause
"""Where the library writes the points of a run: arrays that grow."""

import os

import numpy as np

# Numbers in the first block of each array, 16 MiB: a shorter record is never moved, a longer one doubles
_FIRST_BLOCK = 2**21

_NOTHING = np.empty(0)


class Record:
    """Points of a run, at most `expected` of them; `sizes` are those of `Handle.sizes`.  `sure` of them come, unless the
    run fails: MemoryError at once where they cannot be held.  With `has_nodes` points inside steps come, too."""

    def __init__(self, sizes, expected, sure=0, has_nodes=False):
        self.count = 0
        self._sizes = sizes
        self._expected = max(1, expected)
        self._ends = [] if has_nodes else None
        if not _can_hold(sure*(sum(sizes) + 1)):
            raise self._no_memory(sure)
        capacity = min(self._expected, max(2, _FIRST_BLOCK//max(sizes)))
        try:
            self._t = np.empty(capacity)
            self._vectors = [np.empty((capacity, size)) for size in self._sizes]
        except (MemoryError, ValueError):
            raise self._no_memory(capacity) from None

    def room(self):
        """Room for t, q, v, a of the points not yet written, one or more, as vectors."""
        if self.count == self._t.size:
            self._resize(min(2*self.count, max(self._expected, self.count + 2)))
        return (self._t[self.count:], *(x[self.count:].reshape(-1) for x in self._vectors[:3]))

    def add(self, count, read_multipliers, read_kinds):
        """`count` points were written into the room; read_multipliers(count, m, p) gives theirs, read_kinds(count) tells
        which of them are ends of steps (0)."""
        if count and self._ends is not None:
            self._ends.append(self.count + np.flatnonzero(read_kinds(count) == 0))
        m, p = self._sizes[3:]
        if m + p and count:
            for x, new in zip(self._vectors[3:], read_multipliers(count, m, p)):
                x[self.count:self.count + count] = new
        self.count += count

    @property
    def ends(self):
        """Places of the points where steps end; the start is one."""
        return np.concatenate(self._ends) if self._ends else np.arange(self.count)

    def finish(self, order):
        """t [nt], q, v, a [n, nt] in the user's order, lam [m, nt], psi [p, nt]; the record is used up."""
        self._resize(self.count)
        if order is not None:
            place = np.argsort(order)
            for x in (x for x in self._vectors[:3] if x.shape[1]):
                for i in range(0, self.count, 1024):             # no second copy of the whole
                    x[i:i + 1024] = x[i:i + 1024, place]
        return (self._t, *(x.T for x in self._vectors))

    def _resize(self, capacity):
        # the system moves large blocks without a copy; no view of them is used any more
        try:
            self._t.resize(capacity, refcheck=False)
            for x, size in zip(self._vectors, self._sizes):
                x.resize((capacity, size), refcheck=False)
        except (MemoryError, ValueError):
            raise self._no_memory(capacity) from None

    def _no_memory(self, points):
        size = 8*points*(sum(self._sizes) + 1)/2**30
        return MemoryError(f"no memory for {points} points of {self._sizes[0]} coordinates or unknowns ({size:.3g} GiB); "
                           "record fewer of them with every=... or t_eval=...")


def _can_hold(numbers):
    """Whether the machine has memory for so many numbers, and the process may have it."""
    if numbers <= _FIRST_BLOCK:
        return True
    try:
        if 8*numbers > os.sysconf("SC_PAGE_SIZE")*os.sysconf("SC_PHYS_PAGES") > 0:
            return False
    except (AttributeError, OSError, ValueError):
        pass                                                     # not known on this system
    try:
        np.empty(numbers)                                        # given back at once, never touched
    except (MemoryError, ValueError):
        return False
    return True


class NoRecord:
    """For runs that record nothing."""

    def __init__(self, sizes):
        self.count = 0
        self._sizes = sizes

    def room(self):
        return (_NOTHING,)*4

    def add(self, count, read_multipliers, read_kinds):
        pass

    @property
    def ends(self):
        return np.empty(0, int)

    def finish(self, order):
        return (_NOTHING.copy(), *(np.empty((size, 0)) for size in self._sizes))
