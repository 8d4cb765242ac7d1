# SPDX-License-Identifier: BSD-3-Clause
"""Properties that hold for any input."""
import numpy as np
import pytest
from problems import ROD_START, rod

import dynstep
from dynstep import LinearSystem, banded, solve
from dynstep._matrices import as_matrix

hypothesis = pytest.importorskip("hypothesis")
given, settings, st = hypothesis.given, hypothesis.settings, hypothesis.strategies
QUICK = settings(max_examples=40, deadline=None, derandomize=True)


def random_matrix(n, density, seed, symmetric):
    """Sparse, diagonally dominant."""
    rng = np.random.default_rng(seed)
    a = rng.uniform(-1, 1, (n, n))*(rng.random((n, n)) < density)
    if symmetric:
        a = a + a.T
    np.fill_diagonal(a, 1 + np.abs(a).sum(axis=1))
    return a


@QUICK
@given(n=st.integers(1, 12), density=st.floats(0, 1), seed=st.integers(0, 10**6))
def test_band_of_a_dense_matrix(n, density, seed):
    a = np.triu(np.tril(random_matrix(n, density, seed, False), seed % n), -(seed % (n + 1)))
    b = dynstep.Banded.from_dense(a)
    assert np.array_equal(b.toarray(), a) and b.shape == (n, n)
    again = banded(b.ab, b.kl, b.ku)
    assert np.array_equal(again.toarray(), a)
    x = np.arange(2.0*n).reshape(n, 2)
    stored = as_matrix("K", b, n)
    assert np.allclose(stored.dot(x), a @ x) and np.allclose(stored.dot(x[:, 0]), a @ x[:, 0])
    assert stored.symmetric == np.array_equal(a, a.T) or b.kl != b.ku


@QUICK
@given(n=st.integers(1, 30), density=st.floats(0, 0.3), seed=st.integers(0, 10**6), symmetric=st.booleans())
def test_sparse_and_dense_agree(n, density, seed, symmetric):
    sparse = pytest.importorskip("scipy.sparse")
    k = random_matrix(n, density, seed, symmetric)
    c = random_matrix(n, density/2, seed + 1, symmetric)*0.1
    q0 = np.random.default_rng(seed).uniform(-1, 1, n)
    dense, other = LinearSystem(1.0, c, k), LinearSystem(1.0, sparse.csr_array(c), sparse.coo_array(k))
    a = solve(dense, (0, 1), q0, 0*q0, h=0.1)
    b = solve(other, (0, 1), q0, 0*q0, h=0.1)
    assert a.success and np.abs(a.q - b.q).max() < 1e-12
    assert dense.has_energy == other.has_energy == (symmetric or np.array_equal(k, k.T))


@QUICK
@given(n=st.integers(2, 8), share=st.floats(0, 0.9), density=st.floats(0, 0.6), seed=st.integers(0, 10**6))
def test_constraints_with_any_pattern(n, share, density, seed):
    """A q = b t, in all forms in which A can be given."""
    rng = np.random.default_rng(seed)
    m = max(1, int(share*n))
    a = np.where(rng.random((m, n)) < density, rng.uniform(-1, 1, (m, n)), 0.0)
    a[np.arange(m), np.arange(m)] = 3.0
    b = rng.uniform(-1, 1, m)
    k = rng.uniform(0, 2, n)
    places = np.nonzero(a)
    pattern = np.concatenate([[0], np.cumsum(np.count_nonzero(a, axis=1))]), places[1]
    forms = [{}, {"constraint_jacobian": lambda t, q: (a, -b)},
             {"constraint_jacobian": lambda t, q: (a, -b), "constraint_pattern": pattern},
             {"constraint_jacobian": lambda t, q: (a[places], -b), "constraint_pattern": a}]
    null = np.linalg.svd(a)[2][m:]                   # motions that are free
    q0 = null.T @ rng.uniform(-1, 1, n - m)
    v0 = np.linalg.lstsq(a, b, rcond=None)[0] + null.T @ rng.uniform(-1, 1, n - m)
    runs = [solve(dynstep.MechanicalSystem(n, lambda t, q, v: -k*q, constraint=lambda t, q: a @ q - b*t,
                                           tangent_kind="diagonal", velocity_free=True, **form), (0, 1), q0, v0, h=0.1)
            for form in forms]
    for s in runs:
        assert s.success and s.lam.shape == (m, 11), s.message
        assert max(x.max() for x in s.constraint_drift) < 1e-12
        assert np.abs(s.q - runs[0].q).max() < 1e-9 and np.abs(s.lam - runs[0].lam).max() < 1e-6


@QUICK
@given(steps=st.lists(st.floats(0.001, 0.05), min_size=1, max_size=30), rho=st.floats(0, 1), backward=st.booleans(),
       variant=st.sampled_from(["soi2", "reduced"]))
