/* SPDX-License-Identifier: BSD-3-Clause */
/* Python functions in the place of the user functions of dynstep.h.
 *
 * The context of a thunk is a Python list (dynstep/_functions.py makes it, and keeps it alive):
 *
 *   FUNCTION   the Python function
 *   ARGS       tuple of further arguments
 *   NAME       what messages call the function, bytes
 *   ROWS       of a returned matrix: 0 diagonal [n], else a 2-D array [ROWS, n]
 *   PATTERN    of a returned Jacobian of constraints: None (dense), or a tuple of two int32 arrays, the first entry
 *              of each row (and one past the last) and the column of each entry, counted from 0
 *   READ       None, or what makes an array of a returned sparse matrix
 *   ORDER      None, or place i of the library is place ORDER[i] of the user: an intp array [n]
 *   RETRY      exception class that asks for a smaller step: the thunk returns 1
 *   FAILURE    list of one place: the exception that the wrapper raises when the library has
 *              returned.  None crosses a Fortran frame.
 *
 * Arrays given to Python are new copies that may be kept.  What comes back is checked for kind
 * and shape; whether it is finite is the library's affair. */
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#define PY_ARRAY_UNIQUE_SYMBOL _npy_f2py_ARRAY_API
#define NO_IMPORT_ARRAY
#include <numpy/arrayobject.h>
#include <stdint.h>
#include <string.h>
#include "dynstep.h"

enum { FUNCTION, ARGS, NAME, ROWS, PATTERN, READ, ORDER, RETRY, FAILURE };
enum { MOST_ARGS = 32 };      /* of the user's own; _functions.py refuses more */
enum { MOST_VECTORS = 4 };    /* q, v, lambda, psi */

typedef struct { int size; const double *x; } vector_in;

#define ITEM(context, i) PyList_GET_ITEM((PyObject *)(context), i)

static const npy_intp *order_of(void *context)
{
    PyObject *order = ITEM(context, ORDER);
    return order == Py_None ? NULL : (const npy_intp *)PyArray_DATA((PyArrayObject *)order);
}

/* A new array with the user's order of places */
static PyObject *vector(int n, const double *x, const npy_intp *order)
{
    npy_intp dimension = n;
    PyObject *a = PyArray_SimpleNew(1, &dimension, NPY_DOUBLE);
    if (!a) return NULL;
    double *to = PyArray_DATA((PyArrayObject *)a);
    if (n == 0) return a;
    if (!order) memcpy(to, x, (size_t)n*sizeof(double));
    else for (int i = 0; i < n; i++) to[order[i]] = x[i];
    return a;
}

/* A function of the same integrator has raised: the library will return, and must not call Python before */
static int failed(void *context)
{
    return PyList_GET_ITEM(ITEM(context, FAILURE), 0) != Py_None;
}

/* Call the function with (t, vectors..., ARGS...) */
static PyObject *call(void *context, double t, int count, const vector_in *vectors)
{
    PyObject *args = ITEM(context, ARGS), *stack[1 + MOST_VECTORS + MOST_ARGS], *result = NULL;
    Py_ssize_t more = PyTuple_GET_SIZE(args);
    const npy_intp *order = order_of(context);
    int made = 0;
    if (failed(context)) return NULL;
    stack[0] = PyFloat_FromDouble(t);
    if (stack[0]) for (made = 1; made <= count; made++)
        if (!(stack[made] = vector(vectors[made - 1].size, vectors[made - 1].x, order))) break;
    if (made == count + 1) {
        for (Py_ssize_t i = 0; i < more; i++) stack[made + i] = PyTuple_GET_ITEM(args, i);
        result = PyObject_Vectorcall(ITEM(context, FUNCTION), stack, (size_t)(made + more), NULL);
    }
    while (made > 0) Py_DECREF(stack[--made]);
    return result;
}

/* `part` tells what of the result is wrong, such as "g_t, "; else it is empty */
static void wrong_shape(const char *name, const char *part, PyArrayObject *a, int rank, const npy_intp *shape)
{
    PyObject *got = PyObject_GetAttrString((PyObject *)a, "shape");
    if (!got) return;
    if (rank == 1)
        PyErr_Format(PyExc_ValueError, "%s returned %san array of shape %R, expected (%zd,)", name, part, got,
                     shape[0]);
    else
        PyErr_Format(PyExc_ValueError, "%s returned %san array of shape %R, expected (%zd, %zd)", name, part, got,
                     shape[0], shape[1]);
    Py_DECREF(got);
}

