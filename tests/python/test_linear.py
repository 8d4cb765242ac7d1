# SPDX-License-Identifier: BSD-3-Clause
"""Linear systems: accuracy, kinds of matrices, loads."""
import numpy as np
import pytest
from problems import chain, free_vibration, same_bits

import dynstep
from dynstep import LinearSystem, LoadTable, banded, solve


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("method, order", [
    ("newmark", 2), ("linear-acceleration", 2), ("central-difference", 2), ("fox-goodwin", 4), ("midpoint", 2),
    (dynstep.NewmarkExtrapolation(2), 4), (dynstep.NewmarkExtrapolation(3, "romberg"), 6),
    (dynstep.MidpointExtrapolation(2, "bulirsch"), 4), (dynstep.NewmarkExtrapolation(2, (1, 3)), 4)])
def test_order_on_free_vibration(method, order, direction):
    system, q0, v0, exact = free_vibration()
    errors = []
    for steps in (40, 80):
        s = solve(system, (0, 4*direction), q0, v0, method, h=4*direction/steps)
        assert s.success and s.t[-1] == 4*direction
        errors.append(np.abs(s.q - exact(s.t)).max())
    assert np.log2(errors[0]/errors[1]) == pytest.approx(order, abs=0.25)


def test_damped_and_loaded_against_the_closed_form():
    m, c, k, w = 2.0, 0.4, 8.0, 1.3
    system = LinearSystem(m, c, k, lambda t: [np.cos(w*t)])
    z = 1/(k - m*w*w + 1j*w*c)                   # steady state Re(z exp(i w t))
    s = solve(system, (0, 20), z.real, (1j*w*z).real, h=0.05)
    assert np.abs(s.q[0] - (z*np.exp(1j*w*s.t)).real).max() < 1e-11
    assert np.abs(s.v[0] - (1j*w*z*np.exp(1j*w*s.t)).real).max() < 1e-11
    assert np.abs(s.a[0] + (w*w*z*np.exp(1j*w*s.t)).real).max() < 1e-10


def test_kinds_of_matrices_agree():
    sparse = pytest.importorskip("scipy.sparse")
    n = 12
    rng = np.random.default_rng(1)
    ab, m = chain(n), rng.uniform(1, 2, n)
    k = banded(ab, 1, 1).toarray()
    c = 0.02*k + 0.1*np.diag(m)
    q0, v0 = rng.standard_normal((2, n))
    systems = {
        "dense": LinearSystem(np.diag(m), c, k),
        "banded": LinearSystem(m, banded(0.02*ab + 0.1*np.array([[0], [1], [0]])*m, 1, 1), banded(ab, 1, 1)),
        "wide band": LinearSystem(m, dynstep.Banded.from_dense(c), banded(np.pad(ab, ((1, 1), (0, 0))), 2, 2)),
        "sparse": LinearSystem(sparse.diags_array(m), sparse.coo_array(c), sparse.csc_matrix(k)),
        "mixed": LinearSystem(m, c, sparse.csr_array(k)),
    }
    results = {name: solve(s, (0, 10), q0, v0, h=0.1) for name, s in systems.items()}
    for name, s in results.items():
        assert np.abs(s.q - results["dense"].q).max() < 1e-12, name
    assert systems["sparse"].storage == {"M": "diagonal", "C": "banded (kl=1, ku=1), symmetric",
                                         "K": "banded (kl=1, ku=1), symmetric"}
    assert same_bits(results["sparse"], solve(systems["sparse"], (0, 10), q0, v0, h=0.1))


def test_numbers_vectors_and_nothing():
    q0, v0 = [1.0, 2.0], [0.0, 1.0]
    a = solve(LinearSystem(np.eye(2), K=4*np.eye(2)), (0, 3), q0, v0, h=0.1)
    for system in (LinearSystem(K=[4.0, 4.0]), LinearSystem(1.0, K=[4.0, 4]), LinearSystem([1, 1], 0.0, 4)):
        assert np.abs(solve(system, (0, 3), q0, v0, h=0.1).q - a.q).max() < 1e-14
    assert LinearSystem(1.0, K=4).n == 1
    assert LinearSystem(2.0, load=LoadTable((0, 1), np.ones((3, 4)))).n == 3


