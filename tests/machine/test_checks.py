#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The checks in tools/ and the Fortran harness find planted faults, and accept what is right.

usage: test_checks.py NM READELF PLANTED_SAVE PLANTED_TRAMPOLINE PLANTED_FAILURE
"""
import pathlib
import subprocess
import sys

TOOLS = pathlib.Path(__file__).resolve().parents[2] / "tools"
sys.dont_write_bytecode = True
sys.path.insert(0, str(TOOLS))

from check_interfaces import differences, of_fortran, of_header, of_pyf  # noqa: E402
from check_source import complaints  # noqa: E402
from count_results import counts, judge  # noqa: E402

GOOD = {
    "src/core/dynstep_a.f90": """
module dynstep_a
   implicit none
   abstract interface
      integer function f(x)       ! an interface needs no prefix
         real, intent(in) :: x
      end function f
   end interface
contains
   pure subroutine stopped(stop)
      logical, intent(out) :: stop   ! print *, 'no'; stop
      stop = .true.
      stop_asked = .false.
   end subroutine stopped
end module dynstep_a""",
    "src/steppers/dynstep_b.f90": """
module dynstep_b
   use dynstep_a, only: stopped
contains
   recursive subroutine step(text)
      character(len=*), intent(out) :: text
      write (text, '(a)') 'print *, it''s all right; stop'
   end subroutine step
   elemental real(wp) function &
      & half(x)
      real(wp), intent(in) :: x
      half = x/2
   end function half
end module dynstep_b""",
    "wrappers/f77/dsnewm.f90": "recursive subroutine dsnewm(n)\nend subroutine dsnewm\n",
}

PLANTED = {
    "silence": [
        ("src/core/dynstep_a.f90", f"module dynstep_a\ncontains\nsubroutine s\n{line}\nend subroutine\nend module")
        for line in ("print *, 'x'", "if (a > b(1)) print '(a)', x", "write (*, *) 'x'", "WRITE(UNIT=*,FMT=*) x",
                     "stop", "if (bad) error stop 'x'", "STOP 1", "call exit(1)",
                     "write (&\n  *, '(a)') x", "write (error_unit, *) x")],
    "floors": [
        ("src/core/dynstep_a.f90", "module dynstep_a\nuse dynstep_b, only: step\nend module"),
        ("src/core/dynstep_a.f90", "module dynstep_a\nuse :: dynstep_nowhere\nend module")],
    "modules": [
        ("src/core/dynstep_a.f90", "module dynstep_other\nend module"),
        ("src/core/dynstep_a.f90", "module dynstep_a\nend module\nmodule dynstep_c\nend module"),
        ("wrappers/f77/dsnewm.f90", "recursive subroutine dsother(n)\nend")],
    "labels": [
        ("wrappers/c/dynstep_c.f90", "module dynstep_c\ncontains\n"
         "recursive function dynstep_a(n) result(code) bind(c)\nend function\nend module"),
        ("wrappers/c/dynstep_c.f90", "module dynstep_c\nuse dynstep_a, only: stopped\ncontains\n"
         "recursive function a_of_c(n) result(code) bind(c, name='dynstep_a')\nend function\nend module")],
    "recursive": [
        ("src/steppers/dynstep_b.f90", "module dynstep_b\ncontains\nsubroutine step()\nend subroutine\nend module"),
        ("src/steppers/dynstep_b.f90",
         "module dynstep_b\ncontains\nreal(wp) function f(x) result(y)\nend function\nend module"),
        ("wrappers/f77/dsnewm.f90", "subroutine dsnewm(n, &\n & x)\nend")],
}

HEADER = """
#ifndef H /* int a(int b); */
#define TWO(x) \\
   twice(x)
#ifdef __cplusplus
extern "C" {
#endif
typedef int (*force)(int n, void *ctx);   // int c(int d);
enum { ONE = 1, TWO = (2) };
intptr_t dynstep_new(void);
int dynstep_go(intptr_t handle, const double *q,
               int (*f)(int, double));
#endif
"""
FORTRAN = """
   recursive function dynstep_new() result(handle) bind(c)
   end function
   recursive integer(c_int) function bound_go(handle, &
      & q, f) bind(c, name='dynstep_go')
   end function
   subroutine private_helper(x)
   end subroutine
"""
PYF = """
python module _core
   interface
      function dynstep_new()
         intent(c) dynstep_new
      end function dynstep_new
      function dynstep_go(handle, q, f)
      end function dynstep_go
   end interface
end python module _core
"""


def fails_with(text, *command):
    """Whether a command ends with 1 and says `text`."""
    done = subprocess.run(command, capture_output=True, text=True)
    return done.returncode == 1 and text in done.stdout


def cases(nm, readelf, save, trampoline, failure):
    """Yield (name, whether it holds)."""
    yield "a SAVE is found", fails_with("calls.", TOOLS / "check_globals.py", nm, save)
    yield "an executable stack is found", fails_with("RWE", TOOLS / "check_stack.py", readelf, trampoline)
    yield "the harness sees a failure", fails_with("1 passed, 1 failed", failure)
    yield "the harness fails where nothing ran", fails_with("0 passed, 0 failed", failure, "no-such-suite")

    yield "good sources pass", not any(complaints(GOOD).values())
    for rule, faults in PLANTED.items():
        for number, (path, text) in enumerate(faults, 1):
            yield f"{rule} {number} is found", bool(complaints({**GOOD, path: text})[rule])

    expected = {"dynstep_new": 0, "dynstep_go": 3}
    yield "header is read", of_header(HEADER) == expected
    yield "bind(c) is read", of_fortran(FORTRAN) == expected
    yield "pyf is read", of_pyf(PYF) == expected
    yield "equal interfaces agree", not list(differences(expected, expected, "a", "b"))
    for other in ({"dynstep_new": 0}, {**expected, "more": 1}, {**expected, "dynstep_new": 1}):
        yield f"{other} differs", len(list(differences(expected, other, "a", "b"))) == 1

    yield "a program's count", counts("ok 1\n3 passed, 1 failed\nSTOP 1\n") == (3, 1, 0)
    yield "pytest's count", counts("..sF\n1 failed, 12 passed, 2 skipped, 1 error in 0.5s\n") == (12, 2, 2)
    yield "no count, passed", judge({"result": "OK", "stdout": "hello"}) == (1, 0, 0)
    yield "no count, failed", judge({"result": "FAIL"}) == (0, 1, 0)
    yield "a crash after its count", judge({"result": "FAIL", "stdout": "2 passed, 0 failed"}) == (2, 1, 0)
    yield "a time-out", judge({"result": "TIMEOUT", "stdout": ""}) == (0, 1, 0)
    yield "a test that never ran", judge(None) == (0, 1, 0)


passed = failed = 0
for name, holds in cases(*sys.argv[1:]):
    print("ok  " if holds else "FAIL", name)
    passed, failed = passed + bool(holds), failed + (not holds)
print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0 or passed == 0)