/* What the library can read as it is, as nearly all results are; numpy's general way takes 0.1 us more */
static int is_plain(PyObject *result, int rank, const npy_intp *shape, int layout)
{
    if (!PyArray_Check(result)) return 0;
    PyArrayObject *a = (PyArrayObject *)result;
    return PyArray_TYPE(a) == NPY_DOUBLE && PyArray_NDIM(a) == rank && PyArray_CHKFLAGS(a, layout)
        && PyArray_ISNOTSWAPPED(a)
        && PyArray_CompareLists(PyArray_DIMS(a), shape, rank);
}

/* The returned array of doubles, laid out by columns (NPY_ARRAY_FARRAY_RO) or by rows (NPY_ARRAY_CARRAY_RO); a new
 * reference */
static PyArrayObject *numbers(const char *name, const char *part, PyObject *result, int rank, const npy_intp *shape,
                              int layout)
{
    if (is_plain(result, rank, shape, layout)) return (PyArrayObject *)Py_NewRef(result);
    if (result == Py_None) {
        PyErr_Format(PyExc_TypeError, "%s returned %sNone, expected an array; is there a return statement?", name,
                     part);
        return NULL;
    }
    PyArrayObject *a = (PyArrayObject *)PyArray_FROM_O(result);
    if (!a) return NULL;
    int type = PyArray_TYPE(a), scalar = PyArray_NDIM(a) == 0 && PyArray_MultiplyList((npy_intp *)shape, rank) == 1;
    if (!(PyTypeNum_ISFLOAT(type) || PyTypeNum_ISINTEGER(type) || PyTypeNum_ISBOOL(type))) {
        PyErr_Format(PyExc_TypeError, "%s returned %san array of %S, expected real numbers", name, part,
                     PyArray_DESCR(a));
        Py_DECREF(a);
        return NULL;
    }
    if (!scalar && !(PyArray_NDIM(a) == rank && PyArray_CompareLists(PyArray_DIMS(a), shape, rank))) {
        wrong_shape(name, part, a, rank, shape);
        Py_DECREF(a);
        return NULL;
    }
    PyArrayObject *copy = (PyArrayObject *)PyArray_FROMANY((PyObject *)a, NPY_DOUBLE, 0, 0,
                                                           layout | NPY_ARRAY_FORCECAST);
    Py_DECREF(a);
    return copy;
}

static int rank_of(PyObject *result)
{
    return PyArray_Check(result) ? PyArray_NDIM((PyArrayObject *)result) : -1;
}

static const char *name_of(void *context)
{
    return PyBytes_AS_STRING(ITEM(context, NAME));
}

/* Copy the returned array to the library; 0, or -1 with an exception set */
static int take(void *context, PyObject *result, int n, long rows, double *to)
{
    const npy_intp *order = order_of(context);
    npy_intp shape[2] = {rows ? rows : n, n};
    PyArrayObject *a = numbers(name_of(context), "", result, rows ? 2 : 1, shape, NPY_ARRAY_FARRAY_RO);
    if (!a) return -1;
    const double *from = PyArray_DATA(a);
    if (!order) memcpy(to, from, (size_t)PyArray_SIZE(a)*sizeof(double));
    else for (int i = 0; i < n; i++) to[i] = from[order[i]];
    Py_DECREF(a);
    return 0;
}

/* A vector that belongs to `part` of the result */
static int take_vector(void *context, const char *part, PyObject *result, int n, double *to)
{
    PyArrayObject *a = numbers(name_of(context), part, result, 1, (const npy_intp[]){n}, NPY_ARRAY_CARRAY_RO);
    if (!a) return -1;
    memcpy(to, PyArray_DATA(a), (size_t)n*sizeof(double));
    Py_DECREF(a);
    return 0;
}