def test_symmetry_is_found_exactly():
    a = np.array([[2.0, -1.0], [-1.0, 2.0]])
    assert LinearSystem(K=a).has_energy
    a[0, 1] = np.nextafter(-1.0, 0)
    system = LinearSystem(K=a)
    assert not system.has_energy and "not symmetric" in repr(system)
    with pytest.raises(ValueError, match="not symmetric"):
        system.energy(0.0, [1, 1], [0, 0])
    big = np.ones((600, 600))
    assert LinearSystem(K=big).has_energy
    big[3, 597] = 0
    assert not LinearSystem(K=big).has_energy


def test_energy_of_the_system_and_the_library_agree():
    n = 6
    ab = chain(n)
    system = LinearSystem(np.arange(1.0, n + 1), K=banded(ab, 1, 1))
    s = solve(system, (0, 5), np.ones(n), np.zeros(n), h=0.1)
    integrator = dynstep.Integrator(system)
    integrator.start(s.t[-1], s.q[:, -1], s.v[:, -1])
    assert s.energy().shape == s.t.shape
    assert np.ptp(s.energy()) < 1e-11
    assert integrator.energy == pytest.approx(s.energy()[-1], rel=1e-14)
    strain = 0.5*s.q[:, 0] @ banded(ab, 1, 1).toarray() @ s.q[:, 0]
    assert system.energy(0.0, s.q[:, 0], s.v[:, 0]) == pytest.approx(strain)


def test_singular_mass_is_an_unsuccessful_solution():
    s = solve(LinearSystem([1.0, 0.0], K=[1.0, 1.0]), (0, 1), [1, 1], [0, 0], "newmark", h=0.1)
    assert not s.success and "singular" in s.message and "equation 2" in s.message
    assert s.t.size == 0 and s.q.shape == s.a.shape == (2, 0) and "0 point" in repr(s)


def test_indefinite_effective_matrix():
    s = solve(LinearSystem(1.0, K=-400.0), (0, 1), 1, 0, "newmark", h=0.1)      # M + h^2/4 K = 0
    assert not s.success and s.status == -4 and "indefinite" in s.message and "h = 0.1" in s.message
    assert s.q.shape == (1, 1) and s.q[0, 0] == 1


# ---- Reordering ----

