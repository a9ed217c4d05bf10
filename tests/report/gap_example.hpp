// SPDX-License-Identifier: Apache-2.0
/// \file
/// Diagnoses filled by hand, for pages and files to be made of: no analysis runs.
#pragma once

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "gap/diagnosis.hpp"

namespace wheelwright::report::gap_example {

/// Residuals of `seconds` at 50 Hz: a sine of 8 left by the nominal model, a square wave of 5 after fitting, noise of
/// 1.
inline gap::ResidualSeries series(std::string channel, std::string unit, double seconds, gap::GapSpace space,
                                  unsigned seed) {
  gap::ResidualSeries s;
  s.space = space;
  s.channel = std::move(channel);
  s.unit = std::move(unit);
  s.floor = 0.01;
  const auto n = static_cast<Eigen::Index>(50.0 * seconds);
  s.t = s.signal = s.nominal = s.refitted = s.after = Eigen::VectorXd::Zero(n);
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0.0, 0.01);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double t = 0.02 * static_cast<double>(k), noise = normal(generator);
    s.t[k] = t;
    s.signal[k] = std::sin(0.9 * t);
    s.nominal[k] = 0.08 * std::sin(0.9 * t) + 0.03 * std::sin(0.2 * t) + noise;
    s.refitted[k] = (std::sin(0.9 * t) > 0.0 ? 0.05 : -0.05) * std::abs(std::cos(0.9 * t)) + noise;
    s.after[k] = noise;
  }
  return s;
}

/// Dry friction of 0.312 N·m [0.290, 0.330] that explains 93 % of the gap.
inline Diagnosis explained(double seconds = 60.0) {
  Diagnosis d;
  d.verdict = gap::GapVerdict::explained;
  d.summary = "Dry friction explains the gap.";
  d.causes = {{.effect = "coulomb",
               .sentence = "Dry friction at every joint: a torque of constant size against the motion.",
               .parametric = false,
               .parameters = {{"coulomb", "N·m", 0.3124, 0.29, 0.33, false}},
               .share = 0.934}};
  d.credible = {{{"coulomb"}, 1.04, 1.0}};
  d.confusable = {{"coulomb", "caster_drag", 0.82, false, "not excited: turn on the spot"},
                  {"coulomb", "stribeck", 0.61, false, "not excited: drive faster"},
                  {"caster_drag", "stribeck", 0.44, false, ""},
                  {"payload", "armature", 1.0, true, "the pose of a load cell would split them"},
                  {"slope", "torque_bias", 0.35, false, ""}};
  const auto share = [](gap::GapSpace space, std::string channel, std::string kind, std::string regime, double part,
                        double presence, double p) {
    return gap::GapShare{space, std::move(channel), std::move(regime), std::move(kind), part, presence, p};
  };
  const gap::GapSpace dynamic = gap::GapSpace::dynamic;
  d.where = {share(dynamic, "sum", "channel", "all", 0.71, 1.0, 0.0004),
             share(dynamic, "sum", "direction", "right wheel forwards", 0.64, 0.62, 0.4),
             share(dynamic, "sum", "frequency", "0.2 to 0.5 Hz", 0.58, 0.22, 0.0001),
             share(dynamic, "sum", "reversal", "reversal of the right wheel", 0.52, 0.11, 0.002),
             share(dynamic, "sum", "frequency", "0.5 to 1 Hz", 0.31, 0.24, 0.01),
             share(dynamic, "difference", "channel", "all", 0.29, 1.0, 0.01),
             share(dynamic, "sum", "time", "t = 6 to 12 s", 0.12, 0.1, 0.8)};
  d.shrink.torque_rms = {{"sum", "N·m", 0.0849, 0.0078, 0.0071, 0.0071, 0.0085},
                         {"difference", "N·m·m", 0.02, 0.003, 0.0028, 0.0028, 0.0033}};
  d.shrink.rollout = {{"velocity_1s", "m/s", 0.041, 0.006, 0.004, 0.005, 0.007}};
  d.shrink.threshold_width = {{"sum", "N·m", 0.41, 0.09, 0.0, 0.08, 0.1}};
  d.shrink.smallest_fault = {{"sum", "1", std::numeric_limits<double>::infinity(), 0.05, 0.0, 0.04, 0.06}};
  d.parametric = {{"mass", "kg", 21.0, 22.7, 21.1, 20.8, 21.4}, {"viscous_linear", "N·s/m", 4.0, 7.9, 4.2, 3.7, 4.6}};
  d.contradictions = {{12.5, "sum", 0.6}, {31.25, "sum", 0.4}};
  d.gap = 0.0123;
  d.structural = 0.0061;
  d.remaining = 0.01;
  d.floor_error = 0.05;
  d.floor_origin = "the healthy baseline log";
  d.beta = 10.0;
  d.not_excited = {"slope: drive at several headings"};
  d.notes = {"3 instants were dropped"};
  d.series = {series("sum", "N·m", seconds, dynamic, 1), series("difference", "N·m·m", seconds, dynamic, 2)};
  return d;
}

