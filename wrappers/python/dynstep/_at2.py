# SPDX-License-Identifier: BSD-3-Clause
"""Ground motions from files."""

import os

import numpy as np

from . import _core
from ._handle import SUCCESS


def read_at2(path):
    """Ground motion in a file of the PEER .AT2 layout.

    Parameters
    ----------
    path : str or path-like

    Returns
    -------
    dt : float
        Sampling interval in seconds.
    values : ndarray, shape (ns,)
        Accelerations as the file has them, in g for PEER's files.

    Raises
    ------
    OSError
        The file cannot be opened.
    ValueError
        It is not an AT2 file, or cut short; the message names the line.
    """
    with open(path, "rb"):
        pass                              # for Python's own OSError
    name = os.fsencode(path)
    values = np.empty(0)
    for _ in range(2):                    # first the number of values, then they
        code, dt, count, text = _core.dynstep_read_at2(name, values)
        if code != SUCCESS:
            raise ValueError(text.decode(errors="replace"))
        values = values if values.size else np.empty(count)
    return dt, values[:count]