def grid(rows, columns):
    """Stiffness of a membrane whose points are counted along its long side."""
    sparse = pytest.importorskip("scipy.sparse")

    def line(n):
        return sparse.diags_array([-np.ones(n - 1), 2*np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    return sparse.kronsum(line(columns), line(rows)).tocsr()


def ring(n):
    """A ring of springs, in an order that makes its band as wide as the matrix."""
    sparse = pytest.importorskip("scipy.sparse")
    k = sparse.lil_array((n, n))
    for i in range(n):
        k[i, i] = 2.5
        k[i, (i + 1) % n] = k[(i + 1) % n, i] = -1.0
    return k.tocsr()


def test_reordering_is_not_seen():
    n = 60
    rng = np.random.default_rng(2)
    k, m = ring(n), rng.uniform(1, 2, n)
    q0, v0 = rng.standard_normal((2, n))
    seen = []

    def observer(t, q, v, a):
        seen.append((q, v, a))

    def load(t):
        return np.sin(t + np.arange(n))

    dense = LinearSystem(m, 0.1, k.toarray(), load)
    system = LinearSystem(m, 0.1, k, load)
    assert dense.ordering is None and sorted(system.ordering) == list(range(n))
    assert system.storage["K"] == "banded (kl=2, ku=2), symmetric" and "reordered" in repr(system)
    a = solve(dense, (0, 5), q0, v0, h=0.1)
    b = solve(system, (0, 5), q0, v0, h=0.1, observer=observer)
    for x in "qva":
        assert np.abs(getattr(a, x) - getattr(b, x)).max() < 1e-12
    assert np.array_equal(np.array([q for q, _, _ in seen]).T, b.q[:, 1:])
    assert np.array_equal(seen[-1][1], b.v[:, -1]) and np.array_equal(seen[-1][2], b.a[:, -1])
    np.testing.assert_allclose(b.energy(), a.energy(), rtol=1e-12)

    one, two = dynstep.Integrator(dense), dynstep.Integrator(system)
    for i in (one, two):
        i.start(0.0, q0, v0)
        i.step(0.1)
    assert np.abs(one.q - two.q).max() < 1e-13 and np.abs(one.a - two.a).max() < 1e-12
    t1, t2 = one.tableau()[0], two.tableau()[0]
    assert np.nanmax(np.abs(t1 - t2)) < 1e-13 and np.abs(t2[0, :, -1, -1] - two.q).max() < 1e-14


@pytest.mark.parametrize("with_pattern", [True, False])
def test_reordered_load_tables(with_pattern):
    n = 40
    k = ring(n)
    rng = np.random.default_rng(3)
    load = LoadTable((0, 0.1), rng.standard_normal((2, 51)), rng.standard_normal((n, 2))) if with_pattern \
        else LoadTable((0, 0.1), rng.standard_normal((n, 51)))
    a = solve(LinearSystem(2.0, K=k.toarray(), load=load), (0, 5), np.zeros(n), np.zeros(n), h=0.1)
    b = solve(LinearSystem(2.0, K=k, load=load), (0, 5), np.zeros(n), np.zeros(n), h=0.1)
    assert LinearSystem(2.0, K=k, load=load).ordering is not None
    assert np.abs(a.q - b.q).max() < 1e-12 < np.abs(a.q).max()


def test_feedback_has_a_default_method():
    held = LinearSystem([2.0, 1.0], 0.1, [[3.0, -1.0], [-1.0, 2.0]], feedback=([1.0, 0.0], [0.0, 2.0], None))
    s = solve(held, (0, 1), [1.0, 0.0], [0.0, 0.0], h=0.1)
    assert s.success and s.method == dynstep.Pade() == dynstep.Integrator(held).method


def test_compiled_load_and_observer_over_a_reordered_system():
    numba = pytest.importorskip("numba")
    n = 40

    @numba.cfunc(dynstep.signature("load"))
    def load(n, t, p, ctx):
        for i in range(n):
            p[i] = 0.5*i + t
        return 0

    @numba.cfunc(dynstep.signature("observer"))
    def observer(n, t, q, v, a, ctx):
        return 1 if q[3] > 0.5 else 0

    k = ring(n)
    a = solve(LinearSystem(K=k, load=lambda t: 0.5*np.arange(n) + t), (0, 9), np.zeros(n), np.zeros(n), h=0.1,
              observer=lambda t, q, v, a: q[3] > 0.5)
    b = solve(LinearSystem(K=k, load=load), (0, 9), np.zeros(n), np.zeros(n), h=0.1, observer=observer)
    assert a.status == b.status == 1 and same_bits(a, b) and a.q[3, -1] > 0.5 >= a.q[3, -2]


def test_order_is_kept_where_a_new_one_does_not_pay():
    sparse = pytest.importorskip("scipy.sparse")
    k = grid(8, 8)
    assert LinearSystem(K=k).ordering is None                                   # half width 8 either way
    assert LinearSystem(K=grid(3, 50)).ordering is not None                     # 50 against about 3
    tridiagonal = sparse.csr_array(banded(chain(50), 1, 1).toarray())
    assert LinearSystem(K=tridiagonal).ordering is None
    full = np.ones((30, 30)) + 30*np.eye(30)
    system = LinearSystem(K=sparse.csr_array(full))
    assert system.storage["K"] == "dense, symmetric"
    assert LinearSystem(sparse.eye_array(5), K=sparse.eye_array(5)).storage["K"] == "diagonal"


def test_unsymmetric_sparse_matrices_are_reordered_right():
    n = 50
    k = ring(n).tolil()
    k[0, 25] = 0.3
    k = k.tocsr()
    c = ring(n)*0.01
    q0 = np.linspace(-1, 1, n)
    a = solve(LinearSystem(1.0, c.toarray(), k.toarray()), (0, 5), q0, 0*q0, h=0.1)
    system = LinearSystem(1.0, c, k)
    b = solve(system, (0, 5), q0, 0*q0, h=0.1)
    assert system.ordering is not None and not system.has_energy
    assert np.abs(a.q - b.q).max() < 1e-12


def test_sparse_duplicates_are_summed():
    sparse = pytest.importorskip("scipy.sparse")
    k = sparse.coo_array(([1.0, 3.0, 4.0], ([0, 0, 1], [0, 0, 1])), shape=(2, 2))
    assert np.array_equal(solve(LinearSystem(K=k), (0, 1), [1, 1], [0, 0], h=0.1).q,
                          solve(LinearSystem(K=[4.0, 4.0]), (0, 1), [1, 1], [0, 0], h=0.1).q)


# ---- Loads ----

def test_load_table_against_a_function():
    times = np.array([0.0, 0.5, 0.7, 2.0, 3.0])
    samples = np.array([[0.0, 1.0, -1.0, 2.0, 0.5], [1.0, 0.0, 3.0, 1.0, 2.0]])
    pattern = np.array([[1.0, 0.0], [0.5, -2.0], [0.0, 1.0]])
    for outside in ("zero", "hold"):
        table = LoadTable(times, samples, pattern, outside)
        a = solve(LinearSystem(np.ones(3), 0.1, 4.0, table), (0, 4), np.zeros(3), np.zeros(3), h=0.1)
        b = solve(LinearSystem(np.ones(3), 0.1, 4.0, lambda t, table=table: table(t)), (0, 4), np.zeros(3), np.zeros(3),
                  h=0.1)
        if outside == "hold":                    # at the end of "zero" rounding decides
            assert np.abs(a.q - b.q).max() < 1e-13
        assert np.abs(a.q[:, :25] - b.q[:, :25]).max() < 1e-13 < np.abs(a.q).max()


def test_ground_motion_is_minus_m_e():
    pytest.importorskip("scipy.sparse")
    acceleration = np.sin(np.arange(30))
    e = np.array([1.0, 0.0, 2.0])
    m = np.array([[2.0, 1, 0], [1, 3, 1], [0, 1, 4]])
    for matrix in (m, dynstep.Banded.from_dense(m), __import__("scipy.sparse").sparse.csr_array(m)):
        table = dynstep.ground_motion(matrix, 0.1, acceleration, e)
        assert np.allclose(table.pattern[:, 0], -m @ e) and table.dt == 0.1
    assert np.allclose(dynstep.ground_motion([2.0, 3.0], 0.1, acceleration).pattern[:, 0], [-2, -3])
    assert np.allclose(dynstep.ground_motion(2.0, 0.1, acceleration, [1, 1]).pattern[:, 0], -2)
    with pytest.raises(ValueError, match="influence"):
        dynstep.ground_motion(2.0, 0.1, acceleration)
    with pytest.raises(ValueError, match="influence"):
        dynstep.ground_motion([2.0, 3.0], 0.1, acceleration, [1, 2, 3])


def test_matrices_are_copied():
    m, k = np.array([1.0, 1.0]), np.array([[4.0, 0.0], [0.0, 4.0]])
    ab = np.array([[4.0, 4.0]])
    system, other = LinearSystem(m, K=k), LinearSystem(m, K=banded(ab, 0, 0))
    before = solve(system, (0, 1), [1, 2], [0, 0], h=0.1)
    again = solve(other, (0, 1), [1, 2], [0, 0], h=0.1)
    m[:], k[:], ab[:] = 7.0, 7.0, 7.0
    assert same_bits(before, solve(system, (0, 1), [1, 2], [0, 0], h=0.1))
    assert same_bits(again, solve(other, (0, 1), [1, 2], [0, 0], h=0.1))
    assert np.abs(before.q - again.q).max() < 1e-15


def test_dense_arrays_in_either_layout():
    k = np.array([[4.0, -1.0], [-2.0, 3.0]])
    a, b = (solve(LinearSystem(K=x), (0, 2), [1, 2], [0, 0], h=0.1) for x in (k, np.asfortranarray(k)))
    assert same_bits(a, b)
    assert np.allclose(a.a[:, 0], -k @ [1, 2])