/// Dry friction or a dragging castor.
inline Diagnosis ambiguous() {
  Diagnosis d = explained();
  d.verdict = gap::GapVerdict::ambiguous;
  d.credible.push_back({{"caster_drag"}, 1.06, 0.31});
  d.credible.back().answer = 1;
  return d;
}

/// Late torque, by a delay or a lag.
inline Diagnosis late_torque() {
  Diagnosis d = explained();
  d.causes[0].effect = "delay";
  d.causes[0].sentence = "The torque arrives later than it was commanded.";
  d.causes[0].parameters = {{"T_d", "s", 0.021, 0.020, 0.022, true}};
  d.causes[0].family = "late_torque";
  d.causes[0].laws = {{"delay", d.causes[0].sentence, d.causes[0].parameters},
                      {"actuator_lag",
                       "The actuator follows its command with a first-order lag.",
                       {{"T", "s", 0.024, 0.023, 0.025, true}}}};
  d.credible = {{{"delay"}, 1.04, 1.0}, {{"actuator_lag"}, 1.05, 0.6}};
  return d;
}

/// Two causes at once.
inline Diagnosis two_causes() {
  Diagnosis d = explained();
  d.causes[0].share = 0.6;
  d.causes.push_back(
      {.effect = "slope",
       .sentence = "The ground slopes.",
       .parametric = false,
       .parameters = {{"gravity_x", "m/s²", 0.2, 0.1, 0.3, false}, {"gravity_y", "m/s²", 0.0, -0.1, 0.1, false}},
       .share = 0.35});
  d.credible = {{{"coulomb", "slope"}, 1.04, 1.0}};
  return d;
}

/// A gap that dry friction lessens and nothing explains.
inline Diagnosis unexplained() {
  Diagnosis d = explained();
  d.verdict = gap::GapVerdict::unexplained;
  d.causes[0].share = 0.4;
  d.remaining = 0.6;
  return d;
}

/// Noise.
inline Diagnosis no_gap() {
  Diagnosis d = explained();
  d.verdict = gap::GapVerdict::no_gap;
  d.causes.clear();
  d.credible.clear();
  d.contradictions.clear();
  d.gap = d.structural = d.remaining = 0.0;
  d.visible = {{"coulomb", "c", "N·m", 0.0213}, {"payload", "mass_kg", "kg", 0.317}, {"stribeck", "c_s", "N·m", 0.5}};
  return d;
}

/// Efforts that no model of the healthy robot fits.
inline Diagnosis misfit() {
  Diagnosis d = no_gap();
  d.verdict = gap::GapVerdict::unexplained;
  d.misfit = gap::HealthyMisfit{"difference", 0.231, {"lateral_scrub"}, {"stribeck"}, "turning on the spot"};
  return d;
}

}  // namespace wheelwright::report::gap_example
