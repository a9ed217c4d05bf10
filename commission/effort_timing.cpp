// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/QR>

#include "commission/contradiction_search.hpp"
#include "commission/evidence.hpp"
#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "commission/setting_rows.hpp"
#include "core/error.hpp"
#include "identify/least_squares.hpp"
#include "identify/moments.hpp"
#include "identify/time_shift.hpp"
#include "identify/variable_projection.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {

namespace {

constexpr double kMovesParameter = 2.0;  // standard errors
constexpr double kLowersResidual = 0.99;
constexpr double kMirror = 1.001;  // a true shift is worse than none with its sign turned

// The rows of `model` shifted by `shift`, weighted: θ, its residual, and what a further shift adds beyond θ. Nothing
// outside of the shifts that the model is searched for.
struct Shifted {
  Eigen::VectorXd theta, residual, more;
};

std::optional<Shifted> at_shift(const identify::TimeShiftedRows& model, double shift, const Eigen::VectorXd& weights) {
  identify::SeparableValues at;
  if (!model.evaluate(Eigen::VectorXd::Constant(1, shift), true, at)) {
    return std::nullopt;
  }
  Eigen::VectorXd y = model.response();
  for (Eigen::Index r = 0; r < y.size(); ++r) {
    const double w = weights[r % weights.size()];
    at.columns.row(r) *= w;
    at.columns_by[0].row(r) *= w;
    y[r] *= w;
  }
  const auto qr = at.columns.colPivHouseholderQr();
  Shifted out{.theta = qr.solve(y), .residual = {}, .more = {}};
  out.residual = y - at.columns * out.theta;
  out.more = at.columns_by[0] * out.theta;
  out.more -= at.columns * qr.solve(out.more);
  return out;
}

// The score of a further shift at `from`, as a multiple of what is certain by the residual at `to`. A shift that one
// ramp alone shows is known by one look at the noise there; by noise that is the same on the whole log, it is known
// well.
double score_of(const Shifted& from, const Shifted& to, Eigen::Index outputs) {
  identify::BlockSums scores(1), squares(1), errors(static_cast<std::size_t>(outputs));
  Eigen::VectorXd sizes = Eigen::VectorXd::Zero(outputs);
  for (Eigen::Index k = 0; k < from.more.size(); k += outputs) {
    const auto more = from.more.segment(k, outputs), error = to.residual.segment(k, outputs);
    scores.add(Eigen::VectorXd::Constant(1, more.dot(error)));
    squares.add(Eigen::VectorXd::Constant(1, more.squaredNorm()));
    errors.add(error);
    sizes += more.cwiseAbs2();
  }
  const identify::LongRunCovariance seen = identify::long_run_covariance(scores);
  const Eigen::VectorXd of_sums = identify::long_run_covariance(errors).matrix.diagonal();
  const std::size_t instants = from.more.size() / outputs;
  const double stationary = std::max(seen.matrix(0, 0), of_sums.dot(sizes) / static_cast<double>(instants));
  const double limit =
      std::min(certain(identify::effective_freedom(squares.blocks().row(0), static_cast<std::size_t>(seen.freedom))) *
                   std::sqrt(seen.matrix(0, 0)),
               certain(seen.freedom) * std::sqrt(stationary));
  return limit > 0.0 ? from.more.dot(from.residual) / limit : 0.0;
}

// `rows` averaged over `reach` instants to either side, with weights that fall to zero, where there are as many. Rows
// between two instants are interpolated, which averages the noise of the two: of noise that hardly changes from one
// instant to the next nothing is lost by that, and no shift is made to look better than none.
RegressionBlock averaged(const RegressionBlock& rows, std::size_t reach) {
  const std::size_t many = 2 * reach + 1;
  std::vector<double> weight(many);
  for (std::size_t k = 0; k < many; ++k) {
    weight[k] = static_cast<double>(std::min(k + 1, many - k)) / static_cast<double>((reach + 1) * (reach + 1));
  }
  std::vector<std::size_t> first;
  for (std::size_t k = 0; k + many <= rows.instants(); ++k) {
    if (rows.sample[k + many - 1] - rows.sample[k] == many - 1) {
      first.push_back(k);
    }
  }
  RegressionBlock means;
  means.resize(first.size(), rows.outputs, rows.parameters);
  means.dY.setZero();
  means.dy.setZero();
  const auto n = static_cast<Eigen::Index>(rows.outputs);
  for (std::size_t i = 0; i < first.size(); ++i) {
    const auto to = static_cast<Eigen::Index>(i) * n;
    means.sample[i] = rows.sample[first[i] + reach];
    means.t[i] = 0.0;
    means.Y.middleRows(to, n).setZero();
    means.y.segment(to, n).setZero();
    for (std::size_t k = 0; k < many; ++k) {
      const auto from = static_cast<Eigen::Index>(first[i] + k) * n;
      means.t[i] += weight[k] * rows.t[first[i] + k];
      means.Y.middleRows(to, n) += weight[k] * rows.Y.middleRows(from, n);
      means.y.segment(to, n) += weight[k] * rows.y.segment(from, n);
    }
  }
  return means;
}

// Instants to either side that rows are averaged over: within the memory of the filter, in which little changes.
std::size_t averaged_over(const Setting& s) {
  constexpr double kMost = 5.0, kOfMemory = 0.25;
  return static_cast<std::size_t>(std::min(kMost, kOfMemory / (s.filter.beta * s.survey.median_step)));
}

// The rows as logged, without bounds on their errors; nothing where they are too few, or efforts have no sign.
std::optional<RegressionBlock> rows_as_logged(LogSource& log, const Setting& s, std::size_t most_rows) {
  if (s.measurement.effort_unsigned) {
    return std::nullopt;
  }
  Setting as_logged = s;  // a declared delay is compared with what is found, not taken away before
  as_logged.measurement.delay = {0.0, 0.0};
  TorqueRows stream = make_rows(log, as_logged, errors_of_fit(s));
  RegressionBlock rows = averaged(first_rows(stream, most_rows), averaged_over(s));
  log.rewind();
  return rows.instants() < kFewestInstants ? std::nullopt : std::optional(std::move(rows));
}

}  // namespace

