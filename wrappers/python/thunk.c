/* SPDX-License-Identifier: BSD-3-Clause */
/* Python functions in the place of the user functions of dynstep.h.
 *
 * The context of a thunk is a Python list (dynstep/_functions.py makes it, and keeps it alive):
 *
 *   FUNCTION   the Python function
 *   ARGS       tuple of further arguments
 *   NAME       what messages call the function, bytes
 *   ROWS       of a returned matrix: 0 diagonal [n], else a 2-D array [ROWS, n]
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

enum { FUNCTION, ARGS, NAME, ROWS, ORDER, RETRY, FAILURE };
enum { MOST_ARGS = 32 };      /* of the user's own; _functions.py refuses more */

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
    if (!order) memcpy(to, x, (size_t)n*sizeof(double));
    else for (int i = 0; i < n; i++) to[order[i]] = x[i];
    return a;
}

/* Call the function with (t, vectors..., ARGS...) */
static PyObject *call(void *context, int n, double t, int count, const double *const *vectors)
{
    PyObject *args = ITEM(context, ARGS), *stack[1 + 3 + MOST_ARGS], *result = NULL;
    Py_ssize_t more = PyTuple_GET_SIZE(args);
    const npy_intp *order = order_of(context);
    int made = 0;
    stack[0] = PyFloat_FromDouble(t);
    if (stack[0]) for (made = 1; made <= count; made++)
        if (!(stack[made] = vector(n, vectors[made - 1], order))) break;
    if (made == count + 1) {
        for (Py_ssize_t i = 0; i < more; i++) stack[made + i] = PyTuple_GET_ITEM(args, i);
        result = PyObject_Vectorcall(ITEM(context, FUNCTION), stack, (size_t)(made + more), NULL);
    }
    while (made > 0) Py_DECREF(stack[--made]);
    return result;
}

static void wrong_shape(const char *name, PyArrayObject *a, int rank, const npy_intp *shape)
{
    PyObject *got = PyObject_GetAttrString((PyObject *)a, "shape");
    if (!got) return;
    if (rank == 1)
        PyErr_Format(PyExc_ValueError, "%s returned an array of shape %R, expected (%zd,)", name, got, shape[0]);
    else
        PyErr_Format(PyExc_ValueError, "%s returned an array of shape %R, expected (%zd, %zd)", name, got, shape[0],
                     shape[1]);
    Py_DECREF(got);
}

/* What the library can read as it is, as nearly all results are; numpy's general way takes 0.1 us more */
static int is_plain(PyObject *result, int rank, const npy_intp *shape)
{
    if (!PyArray_Check(result)) return 0;
    PyArrayObject *a = (PyArrayObject *)result;
    return PyArray_TYPE(a) == NPY_DOUBLE && PyArray_NDIM(a) == rank && PyArray_ISFARRAY_RO(a)
        && PyArray_CompareLists(PyArray_DIMS(a), shape, rank);
}

/* The returned array, as columns of doubles; a new reference */
static PyArrayObject *numbers(const char *name, PyObject *result, int rank, const npy_intp *shape)
{
    if (is_plain(result, rank, shape)) return (PyArrayObject *)Py_NewRef(result);
    if (result == Py_None) {
        PyErr_Format(PyExc_TypeError, "%s returned None, expected an array; is there a return statement?", name);
        return NULL;
    }
    PyArrayObject *a = (PyArrayObject *)PyArray_FROM_O(result);
    if (!a) return NULL;
    int type = PyArray_TYPE(a), scalar = PyArray_NDIM(a) == 0 && PyArray_MultiplyList((npy_intp *)shape, rank) == 1;
    if (!(PyTypeNum_ISFLOAT(type) || PyTypeNum_ISINTEGER(type) || PyTypeNum_ISBOOL(type))) {
        PyErr_Format(PyExc_TypeError, "%s returned an array of %S, expected real numbers", name, PyArray_DESCR(a));
        Py_DECREF(a);
        return NULL;
    }
    if (!scalar && !(PyArray_NDIM(a) == rank && PyArray_CompareLists(PyArray_DIMS(a), shape, rank))) {
        wrong_shape(name, a, rank, shape);
        Py_DECREF(a);
        return NULL;
    }
    PyArrayObject *columns = (PyArrayObject *)PyArray_FROMANY((PyObject *)a, NPY_DOUBLE, 0, 0,
                                                              NPY_ARRAY_FARRAY_RO | NPY_ARRAY_FORCECAST);
    Py_DECREF(a);
    return columns;
}