/* A matrix [rows, columns] by rows or by columns; one row, or one column, may come as a vector */
static int take_matrix(void *context, const char *part, PyObject *result, int rows, int columns, int layout,
                       double *to)
{
    npy_intp shape[2] = {rows, columns};
    int single = layout == NPY_ARRAY_CARRAY_RO ? rows == 1 : columns == 1;
    PyObject *made = result == Py_None ? Py_NewRef(result) : PyArray_FROM_O(result);      /* of a list */
    if (!made) return -1;
    int rank = single && rank_of(made) == 1 ? 1 : 2;
    if (rank == 1) shape[0] = (npy_intp)rows*columns;
    PyArrayObject *a = numbers(name_of(context), part, made, rank, shape, layout);
    Py_DECREF(made);
    if (!a) return -1;
    memcpy(to, PyArray_DATA(a), (size_t)PyArray_SIZE(a)*sizeof(double));
    Py_DECREF(a);
    return 0;
}

/* The entries of a dense Jacobian that are in the pattern; all others must be zero */
static int take_entries(void *context, PyArrayObject *a, int rows, int columns, const int *first, const int *column,
                        double *to)
{
    const double *from = PyArray_DATA(a);
    for (npy_intp i = 0; i < rows; i++) {
        int e = first[i];
        for (int j = 0; j < columns; j++) {
            double x = from[j + i*columns];
            if (e < first[i + 1] && column[e] == j) to[e++] = x;
            else if (x != 0.0) {
                PyErr_Format(PyExc_ValueError, "%s returned an entry [%zd, %d] that its pattern does not have",
                             name_of(context), i, j);
                return -1;
            }
        }
    }
    return 0;
}

/* A Jacobian of constraints: an array [rows, columns], a sparse matrix, or the values of the pattern */
static int take_jacobian(void *context, PyObject *result, int rows, int columns, double *to)
{
    PyObject *pattern = ITEM(context, PATTERN), *read = ITEM(context, READ), *made = NULL;
    int code = -1;
    if (!PyArray_Check(result) && result != Py_None) {
        if (read != Py_None && PyObject_HasAttrString(result, "tocsr"))
            made = PyObject_CallFunction(read, "Oii", result, rows, columns);
        else
            made = PyArray_FROM_O(result);
        if (!made) return -1;
        result = made;
    }
    if (pattern == Py_None)
        code = take_matrix(context, "", result, rows, columns, NPY_ARRAY_CARRAY_RO, to);
    else if (rank_of(result) == 1) {
        int entries = (int)PyArray_SIZE((PyArrayObject *)PyTuple_GET_ITEM(pattern, 1));
        code = take_vector(context, "", result, entries, to);
    } else {
        PyArrayObject *a = numbers(name_of(context), "", result, 2, (const npy_intp[]){rows, columns},
                                   NPY_ARRAY_CARRAY_RO);
        if (a) {
            code = take_entries(context, a, rows, columns, PyArray_DATA((PyArrayObject *)PyTuple_GET_ITEM(pattern, 0)),
                                PyArray_DATA((PyArrayObject *)PyTuple_GET_ITEM(pattern, 1)), to);
            Py_DECREF(a);
        }
    }
    Py_XDECREF(made);
    return code;
}

/* What the library is told of the exception that is set, if one is */
static int outcome(void *context)
{
    if (!PyErr_Occurred()) return failed(context) ? -1 : 0;
    if (PyErr_ExceptionMatches(ITEM(context, RETRY))) {
        PyErr_Clear();
        return 1;
    }
    PyObject *type, *value, *trace;
    PyErr_Fetch(&type, &value, &trace);
    PyErr_NormalizeException(&type, &value, &trace);
    if (value && trace) PyException_SetTraceback(value, trace);
    if (value) PyList_SetItem(ITEM(context, FAILURE), 0, value);      /* takes the reference */
    Py_XDECREF(type);
    Py_XDECREF(trace);
    return -1;
}