Interval allowed_shift(const Measurement& m, double step) {
  Interval allowed = m.delay;
  const Interval sharpening = m.sharpening();  // its middle is taken
  const double open = 0.5 * step * (sharpening.upper - sharpening.lower);
  allowed.lower -= open;
  allowed.upper += open;
  const bool held = m.hold == Hold::zero_order;
  // As the rows' own hull, which those of a set have whatever the noise is: a value may come into force up to a step
  // before its stamp; a measured one lies between two.
  if (allowed != Interval{} || (held && m.changes == model::EffortChanges::between)) {
    allowed.upper += step;
    allowed.lower -= held ? 0.0 : step;
  }
  return allowed;
}

std::optional<EffortTiming> effort_timing(LogSource& log, const Setting& s, const Fit& fit, double longest,
                                          std::size_t most_rows) {
  const std::optional<RegressionBlock> rows = rows_as_logged(log, s, most_rows);
  if (!rows) {
    return std::nullopt;
  }
  const Interval declared = s.measurement.delay;
  const double reach = longest + core::magnitude(declared);  // its sign may be mistaken
  try {
    const identify::TimeShiftedRows model(*rows, identify::TimeEffect::delay, -reach, reach);
    identify::VariableProjectionOptions options = model.options();
    options.weights = fit.weights;
    options.flat = 1e-6;  // what is left of the way is for the last steps, on the gradient alone
    options.scan = 1 + static_cast<int>(std::ceil((options.scan - 1) * reach / longest));
    const identify::SeparableFit found = identify::variable_projection(model, options);
    constexpr double kInside = 0.97;  // of the range that is searched: its end is no answer
    if (found.end != identify::SearchEnd::converged || found.state[0] != identify::ShapeState::identified ||
        std::abs(found.shape[0]) > kInside * reach) {
      return std::nullopt;
    }
    EffortTiming timing{.delay = found.shape[0], .standard_error = found.standard_error[0], .freedom = found.freedom};
    timing.allowed = allowed_shift(s.measurement, s.survey.median_step);
    const double chance = errors_at(kRiskOfDoubt, timing.freedom) * timing.standard_error;
    timing.open = {std::max(timing.delay - chance, -reach), std::min(timing.delay + chance, reach)};
    for (std::size_t end = 0; end < 2; ++end) {
      const double shift = end == 0 ? timing.open.lower : timing.open.upper;
      const double nearest = std::clamp(shift, timing.allowed.lower, timing.allowed.upper);
      if (std::abs(shift - nearest) <= kLeastShift * s.survey.median_step) {
        continue;
      }
      const auto taken = at_shift(model, nearest, fit.weights), shifted = at_shift(model, shift, fit.weights);
      if (taken && shifted) {
        timing.open_change[end] = shifted->theta - taken->theta;
      }
    }
    if (timing.beyond() == 0.0) {
      return timing;
    }
    const double nearest = std::clamp(timing.delay, timing.allowed.lower, timing.allowed.upper);
    const double mirror = std::clamp(2.0 * nearest - timing.delay, -reach, reach);
    const auto taken = at_shift(model, nearest, fit.weights), shifted = at_shift(model, timing.delay, fit.weights),
               mirrored = at_shift(model, mirror, fit.weights);
    if (!taken || !shifted) {
      return std::nullopt;
    }
    const double without = taken->residual.norm();
    timing.residual_ratio = without > 0.0 ? std::sqrt(found.weighted_rss) / without : 1.0;
    timing.mirror_ratio = without > 0.0 && mirrored ? mirrored->residual.norm() / without : 1.0;
    timing.score = score_of(*taken, *shifted, static_cast<Eigen::Index>(s.model.n()));
    const Eigen::VectorXd moved = (found.linear - taken->theta).cwiseAbs();
    for (std::size_t j = 0; j < s.model.p(); ++j) {
      const auto at = static_cast<Eigen::Index>(j);
      const double error = fit.residuals.standard_error[at];
      if (fit.excitation[j].state == identify::Excitation::identified && error > 0.0) {
        timing.moved = std::max(timing.moved, moved[at] / error);
      }
    }
    return timing;
  } catch (const InvalidArgument&) {
    return std::nullopt;  // segments shorter than the longest shift
  }
}