def test_constraints_hold_with_any_steps(steps, rho, backward, variant):
    integrator = dynstep.Integrator(rod(), dynstep.SOI2(rho, variant=variant))
    integrator.start(0.0, *ROD_START)
    for h in steps:
        integrator.step(-h if backward else h)
        q, v = integrator.q, integrator.v
        assert abs(q @ q - 1) < 1e-13 and abs(2*(q @ v)) < 1e-12 and np.isfinite(integrator.lam).all()


@QUICK
@given(times=st.lists(st.floats(0, 2), max_size=20), h=st.floats(0.05, 3), backward=st.booleans())
def test_any_t_eval(times, h, backward):
    sign = -1.0 if backward else 1.0
    times = sign*np.sort(times)
    system = LinearSystem(1.0, K=1.0)
    s = solve(system, (0, 2*sign), 1, 0, "newmark", h=sign*h, t_eval=times)
    assert np.array_equal(s.t, times) and s.success
    dense = solve(system, (0, 2*sign), 1, 0, "newmark", h=sign*h, dense_output=True)
    assert times.size == 0 or np.abs(dense.sol(times)[0] - s.q).max() < 1e-12


@QUICK
@given(piece=st.floats(1e-9, 1e-3), block=st.integers(1, 50), every=st.integers(0, 7),
       limit=st.none() | st.integers(1, 120))
def test_pieces_and_blocks_do_not_show(piece, block, every, limit):
    from unittest import mock
    system = LinearSystem(np.ones(2), K=np.ones(2))

    def run():
        return solve(system, (0, 10), [1, 2], [0, 1], "newmark", h=0.1, every=every, max_steps=limit)

    expected = run()
    with mock.patch("dynstep._run._PIECE", piece), mock.patch("dynstep._record._FIRST_BLOCK", 2*block):
        s = run()
    assert s.status == expected.status and s.counts == expected.counts
    assert all(np.array_equal(getattr(s, x), getattr(expected, x)) for x in ("t", "q", "v", "a"))


@QUICK
@given(value=st.one_of(st.none(), st.text(), st.floats(), st.lists(st.floats(), max_size=3), st.booleans(),
                       st.complex_numbers(), st.binary(), st.dictionaries(st.text(), st.integers(), max_size=2)),
       where=st.sampled_from(["q0", "v0", "t_span", "h", "t_eval", "every", "max_steps", "observer", "method"]))
def test_nothing_but_clear_errors(value, where):
    good = {"t_span": (0, 1), "q0": [1.0, 2.0], "v0": [0.0, 0.0], "h": 0.5, "max_steps": 3}
    try:
        s = solve(LinearSystem(np.ones(2)), **{**good, where: value})
    except (ValueError, TypeError) as error:
        # a far t_span loses h in its rounding, and ends at what the library calls t_end
        names = {"h": ["h = ", "h must"], "t_span": ["t_span", "t_end", "h = "]}.get(where, [where, "t_end"])
        assert any(name in str(error) for name in names) or where in str(error)
    else:
        assert s.t.size <= 5


@QUICK
@given(value=st.one_of(st.none(), st.text(max_size=3), st.floats(), st.lists(st.floats(), max_size=5), st.booleans(),
                       st.complex_numbers(), st.tuples(st.floats(), st.floats()), st.lists(st.lists(st.floats(-9, 9))),
                       st.integers(-2**70, 2**70), st.dictionaries(st.text(max_size=2), st.integers(), max_size=2)),
       where=st.sampled_from(["constraint", "constraint_jacobian", "constraint_curvature", "velocity_constraint",
                              "velocity_jacobian", "reaction", "reaction_jacobian", "reaction_tangent"]),
       late=st.booleans())
def test_functions_of_constraints_may_return_anything(value, where, late):
    functions = {"constraint": lambda t, q: q @ q - 1.0, where: lambda t, *_: value}
    if where == "velocity_jacobian":
        functions["velocity_constraint"] = lambda t, q, v: [0.0]
    if where == "reaction_jacobian":
        functions["reaction"] = lambda t, q, v, lam, psi: -2*q*lam
    if late and where == "constraint":
        functions[where] = lambda t, q: value if t > 0.15 else q @ q - 1.0
    system = dynstep.MechanicalSystem(2, lambda t, q, v: [0.0, -1.0], **functions)
    try:
        s = solve(system, (0, 0.3), *ROD_START, h=0.1)
    except (ValueError, TypeError) as error:
        # a number of constraints that cannot be is the library's to tell
        assert where in str(error) or "m = " in str(error) or "p = " in str(error), error
    else:
        assert s.success or s.message and np.isfinite(s.q).all() and np.isfinite(s.lam).all()