static int force(int n, double t, const double *q, const double *v, double *f, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, t, 2, (const vector_in[]){{n, q}, {n, v}});
    if (result) {
        take(context, result, n, 0, f);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

static int mass(int n, double t, const double *q, const double *v, double *m, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, t, 2, (const vector_in[]){{n, q}, {n, v}});
    if (result) {
        take(context, result, n, PyLong_AsLong(ITEM(context, ROWS)), m);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

/* K, or (K, C) where there is a C */
static int take_tangents(void *context, PyObject *result, int n, double *k, double *c)
{
    long rows = PyLong_AsLong(ITEM(context, ROWS));
    if (!c) return take(context, result, n, rows, k);
    if (!PyTuple_Check(result) || PyTuple_GET_SIZE(result) != 2) {
        PyErr_Format(PyExc_TypeError, "%s returned %.100s, expected a tuple (K, C); K alone goes with "
                     "velocity_free=True", name_of(context), Py_TYPE(result)->tp_name);
        return -1;
    }
    if (take(context, PyTuple_GET_ITEM(result, 0), n, rows, k)) return -1;
    return take(context, PyTuple_GET_ITEM(result, 1), n, rows, c);
}

static int tangent(int n, double t, const double *q, const double *v, const double *a, double *k, double *c,
                   void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, t, 3, (const vector_in[]){{n, q}, {n, v}, {n, a}});
    if (result) {
        take_tangents(context, result, n, k, c);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

static int energy(int n, double t, const double *q, const double *v, double *e, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, t, 2, (const vector_in[]){{n, q}, {n, v}});
    if (result) {
        take_vector(context, "", result, 1, e);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

static int load(int n, double t, double *p, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, t, 0, NULL);
    if (result) {
        take(context, result, n, 0, p);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

/* Without v where the system is of first order: (t, y, y') */
static int observer(int n, double t, const double *q, const double *v, const double *a, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = v ? call(context, t, 3, (const vector_in[]){{n, q}, {n, v}, {n, a}})
                         : call(context, t, 2, (const vector_in[]){{n, q}, {n, a}});
    int stop = result ? PyObject_IsTrue(result) : 0;
    Py_XDECREF(result);
    int code = outcome(context);
    PyGILState_Release(gil);
    return code ? code : stop;
}

/* ---- First-order systems ---- */

static int rhs(int n, double t, const double *y, double *f, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, t, 1, (const vector_in[]){{n, y}});
    if (result) {
        take(context, result, n, 0, f);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

static int jacobian(int n, double t, const double *y, double *jac, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, t, 1, (const vector_in[]){{n, y}});
    if (result) {
        take(context, result, n, PyLong_AsLong(ITEM(context, ROWS)), jac);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

/* ---- Constraints ---- */

static int constraint(int n, int m, double t, const double *q, double *g, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, t, 1, (const vector_in[]){{n, q}});
    if (result) {
        take_vector(context, "", result, m, g);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

/* G, or (G, g_t) */
static int constraint_jacobian(int n, int m, double t, const double *q, double *gq, double *gt, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, t, 1, (const vector_in[]){{n, q}});
    if (result) {
        if (!PyTuple_Check(result))
            take_jacobian(context, result, m, n, gq);
        else if (PyTuple_GET_SIZE(result) != 2)
            PyErr_Format(PyExc_TypeError, "%s returned a tuple of %zd, expected G, an array, or (G, g_t)",
                         name_of(context), PyTuple_GET_SIZE(result));
        else if (!take_jacobian(context, PyTuple_GET_ITEM(result, 0), m, n, gq))
            take_vector(context, "g_t, ", PyTuple_GET_ITEM(result, 1), m, gt);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

/* constraint_curvature, velocity_constraint, velocity_curvature: numbers of (t, q, v) */
static int numbers_of_constraints(int n, int m, double t, const double *q, const double *v, double *c, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, t, 2, (const vector_in[]){{n, q}, {n, v}});
    if (result) {
        take_vector(context, "", result, m, c);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

static int velocity_jacobian(int n, int p, double t, const double *q, const double *v, double *kv, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, t, 2, (const vector_in[]){{n, q}, {n, v}});
    if (result) {
        take_jacobian(context, result, p, n, kv);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

static PyObject *call_reaction(void *context, int n, int m, int p, double t, const double *q, const double *v,
                               const double *lambda, const double *psi)
{
    return call(context, t, 4, (const vector_in[]){{n, q}, {n, v}, {m, lambda}, {p, psi}});
}

static int reaction(int n, int m, int p, double t, const double *q, const double *v, const double *lambda,
                    const double *psi, double *r, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call_reaction(context, n, m, p, t, q, v, lambda, psi);
    if (result) {
        take_vector(context, "", result, n, r);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

/* (dr/dlambda, dr/dpsi), or one of them where the other has no columns */
static void take_reaction_jacobian(void *context, PyObject *result, int n, int m, int p, double *rl, double *rp)
{
    const int layout = NPY_ARRAY_FARRAY_RO;
    if (PyTuple_Check(result) && PyTuple_GET_SIZE(result) == 2) {
        PyObject *by_lambda = PyTuple_GET_ITEM(result, 0), *by_psi = PyTuple_GET_ITEM(result, 1);
        if (m > 0 && take_matrix(context, "dr/dlambda, ", by_lambda, n, m, layout, rl)) return;
        if (p > 0) take_matrix(context, "dr/dpsi, ", by_psi, n, p, layout, rp);
    } else if (p == 0)
        take_matrix(context, "", result, n, m, layout, rl);
    else if (m == 0)
        take_matrix(context, "", result, n, p, layout, rp);
    else
        PyErr_Format(PyExc_TypeError, "%s returned %.100s, expected a tuple (dr/dlambda, dr/dpsi)", name_of(context),
                     Py_TYPE(result)->tp_name);
}

static int reaction_jacobian(int n, int m, int p, double t, const double *q, const double *v, const double *lambda,
                             const double *psi, double *rl, double *rp, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call_reaction(context, n, m, p, t, q, v, lambda, psi);
    if (result) {
        take_reaction_jacobian(context, result, n, m, p, rl, rp);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

static int reaction_tangent(int n, int m, int p, double t, const double *q, const double *v, const double *lambda,
                            const double *psi, double *k, double *c, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call_reaction(context, n, m, p, t, q, v, lambda, psi);
    if (result) {
        take_tangents(context, result, n, k, c);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

/* ---- Events and switches ---- */

/* Without v where the system is of first order: (t, y) */
static PyObject *call_at(void *context, int n, double t, const double *q, const double *v)
{
    return call(context, t, v ? 2 : 1, (const vector_in[]){{n, q}, {n, v}});
}

/* Events, one function each, and switches */
static int event(int n, int count, double t, const double *q, const double *v, double *s, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call_at(context, n, t, q, v);
    if (result) {
        take_vector(context, "", result, count, s);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

/* None or False: nothing is changed; True: parameters are; else the new (q, v), or the new y */
static int take_action(void *context, PyObject *result, int n, double *q, double *v)
{
    PyObject *both;
    int code = 1;
    if (result == Py_None) return 0;
    if (PyBool_Check(result) || PyArray_IsScalar(result, Bool)) return PyObject_IsTrue(result);
    if (!v) return take(context, result, n, 0, q) ? 0 : 1;
    if (!PyTuple_Check(result) && !PyList_Check(result)) {
        PyErr_Format(PyExc_TypeError, "%s returned %.100s, expected a tuple (q, v), True where it has changed parameters, or "
                     "None", name_of(context), Py_TYPE(result)->tp_name);
        return 0;
    }
    both = PySequence_Tuple(result);
    if (!both) return 0;
    if (PyTuple_GET_SIZE(both) != 2) {
        PyErr_Format(PyExc_ValueError, "%s returned %zd arrays, expected two: q and v", name_of(context),
                     PyTuple_GET_SIZE(both));
        code = 0;
    } else if (take(context, PyTuple_GET_ITEM(both, 0), n, 0, q) || take(context, PyTuple_GET_ITEM(both, 1), n, 0, v))
        code = 0;
    Py_DECREF(both);
    return code;
}

/* The arrays that the function gets cannot be written to: a change in place would be lost without a word */
static int action(int n, int which, double t, double *q, double *v, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *args = ITEM(context, ARGS), *stack[3 + MOST_ARGS], *result = NULL;
    Py_ssize_t more = PyTuple_GET_SIZE(args);
    const npy_intp *order = order_of(context);
    int made = 0, count = v ? 3 : 2, changed = 0;
    (void)which;
    if (!failed(context)) {
        stack[0] = PyFloat_FromDouble(t);
        if (stack[0]) for (made = 1; made < count; made++) {
            if (!(stack[made] = vector(n, made == 1 ? q : v, order))) break;
            PyArray_CLEARFLAGS((PyArrayObject *)stack[made], NPY_ARRAY_WRITEABLE);
        }
        if (made == count) {
            for (Py_ssize_t i = 0; i < more; i++) stack[made + i] = PyTuple_GET_ITEM(args, i);
            result = PyObject_Vectorcall(ITEM(context, FUNCTION), stack, (size_t)(made + more), NULL);
        }
        while (made > 0) Py_DECREF(stack[--made]);
    }
    if (result) {
        changed = take_action(context, result, n, q, v);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code ? code : changed;
}

/* Events one by one, each with a function and a context of its own, and their actions in the same way (0: none).  The
 * context is an intp array: (function, context) of each. */
static int each_event(int n, int count, double t, const double *q, const double *v, double *s, void *context)
{
    const intptr_t *c = context;
    for (int i = 0; i < count; i++) {
        int code = ((dynstep_event_function *)c[2*i])(n, 1, t, q, v, s + i, (void *)c[2*i + 1]);
        if (code) return code;
    }
    return 0;
}

static int each_action(int n, int which, double t, double *q, double *v, void *context)
{
    const intptr_t *c = (intptr_t *)context + 2*which;
    return c[0] ? ((dynstep_event_action *)c[0])(n, which, t, q, v, (void *)c[1]) : 0;
}

/* Compiled functions over a system that the wrapper has reordered.  The context is an intp array:
 * function, its context, address of workspace, order[n]. */

static int reordered_load(int n, double t, double *p, void *context)
{
    const intptr_t *c = context, *order = c + 3;
    double *work = (double *)c[2];
    int code = ((dynstep_load *)c[0])(n, t, work, (void *)c[1]);
    for (int i = 0; i < n; i++) p[i] = work[order[i]];
    return code;
}

static int reordered_observer(int n, double t, const double *q, const double *v, const double *a, void *context)
{
    const intptr_t *c = context, *order = c + 3;
    double *work = (double *)c[2];
    for (int i = 0; i < n; i++) {
        work[order[i]] = q[i];
        if (v) work[n + order[i]] = v[i];
        work[2*n + order[i]] = a[i];
    }
    return ((dynstep_observer *)c[0])(n, t, work, v ? work + n : NULL, work + 2*n, (void *)c[1]);
}

static int reordered_event(int n, int count, double t, const double *q, const double *v, double *s, void *context)
{
    const intptr_t *c = context, *order = c + 3;
    double *work = (double *)c[2];
    for (int i = 0; i < n; i++) {
        work[order[i]] = q[i];
        if (v) work[n + order[i]] = v[i];
    }
    return ((dynstep_event_function *)c[0])(n, count, t, work, v ? work + n : NULL, s, (void *)c[1]);
}

static int reordered_action(int n, int which, double t, double *q, double *v, void *context)
{
    const intptr_t *c = context, *order = c + 3;
    double *work = (double *)c[2];
    for (int i = 0; i < n; i++) {
        work[order[i]] = q[i];
        if (v) work[n + order[i]] = v[i];
    }
    int code = ((dynstep_event_action *)c[0])(n, which, t, work, v ? work + n : NULL, (void *)c[1]);
    for (int i = 0; i < n; i++) {
        q[i] = work[order[i]];
        if (v) v[i] = work[n + order[i]];
    }
    return code;
}

/* Address of a thunk; _functions.py has the same numbers */
intptr_t python_function(int which)
{
    switch (which) {
    case 0: return (intptr_t)force;
    case 1: return (intptr_t)mass;
    case 2: return (intptr_t)tangent;
    case 3: return (intptr_t)energy;
    case 4: return (intptr_t)load;
    case 5: return (intptr_t)observer;
    case 6: return (intptr_t)constraint;
    case 7: return (intptr_t)constraint_jacobian;
    case 8: return (intptr_t)numbers_of_constraints;      /* constraint_curvature */
    case 9: return (intptr_t)numbers_of_constraints;      /* velocity_constraint */
    case 10: return (intptr_t)velocity_jacobian;
    case 11: return (intptr_t)numbers_of_constraints;     /* velocity_curvature */
    case 12: return (intptr_t)reaction;
    case 13: return (intptr_t)reaction_jacobian;
    case 14: return (intptr_t)reaction_tangent;
    case 15: return (intptr_t)rhs;
    case 16: return (intptr_t)jacobian;
    case 17: return (intptr_t)load;                       /* source */
    case 18: return (intptr_t)event;
    case 19: return (intptr_t)action;
    case 20: return (intptr_t)event;                      /* switches */
    case 100: return (intptr_t)reordered_load;
    case 101: return (intptr_t)reordered_observer;
    case 102: return (intptr_t)reordered_event;
    case 103: return (intptr_t)reordered_action;
    case 104: return (intptr_t)each_event;
    case 105: return (intptr_t)each_action;
    default: return 0;
    }
}