double told_shift(const EffortTiming& timing, double step) {
  constexpr double kNearlyAlways = 2.0;  // standard errors
  return std::max(kLeastShift * step, certain(timing.freedom) * timing.standard_error) +
         kNearlyAlways * timing.standard_error;
}

bool is_latency(const EffortTiming& timing, double step) {
  const double shift = timing.beyond(), score = timing.delay < timing.allowed.lower ? -timing.score : timing.score;
  return shift > kLeastShift * step && shift > certain(timing.freedom) * timing.standard_error && score > 1.0 &&
         timing.mirror_ratio > kMirror && (timing.residual_ratio < kLowersResidual || timing.moved > kMovesParameter);
}

bool looks_shifted(const EffortTiming& timing, double step) {
  constexpr double kLikely = 2.0;  // standard errors
  return timing.beyond() > std::max(kLeastShift * step, kLikely * timing.standard_error);
}

bool may_be_latency(const EffortTiming& timing, double step) {
  const double needed = errors_at(kRiskOfDoubt, timing.freedom);
  const double score = timing.delay < timing.allowed.lower ? -timing.score : timing.score;
  return timing.beyond() > kLeastShift * step && timing.beyond() > needed * timing.standard_error &&
         score * certain(timing.freedom) > needed && timing.mirror_ratio > 1.0;
}

}  // namespace wheelwright::commission
