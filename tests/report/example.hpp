// SPDX-License-Identifier: Apache-2.0
/// \file
/// Results filled by hand, for pages to be made of: no pipeline runs.
#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "commission/detection.hpp"
#include "model/differential_drive.hpp"
#include "results/report/commission_report.hpp"
#include "results/report/page.hpp"

namespace wheelwright::report::report_example {

inline constexpr double kRadius = 0.1;

inline Robot robot() {
  Robot r;
  r.name = "example robot";
  r.wheel_radius = kRadius;
  r.track_width = 0.4;
  r.nominal = {{"mass", 21.0}};
  return r;
}

/// Mass 21.3 kg in [20.9, 21.7], and the like for the others; clean validation of 3500 instants; smallest κ 0.0837.
inline Commissioning done() {
  Commissioning c;
  c.message = "commissioned";
  c.model.robot = robot();
  c.model.model = model::make_model(c.model.robot);
  c.model.estimate = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(c.model.model.p()));
  c.model.filter = {.order = 2, .alpha = 20.0, .beta = 20.0};
  const double estimate[] = {21.3, 0.91, 4.2, 0.52}, half[] = {0.4, 0.02, 0.3, 0.05};
  for (std::size_t j = 0; j < 4; ++j) {
    commission::ParameterResult p;
    p.parameter = c.model.model.parameters[j];
    p.estimate = kRadius * estimate[j];
    c.model.estimate[static_cast<Eigen::Index>(j)] = kRadius * estimate[j];
    p.standard_error = kRadius * half[j] / 8.0;
    p.lower = kRadius * (estimate[j] - half[j]);
    p.upper = kRadius * (estimate[j] + half[j]);
    p.chebyshev = kRadius * (estimate[j] + 0.1 * half[j]);
    p.lower_binding = {{.sample = 1234, .t = 12.34, .output = j % 2}};
    p.upper_binding = {{.sample = 4321, .t = 43.21, .output = j % 2}, {.is_prior = true, .parameter = j}};
    c.parameters.push_back(p);
  }
  c.survey = {.rows = 6000,
              .segments = 1,
              .seconds = 60.0,
              .longest_segment = 60.0,
              .median_step = 0.01,
              .largest_step = 0.012,
              .largest_speed = {12.0, 11.5},
              .largest_acceleration = {8.0, 9.0},
              .sharpest_change = {9.0, 11.0},
              .change_noise = {0.1, 0.1},
              .reversals = {4.0, 6.0}};
  commission::OutputNoise noise;
  noise.bound = 0.05;
  noise.learning = 0.04;
  noise.how = {.bound = 0.05, .over_largest = 1.3, .over_rms = 5.6, .heavy_tail = false};
  c.noise = {noise, noise};
  c.residuals.outputs.resize(2);
  c.residuals.freedom = 40.0;
  c.residuals.instants = 5900;
  c.rank = 4;
  c.condition = 37.0;
  c.filter_choice.design = c.model.filter;
  for (const double beta : {2.0, 5.0, 10.0, 20.0, 40.0, 80.0}) {
    c.filter_choice.curve.push_back(
        {{.order = 2, .alpha = beta, .beta = beta}, 0.02 * (1.0 + std::pow(beta / 30.0, 2))});
  }
  commission::OutputValidation v{.instants = 3500,
                                 .outside = 0,
                                 .coverage = 1.0,
                                 .coverage_noise_free = 0.71,
                                 .nrmse = 0.02,
                                 .utilisation = 0.62,
                                 .torque_rms = 1.0,
                                 .residual_rms = 0.02,
                                 .median_width = 0.12,
                                 .median_width_box = 0.15,
                                 .smallest_kappa = 0.0837};
  c.validation = {v, v};
  c.validation[1].smallest_kappa = 0.12;
  c.minimax = 0.4;
  c.notes = {"wheel speeds are differenced encoder counts"};
  return c;
}

/// The same without curves: nothing is known of the yaw parameters.
inline Commissioning partial() {
  Commissioning c = done();
  c.status = Commissioning::Status::partial;
  for (const std::size_t j : {std::size_t{1}, std::size_t{3}}) {
    commission::ParameterResult& p = c.parameters[j];
    p.excitation = identify::Excitation::not_excited;
    p.reason = "its motion never occurs in the log: " + p.parameter.excite;
    p.estimate.reset();
    p.standard_error.reset();
    p.lower = 0.0;
    p.upper = 1e4;
    p.lower_is_prior = p.upper_is_prior = true;
    p.chebyshev = 5e3;
  }
  return c;
}

inline Commissioning nothing() {
  Commissioning c = partial();
  c.status = Commissioning::Status::nothing;
  for (commission::ParameterResult& p : c.parameters) {
    p.excitation = identify::Excitation::not_excited;
    p.estimate.reset();
  }
  return c;
}

