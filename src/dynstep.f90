! SPDX-License-Identifier: BSD-3-Clause
!> All public names of the library: `use dynstep`.
module dynstep
   use dynstep_accuracy_domain, only: accuracy_error, accuracy_limit, damping_frequency
   use dynstep_alpha_coefficients, only: alpha_coefficients, coefficients_of, hht_coefficients, newmark_coefficients
   use dynstep_amplification, only: amplification, spectral_radii, spectral_radius
   use dynstep_archive, only: archive_type
   use dynstep_backinterpolation, only: backinterpolation_stepper, halves_fehlberg, halves_taylor
   use dynstep_bilinear_spring, only: bilinear_spring, law_literal, law_odd
   use dynstep_check_system, only: check_system, finding_length
   use dynstep_constrained_system, only: constrained_system, constraint_structure_type
   use dynstep_controlled_run, only: controlled_run_type, integrate_controlled
   use dynstep_dense_output, only: dense_output_type
   use dynstep_driven_crank, only: driven_crank
   use dynstep_equilibrium, only: newton_options
   use dynstep_error_norm, only: error_norm_type, norm_largest, norm_weighted
   use dynstep_events, only: event_log, event_type
   use dynstep_extrapolation, only: extrapolation_stepper
   use dynstep_extrapolation_limit, only: extrapolation_limit
   use dynstep_extrapolation_stability, only: growth_per_step, small_step_growth, stability_limit
   use dynstep_flexible_arm, only: arm_consistent, arm_listing, arm_symmetric, beam_euler_bernoulli, beam_timoshenko, &
      & euler_bernoulli_gains, flexible_arm, input_none, input_pulse, input_ramp, input_step, timoshenko_gains
   use dynstep_generalized_alpha, only: generalized_alpha_stepper
   use dynstep_ground_motion, only: read_at2, standard_gravity
   use dynstep_integrate, only: control_type, integrate, integration_type
   use dynstep_jacobian, only: jacobian_type, pattern_type
   use dynstep_jay_negrut_problem, only: jay_negrut_problem
   use dynstep_kinds, only: long, wp
   use dynstep_knife_edge, only: knife_edge
   use dynstep_linear_ode, only: linear_ode
   use dynstep_linear_system, only: coupling_type, linear_system, load_none, load_procedure, load_samples
   use dynstep_load_table, only: load_table_type, outside_hold, outside_zero
   use dynstep_lotka_volterra, only: lotka_volterra
   use dynstep_marginal_problem, only: marginal_problem
   use dynstep_matrix, only: banded_matrix, dense_matrix, diagonal_matrix, identity_matrix, kind_banded, &
      & kind_dense, kind_diagonal, kind_identity, kind_zero, matrix_type, zero_matrix
   use dynstep_mechanical_system, only: mechanical_system, structure_type
   use dynstep_methods, only: method_names, new_method
   use dynstep_midpoint, only: midpoint_stepper
   use dynstep_newmark, only: newmark_stepper
   use dynstep_ode_system, only: ode_system
   use dynstep_pade, only: pade_stepper
   use dynstep_pole_stages, only: form_automatic, form_parallel, form_product, form_refined
   use dynstep_rational, only: fehlberg_rational, pade_rational, rational_of, rational_type, taylor_rational
   use dynstep_oscillator, only: free_oscillator, loaded_oscillator
   use dynstep_rod_chain, only: rod_chain
   use dynstep_rod_pendulum, only: rod_pendulum
   use dynstep_rolling_disk, only: rolling_disk
   use dynstep_sequences, only: most_levels, sequence_automatic, sequence_bulirsch, sequence_custom, sequence_double_harmonic, &
      & sequence_harmonic, sequence_romberg
   use dynstep_restored_run, only: restore_run
   use dynstep_run, only: observer_type, run_type
   use dynstep_shear_building, only: shear_building
   use dynstep_slider_crank, only: slider_crank
   use dynstep_soi2, only: estimate_larger, estimate_projected, estimate_raw, mass_recomputed, mass_stored, soi2_stepper, &
      & start_keep, start_project, start_refuse, start_report, variant_index3, variant_reduced, variant_soi2
   use dynstep_stability_domain, only: find_domain, stability_domain_type
   use dynstep_stability_facts, only: find_facts, imaginary_axis_type, stability_facts_type
   use dynstep_stability_windows, only: alpha_windows, family_fehlberg, family_taylor, property_a_stable, &
      & property_f_stable, property_i_stable, property_l_stable
   use dynstep_status, only: dynstep_callback_failed, dynstep_event, dynstep_file_error, &
      & dynstep_in_use, dynstep_inconsistent_start, dynstep_invalid_handle, dynstep_invalid_input, &
      & dynstep_more, dynstep_no_memory, dynstep_not_converged, dynstep_not_finite, &
      & dynstep_singular_matrix, dynstep_step_too_small, dynstep_stopped, dynstep_success, &
      & dynstep_tolerance_too_small, dynstep_too_many_events, dynstep_too_many_steps, status_text, status_type
   use dynstep_step_control, only: controller_automatic, controller_pi, controller_standard, controller_weighted, &
      & safety_in_front, safety_inside, step_control_type
   use dynstep_stepper, only: allocate_state, clock_type, method_properties, state_type, step_counters, stepper_type, &
      & verdict_type
   use dynstep_stiff_third_order, only: stiff_third_order
   use dynstep_trajectory, only: recorder_type, trajectory_type
   use dynstep_point_masses, only: kepler, pleiades, point_masses_system
   use dynstep_two_body, only: two_body_system
   implicit none
   public
end module dynstep
