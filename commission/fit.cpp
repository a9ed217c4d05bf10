// SPDX-License-Identifier: Apache-2.0
#include "commission/fit.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "bounds/polytope.hpp"
#include "commission/setting_rows.hpp"
#include "core/error.hpp"
#include "core/statistics.hpp"
#include "identify/instruments.hpp"
#include "identify/noise_level.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kConfidence = 0.95;   // of the statistical intervals
constexpr double kUnexplained = 0.95;  // residual over effort, root mean square: a tenth of the square is explained
constexpr double kRunAway = 3.0;  // ratio of simulated to measured speeds beyond which a simulation is no instrument

// Root mean square of what the noise of the motion alone puts into each weighted column; zero where it is not known.
Eigen::VectorXd column_noise(const Setting& s, const Eigen::VectorXd& weights) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(s.model.p()));
  if (const auto noise = row_noise(s)) {
    for (std::size_t i = 0; i < noise->YY.size(); ++i) {
      const double w = weights[static_cast<Eigen::Index>(i)];
      squares += w * w * noise->YY[i].diagonal();
    }
  }
  return squares.cwiseSqrt();
}

std::optional<identify::RegressionMoments> simulated_moments(LogSource& log, const Setting& s, Part part,
                                                             const Eigen::VectorXd& theta) {
  if (s.measurement.effort_unsigned || !identify::MotionSimulation::possible(s.model, theta)) {
    return std::nullopt;
  }
  identify::InstrumentMotion motion;
  motion.kind = identify::InstrumentMotion::Kind::simulated;
  motion.theta = theta;
  identify::InstrumentStream stream(log, RegressorFilter(s.model, s.filter, s.measurement), motion);
  FoldedSource rows(stream, part, s.survey.rows, s.folds);
  std::optional<identify::RegressionMoments> sums = identify::moments_with_instruments(rows);
  const double ratio = stream.speed_ratio();
  const bool known = s.measurement.motion != MotionKind::angle;
  if (known && !(ratio < kRunAway && ratio > 1.0 / kRunAway)) {
    return std::nullopt;
  }
  return sums;
}

std::vector<bool> flags(const std::vector<identify::ExcitationFinding>& findings) {
  std::vector<bool> excluded;
  for (const identify::ExcitationFinding& finding : findings) {
    excluded.push_back(finding.state == identify::Excitation::not_excited);
  }
  return excluded;
}

bool all(const std::vector<bool>& flags) {
  return std::ranges::all_of(flags, [](bool flag) { return flag; });
}

identify::ResidualSummary summarise(core::RegressionSource& rows, const Fit& fit) {
  identify::ResidualStatistics statistics(fit.estimate, fit.weights);
  core::for_each_block(rows, [&](const RegressionBlock& block) { statistics.add(block); });
  identify::ResidualSummary summary = statistics.summary(fit.squares.inverse_gram);
  if (!fit.choice.candidates.empty() && fit.choice.chosen > 0) {
    const identify::Estimate& best = fit.choice.best();
    summary.covariance = best.covariance;
    summary.standard_error = best.standard_error;
    summary.freedom = best.freedom;
  }
  return summary;
}

// What is left of the rows of a detector, which goes on over rows that are lost.
identify::ResidualSummary of_detectors_rows(LogSource& log, const Setting& s, Part part, const Fit& fit) {
  filter::SignalErrors errors = errors_of_fit(s);
  errors.interpolates = false;
  errors.bridges = true;
  TorqueRows stream = make_rows(log, s, errors);
  FoldedSource rows(stream, part, s.survey.rows, s.folds);
  return summarise(rows, fit);
}

// Where the noise of the motion is not known: parameters of outputs alone whose efforts the motion does not explain may
// be made of it, and so may inertias (which are not zero) that are not told from zero.
void judge_unexplained(const Model& model, const identify::ResidualSummary& residuals,
                       std::vector<identify::ExcitationFinding>& findings) {
  std::vector<bool> told(model.p(), false);
  for (const Term& term : model.terms) {
    const identify::OutputResidual& output = residuals.outputs[term.output];
    const bool inertia = term.kind == Term::Kind::acceleration;
    told[term.parameter] =
        told[term.parameter] || (output.rms < kUnexplained * output.torque_rms &&
                                 !(inertia && findings[term.parameter].state == identify::Excitation::indistinct));
  }
  for (std::size_t j = 0; j < findings.size(); ++j) {
    if (!told[j] && findings[j].state != identify::Excitation::not_excited) {
      findings[j].state = identify::Excitation::not_excited;
      findings[j].reason = "nothing of its motion shows in the effort, and what noise the motion has is not known";
    }
  }
}

double t_quantile(const identify::ResidualSummary& summary) {
  return core::student_quantile(kConfidence, std::max(summary.freedom, 1.0));
}

// Why nothing is left of a log of many rows.
std::string no_instant(const Setting& s) {
  const filter::Measurement& m = s.measurement;
  constexpr double kSteps = 4.0;  // that the filter looks at together
  const double needed = kSteps * s.survey.median_step + std::max(m.delay.upper, 0.0) + std::max(-m.delay.lower, 0.0);
  return fmt::format(
      "log: no instant is left to fit: of its {} rows there are never {:.2g} s in a row without a step above {:.3g} "
      "ms, "
      "which counts as rows lost{}; log every sample, or resample the log evenly",
      s.survey.rows, needed, 1e3 * m.longest_step(),
      m.delay == Interval{} ? ""
                            : fmt::format(" (the declared `effort: {{delay: [{:g}, {:g}]}}` needs that long)",
                                          m.delay.lower, m.delay.upper));
}

}  // namespace

