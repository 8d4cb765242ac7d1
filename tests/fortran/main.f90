! SPDX-License-Identifier: BSD-3-Clause
!> All Fortran suites; tests/fortran/meson.build lists their names too.
program tester
   use test_arms, only: collect_arms
   use test_amplification, only: collect_amplification
   use test_backinterpolation, only: collect_backinterpolation
   use test_bits, only: collect_bits
   use test_check_constraints, only: collect_check_constraints
   use test_check_system, only: collect_check_system
   use test_constrained_extremes, only: collect_constrained_extremes
   use test_constraints, only: collect_constraints
   use test_constrained_models, only: collect_constrained_models
   use test_constrained_orders, only: collect_constrained_orders
   use test_divided_steps, only: collect_divided_steps
   use test_drivers, only: collect_drivers
   use test_endings, only: collect_endings
   use test_figures, only: collect_figures
   use test_ground_motion, only: collect_ground_motion
   use test_harness, only: collect_harness
   use test_linalg, only: collect_linalg
   use test_linear_accuracy, only: collect_linear_accuracy
   use test_linear_newmark, only: collect_linear_newmark
   use test_loads, only: collect_loads
   use test_matrix, only: collect_matrix
   use test_methods, only: collect_methods
   use test_misuse, only: collect_misuse
   use test_models, only: collect_models
   use test_nesting, only: collect_nesting
   use test_newton, only: collect_newton
   use test_ordering, only: collect_ordering
   use test_pole_sweeps, only: collect_pole_sweeps
   use test_rank, only: collect_rank
   use test_rational, only: collect_rational
   use test_rational_steps, only: collect_rational_steps
   use test_saddle_point, only: collect_saddle_point
   use test_saddle_schur, only: collect_saddle_schur
   use test_singular, only: collect_singular
   use test_stability, only: collect_stability
   use test_stability_facts, only: collect_stability_facts
   use test_stiff, only: collect_stiff
   use test_systems, only: collect_systems
   use test_text, only: collect_text
   use test_work, only: collect_work
   use testing, only: new_testsuite, run_tests
   implicit none
   call run_tests([ &
      & new_testsuite('harness', collect_harness), &
      & new_testsuite('linear_newmark', collect_linear_newmark), &
      & new_testsuite('linear_accuracy', collect_linear_accuracy), &
      & new_testsuite('text', collect_text), &
      & new_testsuite('methods', collect_methods), &
      & new_testsuite('misuse', collect_misuse), &
      & new_testsuite('ground_motion', collect_ground_motion), &
      & new_testsuite('models', collect_models), &
      & new_testsuite('arms', collect_arms), &
      & new_testsuite('constrained_models', collect_constrained_models), &
      & new_testsuite('constrained_extremes', collect_constrained_extremes), &
      & new_testsuite('constrained_orders', collect_constrained_orders), &
      & new_testsuite('divided_steps', collect_divided_steps), &
      & new_testsuite('matrix', collect_matrix), &
      & new_testsuite('linalg', collect_linalg), &
      & new_testsuite('singular', collect_singular), &
      & new_testsuite('ordering', collect_ordering), &
      & new_testsuite('saddle_point', collect_saddle_point), &
      & new_testsuite('saddle_schur', collect_saddle_schur), &
      & new_testsuite('pole_sweeps', collect_pole_sweeps), &
      & new_testsuite('rank', collect_rank), &
      & new_testsuite('rational', collect_rational), &
      & new_testsuite('rational_steps', collect_rational_steps), &
      & new_testsuite('figures', collect_figures), &
      & new_testsuite('bits', collect_bits), &
      & new_testsuite('stability', collect_stability), &
      & new_testsuite('stability_facts', collect_stability_facts), &
      & new_testsuite('amplification', collect_amplification), &
      & new_testsuite('newton', collect_newton), &
      & new_testsuite('stiff', collect_stiff), &
      & new_testsuite('check_system', collect_check_system), &
      & new_testsuite('constraints', collect_constraints), &
      & new_testsuite('check_constraints', collect_check_constraints), &
      & new_testsuite('work', collect_work), &
      & new_testsuite('drivers', collect_drivers), &
      & new_testsuite('endings', collect_endings), &
      & new_testsuite('systems', collect_systems), &
      & new_testsuite('loads', collect_loads), &
      & new_testsuite('backinterpolation', collect_backinterpolation), &
      & new_testsuite('nesting', collect_nesting) &
      & ])
end program tester
