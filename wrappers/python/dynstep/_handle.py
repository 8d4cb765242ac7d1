# SPDX-License-Identifier: BSD-3-Clause
"""One integrator of the library: its handle, its user functions, its errors."""

import threading

from . import _core

# the codes of dynstep.h that the package looks at
SUCCESS, MORE, EVENT = 0, 2, 3
INVALID_INPUT, NO_MEMORY, INCONSISTENT_START, TOO_MANY_STEPS, FILE_ERROR = -1, -6, -7, -8, -11

_ERRORS = {INVALID_INPUT: ValueError, NO_MEMORY: MemoryError}


class Handle:
    """Owner of a handle of dynstep.h.

    `call` is the one way into the library: it keeps a second thread, and the handle's own user
    functions, out; it raises what a user function raised, and what is a mistake of the caller.
    Other codes are the business of the caller.
    """

    def __init__(self, n, first_order=False):
        self.address = 0                 # for __del__, should the next line fail
        self.address = (_core.dynstep_new_ode if first_order else _core.dynstep_new)(n)
        if not self.address:
            raise MemoryError(f"no memory for an integrator of {n} {'unknowns' if first_order else 'coordinates'}")
        self.n = n
        self.m = self.p = 0              # constraints of its system
        self.first_order = first_order   # y' = f(t,y), else a mechanical system
        self.failure = [None]            # the exception of a user function
        self.sentence = ""               # of the last failure or stop
        self._kept = {}                  # what must live as long as the library has its address
        self._lock = threading.RLock()
        self._inside = False             # the library is at work
        self._sides = None               # lock of a system with switches

    def __del__(self):
        if self.address:
            _core.dynstep_delete(self.address)

    def __enter__(self):
        """Keep other threads out for several calls."""
        if not self._lock.acquire(blocking=False):
            raise RuntimeError("an integrator is used by two threads at once; make one for each")
        return self

    def __exit__(self, *exception):
        self._lock.release()

    def call(self, function, *arguments, refuse=True):
        """Code of a function of the library, or (code, results...); with refuse=False the caller
        looks at all codes."""
        with self:
            if self._inside:
                raise RuntimeError("an integrator was used from one of its own functions; make another one for that")
            if self._sides is not None and not self._sides.acquire(blocking=False):
                raise RuntimeError("a system with switches is used by two runs at once, which share its `side`; make one "
                                   "for each")
            self._inside = True
            try:
                result = function(self.address, *arguments)
            finally:
                self._inside = False
                if self._sides is not None:
                    self._sides.release()
            if self.failure[0] is not None:
                self._raise()
            code = result[0] if type(result) is tuple else result
            if code not in (SUCCESS, MORE):
                # the sentence now: the next call clears it
                self.sentence = _core.dynstep_message(self.address)[1].decode(errors="replace").strip()
                if refuse and code in _ERRORS:
                    raise _ERRORS[code](self.sentence)
            return result

    def bind(self, setter, function, *arguments, before=(), **form):
        """Give a user function to the library, or take it away where `function` is None; `before` are arguments in
        front of its address, `form` is that of UserFunction.bind."""
        address, context, kept = (0, 0, None) if function is None else function.bind(self.failure, **form)
        self.call(setter, *before, address, context, *arguments)
        self._kept[setter] = kept

    def bind_switches(self, function, side, lock):
        """Give switches to the library, which writes into `side`; `lock` keeps out other handles of the system."""
        if function is None:
            return
        self._kept["side"] = side
        self._sides = lock
        self.bind(_core.dynstep_set_switches, function, side)

    @property
    def sizes(self):
        """How many numbers q, v, a, lambda and psi have at a point of a run; y and y' of a first-order system have the
        places of q and a."""
        return (self.n, 0, self.n, 0, 0) if self.first_order else (self.n, self.n, self.n, self.m, self.p)

    @property
    def time(self):
        """Of the last good step."""
        return self.call(_core.dynstep_get_ode if self.first_order else _core.dynstep_get, self.n)[1]

    def counts(self):
        """{name: work since the start}."""
        return dict(zip(COUNT_NAMES, map(int, self.call(_core.dynstep_counts)[1])))

    def _raise(self):
        exception, self.failure[0] = self.failure[0], None
        try:
            raise exception
        finally:
            del exception                # its traceback holds this frame


COUNT_NAMES = []
while (answer := _core.dynstep_count_name(len(COUNT_NAMES)))[0] == SUCCESS:
    COUNT_NAMES.append(answer[1].decode())
COUNT_NAMES = tuple(COUNT_NAMES)