identify::RegressionMoments log_moments(LogSource& log, const Setting& s, Part part) {
  const RegressorFilter filter(s.model, s.filter, s.measurement, errors_of_fit(s));
  const auto commands = identify::commanded_motion(log, s.model);
  if (commands && !s.commands_are_noisy) {
    identify::InstrumentStream stream(log, filter, *commands);
    FoldedSource rows(stream, part, s.survey.rows, s.folds);
    return identify::moments_with_instruments(rows);
  }
  TorqueRows stream(log, filter);
  FoldedSource rows(stream, part, s.survey.rows, s.folds);
  return identify::moments(rows);
}

filter::SignalErrors errors_of_fit(const Setting& s) {
  filter::SignalErrors errors = s.declared;
  errors.between_samples = errors.bridges = false;
  errors.interpolates = loses_often(s.survey);
  return errors;
}

Fit fit_log(LogSource& log, const Setting& s, Part part, double risk) {
  identify::EstimatorEvidence evidence{
      .rows = log_moments(log, s, part),
      .simulate = [&](const Eigen::VectorXd& theta) { return simulated_moments(log, s, part, theta); },
      .noise = row_noise(s),
      .noise_origin = s.motion_noise ? s.motion_noise->origin : "",
      .effort_is_exact = s.measurement.hold == Hold::zero_order && !(s.robot.noise.effort.value.value_or(0.0) > 0.0)};
  Fit fit;
  fit.weights = identify::efficient_weights(evidence.rows);
  fit.factor = identify::LeastSquares(s.model.p(), fit.weights);
  TorqueRows stream = make_rows(log, s, errors_of_fit(s));
  FoldedSource rows(stream, part, s.survey.rows, s.folds);
  std::size_t instants = 0;
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    fit.factor.add(block);
    instants += block.instants();
  });
  if (instants == 0) {
    throw InvalidArgument(no_instant(s));
  }

  // Columns that never move or always move together are out at once; those that may be made of noise only where no
  // estimator is to be had that noise does not bias.
  identify::EstimatorChoiceOptions options;
  options.estimator.weights = fit.weights;
  const auto fit_with = [&](const std::vector<bool>& excluded) {
    fit.squares = fit.factor.solve(excluded);
    fit.estimate = fit.squares.estimate;
    fit.choice = {};
    if (!all(excluded)) {
      options.estimator.excluded = excluded;
      fit.choice = identify::choose_estimator(evidence, options);
      fit.estimate = fit.choice.chosen > 0 ? fit.choice.best().theta : fit.estimate;
    }
    fit.residuals = summarise(rows, fit);
  };
  const auto judge = [&](const Eigen::VectorXd& noise) {
    identify::LeastSquaresFit judged = fit.squares;
    judged.estimate = fit.estimate;
    return identify::judge_excitation(judged, fit.residuals.standard_error, t_quantile(fit.residuals), noise);
  };
  const auto judge_further = [&](const Eigen::VectorXd& noise) {
    const std::vector<identify::ExcitationFinding> before = fit.excitation;
    fit.excitation = judge(noise);
    for (std::size_t j = 0; j < before.size(); ++j) {
      if (before[j].state == identify::Excitation::not_excited) {
        fit.excitation[j] = before[j];
      }
    }
  };
  fit.squares = fit.factor.solve();
  fit.estimate = fit.squares.estimate;
  fit.residuals = summarise(rows, fit);
  fit.excitation = judge({});
  std::vector<bool> excluded = flags(fit.excitation);
  fit_with(excluded);
  // A limit of the noise is not taken away from a column that may be made of noise.
  const bool corrected =
      !fit.choice.candidates.empty() && fit.choice.chosen > 0 &&
      !(fit.choice.best().estimator == identify::Estimator::bias_compensated && s.motion_noise->upper_limit);
  judge_further(corrected ? Eigen::VectorXd() : column_noise(s, fit.weights));
  if (!s.motion_noise) {
    judge_unexplained(s.model, fit.residuals, fit.excitation);
  }
  fit.noise_alone = flags(fit.excitation);
  for (std::size_t j = 0; j < excluded.size(); ++j) {
    fit.noise_alone[j] = fit.noise_alone[j] && !excluded[j];
  }
  if (flags(fit.excitation) != excluded) {
    excluded = flags(fit.excitation);
    fit_with(excluded);
    judge_further({});
  }
  if (!s.noise_complete) {
    fit.plausible = identify::largest_plausible_error(rows, fit.estimate, fit.residuals, risk);
    if (loses_often(s.survey)) {
      fit.watched = of_detectors_rows(log, s, part, fit);
    }
  }
  return fit;
}

Model without_columns(Model model, const std::vector<bool>& parameters) {
  for (Term& term : model.terms) {
    if (!parameters.empty() && parameters[term.parameter]) {
      term.scale = 0.0;
    }
  }
  return model;
}

Eigen::VectorXd best_guess(Eigen::VectorXd estimate, const std::vector<identify::ExcitationFinding>& excitation,
                           const Polytope& set) {
  for (std::size_t j = 0; j < excitation.size(); ++j) {
    if (excitation[j].state == identify::Excitation::not_excited) {
      estimate[static_cast<Eigen::Index>(j)] = set.chebyshev_centre()[j];
    }
  }
  return estimate;
}

}  // namespace wheelwright::commission