/* Copy the returned array to the library; 0, or -1 with an exception set */
static int take(void *context, PyObject *result, int n, long rows, double *to)
{
    const char *name = PyBytes_AS_STRING(ITEM(context, NAME));
    const npy_intp *order = order_of(context);
    npy_intp shape[2] = {rows ? rows : n, n};
    PyArrayObject *a = numbers(name, result, rows ? 2 : 1, shape);
    if (!a) return -1;
    const double *from = PyArray_DATA(a);
    if (!order) memcpy(to, from, (size_t)PyArray_SIZE(a)*sizeof(double));
    else for (int i = 0; i < n; i++) to[i] = from[order[i]];
    Py_DECREF(a);
    return 0;
}

/* What the library is told of the exception that is set, if one is */
static int outcome(void *context)
{
    if (!PyErr_Occurred()) return 0;
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
    PyObject *result = call(context, n, t, 2, (const double *const[]){q, v});
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
    PyObject *result = call(context, n, t, 2, (const double *const[]){q, v});
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
    const char *name = PyBytes_AS_STRING(ITEM(context, NAME));
    long rows = PyLong_AsLong(ITEM(context, ROWS));
    if (!c) return take(context, result, n, rows, k);
    if (!PyTuple_Check(result) || PyTuple_GET_SIZE(result) != 2) {
        PyErr_Format(PyExc_TypeError, "%s returned %.100s, expected a tuple (K, C); K alone goes with "
                     "velocity_free=True", name, Py_TYPE(result)->tp_name);
        return -1;
    }
    if (take(context, PyTuple_GET_ITEM(result, 0), n, rows, k)) return -1;
    return take(context, PyTuple_GET_ITEM(result, 1), n, rows, c);
}

static int tangent(int n, double t, const double *q, const double *v, const double *a, double *k, double *c,
                   void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, n, t, 3, (const double *const[]){q, v, a});
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
    PyObject *result = call(context, n, t, 2, (const double *const[]){q, v});
    if (result) {
        const char *name = PyBytes_AS_STRING(ITEM(context, NAME));
        PyArrayObject *a = numbers(name, result, 1, (const npy_intp[]){1});
        if (a) *e = *(const double *)PyArray_DATA(a);
        Py_XDECREF(a);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

static int load(int n, double t, double *p, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, n, t, 0, NULL);
    if (result) {
        take(context, result, n, 0, p);
        Py_DECREF(result);
    }
    int code = outcome(context);
    PyGILState_Release(gil);
    return code;
}

static int observer(int n, double t, const double *q, const double *v, const double *a, void *context)
{
    PyGILState_STATE gil = PyGILState_Ensure();
    PyObject *result = call(context, n, t, 3, (const double *const[]){q, v, a});
    int stop = result ? PyObject_IsTrue(result) : 0;
    Py_XDECREF(result);
    int code = outcome(context);
    PyGILState_Release(gil);
    return code ? code : stop;
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
        work[n + order[i]] = v[i];
        work[2*n + order[i]] = a[i];
    }
    return ((dynstep_observer *)c[0])(n, t, work, work + n, work + 2*n, (void *)c[1]);
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
    case 6: return (intptr_t)reordered_load;
    case 7: return (intptr_t)reordered_observer;
    default: return 0;
    }
}