/// Two samples that contradict each other at 12.5 s and 31.25 s; bounds would have to be 1.8 times as wide.
inline Commissioning empty() {
  Commissioning c = done();
  c.status = Commissioning::Status::empty;
  c.minimax = 1.8;
  c.validation.clear();
  for (commission::OutputNoise& noise : c.noise) {
    noise.origin = core::NoiseOrigin::declared;
  }
  c.feasible.status = FeasibleSet::Status::empty;
  bounds::WeightedRow row{
      {Eigen::VectorXd::Ones(4), 1.0, {.sample = 1250, .t = 12.5, .output = 0, .side = bounds::Side::upper}}, 0.7};
  c.feasible.contradiction.push_back(row);
  row.row.origin = {.sample = 3125, .t = 31.25, .output = 0, .side = bounds::Side::lower};
  c.feasible.contradiction.push_back(row);
  row.row.origin = {.is_prior = true, .parameter = 0, .side = bounds::Side::lower};
  c.feasible.contradiction.push_back(row);
  return c;
}

/// A detector's walk over `bins` bins of 0.01 s: |ε| <= 0.3 in [−1, 1]; with a fault, ε = 1.6 in the last third of
/// output 0.
inline Detection detection(std::size_t bins, bool fault) {
  Detection d;
  d.rows = d.instants = bins;
  d.seconds = 0.01 * static_cast<double>(bins);
  d.outside = {fault ? bins / 3 : 0, 0};
  d.utilisation = {fault ? 1.6 : 0.3, 0.3};
  d.nrmse = {0.02, 0.03};
  d.trace.outputs.resize(2);
  d.trace.breaks = {0, bins / 2};
  for (std::size_t k = 0; k < bins; ++k) {
    const double t = 0.01 * static_cast<double>(k);
    d.trace.t.push_back(t);
    for (std::size_t i = 0; i < 2; ++i) {
      commission::OutputTrace& o = d.trace.outputs[i];
      const double added = fault && i == 0 && k >= 2 * bins / 3 ? 1.4 : 0.0;
      o.torque.push_back(2.123456 * std::sin(0.7 * t) + added);
      o.predicted.push_back(2.0 * std::sin(0.7 * t));
      o.residual_low.push_back(0.1 * std::sin(37.0 * t) - 0.2 + added);
      o.residual_high.push_back(0.1 * std::sin(41.0 * t) + 0.2 + added);
      o.lower.push_back(-1.0 - 0.3 * std::cos(0.7 * t));
      o.upper.push_back(1.0 + 0.3 * std::cos(0.7 * t));
    }
  }
  if (fault) {
    const double onset = 0.01 * static_cast<double>(2 * bins / 3);
    d.events.push_back({.output = 0,
                        .start = onset,
                        .alarm = onset + 0.02,
                        .end = d.seconds,
                        .peak_time = onset + 1.0,
                        .peak_residual = 1.7,
                        .peak_ratio = 1.6,
                        .instants = bins / 3,
                        .start_sample = 2 * bins / 3});
  }
  return d;
}

/// Wheel speeds, torques and pose over `rows` rows of 0.01 s.
inline LogTable signals(std::size_t rows) {
  LogTable table;
  table.names = {"omega_r", "omega_l", "tau_r", "tau_l", "x", "y", "theta"};
  table.columns.resize(table.names.size());
  table.segment_starts = {0, rows / 2};
  for (std::size_t k = 0; k < rows; ++k) {
    const double t = 0.01 * static_cast<double>(k);
    table.t.push_back(t);
    const double values[] = {6.0 + std::sin(0.7 * t),
                             6.0 - std::sin(0.7 * t),
                             0.4 * std::cos(0.7 * t),
                             -0.4 * std::cos(0.7 * t),
                             3.0 * std::sin(0.1 * t),
                             2.0 * std::cos(0.13 * t),
                             0.3 * t};
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      table.columns[c].push_back(values[c]);
    }
  }
  return table;
}

inline CommissionContext context(std::size_t rows = 6000) {
  CommissionContext context;
  context.log_files = {"drive_01.csv.gz"};
  context.seeds = {{"simulation", 7}};
  context.software = "wheelwright 0.1.0";
  context.command_line = "wheelwright commission drive_01.csv.gz --robot robot.yaml --out result";
  context.warnings = {"2 rows dropped: the same time as the row before (first at drive_01.csv.gz:120)"};
  context.signals = signals(rows);
  context.own_log = detection(rows, false);
  return context;
}

/// Assertion that `page` holds every one of `texts`. A failure names the text, not a page of a megabyte.
inline testing::AssertionResult holds(const std::string& page, const std::vector<std::string>& texts) {
  for (const std::string& text : texts) {
    if (page.find(text) == std::string::npos) {
      return testing::AssertionFailure() << "not on the page: " << text;
    }
  }
  return testing::AssertionSuccess();
}

/// Assertion that `page` holds none of `texts`.
inline testing::AssertionResult lacks(const std::string& page, const std::vector<std::string>& texts) {
  for (const std::string& text : texts) {
    if (page.find(text) != std::string::npos) {
      return testing::AssertionFailure() << "on the page: " << text;
    }
  }
  return testing::AssertionSuccess();
}

}  // namespace wheelwright::report::report_example
