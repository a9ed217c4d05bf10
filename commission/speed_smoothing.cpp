// SPDX-License-Identifier: Apache-2.0
#include "commission/speed_smoothing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "commission/contradiction_search.hpp"
#include "commission/evidence.hpp"
#include "commission/setting_rows.hpp"
#include "core/error.hpp"
#include "core/statistics.hpp"
#include "identify/variable_projection.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {

namespace {

using model::SpeedFilterKind;

constexpr double kFilterRisk = 1e-4;    // of an interval that misses, and of a filter that is taken for a shift's
constexpr double kLongestTime = 0.3;    // s
constexpr double kLongestShift = 0.2;   // s
constexpr double kMostSteps = 12.0;     // of slow logs; a mean over n of them is late by half as many
constexpr double kBand = 0.1;           // s, of the low-pass filter on both sides; two steps at least
constexpr double kBandSettle = 6.0;     // of it, after which the start of a segment is forgotten
constexpr double kClockSlack = 0.2;     // of a step, between a gyro's clock and the efforts'
constexpr double kInsideSearch = 0.97;  // of what is searched: its end is no answer

enum class LowPass { shift, exponential, exponential_twice, lag, mean };

// Coefficients of s, s² and s³ in the inverse transfer function, and their derivatives by the time T.
struct Series {
  std::array<double, 3> c{}, by{};
};

// κ(1 − e^{−sh}) = 1/G − 1 of y += (1 − p)(u − y), with κ = p/(1 − p), p = e^{−h/T}.
Series of_exponential(double T, double h) {
  const double grown = std::expm1(h / T), kappa = 1.0 / grown;
  const double by = (grown + 1.0) / (grown * grown) * h / (T * T);
  const std::array<double, 3> unit{h, -h * h / 2.0, h * h * h / 6.0};
  Series s;
  for (std::size_t i = 0; i < 3; ++i) {
    s.c[i] = kappa * unit[i];
    s.by[i] = by * unit[i];
  }
  return s;
}

Series series_of(LowPass candidate, double T, double h) {
  switch (candidate) {
    case LowPass::shift: return {{T, T * T / 2.0, T * T * T / 6.0}, {1.0, T, T * T / 2.0}};
    case LowPass::lag: return {{T, 0.0, 0.0}, {1.0, 0.0, 0.0}};
    case LowPass::exponential: return of_exponential(T, h);
    case LowPass::exponential_twice: {
      const auto [c, by] = of_exponential(T, h);
      return {{2.0 * c[0], 2.0 * c[1] + c[0] * c[0], 2.0 * c[2] + 2.0 * c[0] * c[1]},
              {2.0 * by[0], 2.0 * by[1] + 2.0 * c[0] * by[0], 2.0 * by[2] + 2.0 * (by[0] * c[1] + c[0] * by[1])}};
    }
    case LowPass::mean: {  // T/h rows: half of T − h late, and 1 − s²(T² − h²)/24 beside that
      const double m = 0.5 * (T - h), q = (T * T - h * h) / 24.0, dq = T / 12.0;
      return {{m, 0.5 * m * m - q, m * m * m / 6.0 - m * q}, {0.5, 0.5 * m - dq, 0.25 * m * m - 0.5 * q - m * dq}};
    }
  }
  return {};
}

// Rows behind the low-pass filter, with three derivatives; on both sides alike.
struct BandRows {
  std::array<core::RowMatrix, 4> Y;
  Eigen::VectorXd y;
  std::size_t outputs = 1;
  double step = 0.0;
};

// a ż₁ + z₁ = u and so on: z₃ and its derivatives.
template <typename Matrix>
struct Cascade {
  Matrix before, z1, z2, z3;
  void begin(const Matrix& u) { before = z1 = z2 = z3 = u; }
  // Exact for u linear over the step; z₁ and z₂ are taken so in their turn, on steps that are small against a.
  void advance(const Matrix& u, double h, double a) {
    const double decay = std::exp(-h / a), mean = (1.0 - decay) * a / h, begin = mean - decay, end = 1.0 - mean;
    const Matrix one = z1, two = z2;
    z1 = decay * z1 + begin * before + end * u;
    z2 = decay * z2 + begin * one + end * z1;
    z3 = decay * z3 + begin * two + end * z2;
    before = u;
  }
};

BandRows in_band(const RegressionBlock& rows, double step) {
  const double a = std::max(kBand, 2.0 * step);
  const auto n = static_cast<Eigen::Index>(rows.outputs);
  BandRows out;
  out.outputs = rows.outputs;
  out.step = step;
  for (auto& matrix : out.Y) {
    matrix.resize(rows.Y.rows(), rows.Y.cols());
  }
  out.y.resize(rows.Y.rows());
  Cascade<core::RowMatrix> of_Y;
  Cascade<Eigen::VectorXd> of_y;
  Eigen::Index kept = 0;
  double first = 0.0;
  for (std::size_t k = 0; k < rows.instants(); ++k) {
    const auto at = static_cast<Eigen::Index>(k) * n;
    const core::RowMatrix Y = rows.Y.middleRows(at, n);
    const Eigen::VectorXd y = rows.y.segment(at, n);
    if (k == 0 || rows.sample[k] != rows.sample[k - 1] + 1) {
      of_Y.begin(Y);
      of_y.begin(y);
      first = rows.t[k];
      continue;
    }
    const double h = rows.t[k] - rows.t[k - 1];
    of_Y.advance(Y, h, a);
    of_y.advance(y, h, a);
    if (rows.t[k] - first < kBandSettle * a) {
      continue;
    }
    out.Y[0].middleRows(kept, n) = of_Y.z3;
    out.Y[1].middleRows(kept, n) = (of_Y.z2 - of_Y.z3) / a;
    out.Y[2].middleRows(kept, n) = (of_Y.z1 - 2.0 * of_Y.z2 + of_Y.z3) / (a * a);
    out.Y[3].middleRows(kept, n) = (Y - 3.0 * of_Y.z1 + 3.0 * of_Y.z2 - of_Y.z3) / (a * a * a);
    out.y.segment(kept, n) = of_y.z3;
    kept += n;
  }
  for (auto& matrix : out.Y) {
    matrix.conservativeResize(kept, Eigen::NoChange);
  }
  out.y.conservativeResize(kept);
  return out;
}

class CandidateRows final : public identify::SeparableModel {
 public:
  CandidateRows(const BandRows& rows, LowPass candidate) : rows_(&rows), candidate_(candidate) {}
  [[nodiscard]] const Eigen::VectorXd& response() const override { return rows_->y; }
  [[nodiscard]] std::size_t outputs() const override { return rows_->outputs; }
  [[nodiscard]] Eigen::Index shapes() const override { return 1; }
  [[nodiscard]] Eigen::Index columns() const override { return rows_->Y[0].cols(); }
  bool evaluate(const Eigen::VectorXd& shape, bool derivatives, identify::SeparableValues& at) const override {
    const auto& Y = rows_->Y;
    const auto [c, by] = series_of(candidate_, shape[0], rows_->step);
    at.offset.resize(0);
    at.offset_by.clear();
    at.columns = Y[0] + c[0] * Y[1] + c[1] * Y[2] + c[2] * Y[3];
    at.columns_by.resize(derivatives ? 1 : 0);
    if (derivatives) {
      at.columns_by[0] = by[0] * Y[1] + by[1] * Y[2] + by[2] * Y[3];
    }
    return true;
  }

 private:
  const BandRows* rows_;
  LowPass candidate_;
};

struct Tried {
  LowPass candidate;
  identify::SeparableFit fit;
};

std::optional<Tried> attempt_filter(const BandRows& rows, LowPass candidate, const Eigen::VectorXd& weights) {
  const CandidateRows model(rows, candidate);
  const bool shift = candidate == LowPass::shift;
  const double lower = candidate == LowPass::mean ? rows.step : shift ? 0.0 : 0.1 * rows.step;
  const double upper =
      shift ? std::max(kLongestShift, kMostSteps / 2.0 * rows.step) : std::max(kLongestTime, kMostSteps * rows.step);
  identify::VariableProjectionOptions options;
  options.lower = Eigen::VectorXd::Constant(1, lower);
  options.upper = Eigen::VectorXd::Constant(1, upper);
  options.weights = weights;
  options.flat = 1e-6;
  Tried tried{candidate, identify::variable_projection(model, options)};
  const identify::SeparableFit& fit = tried.fit;
  if (fit.end != identify::SearchEnd::converged || fit.state[0] != identify::ShapeState::identified ||
      fit.shape[0] > kInsideSearch * upper) {
    return std::nullopt;
  }
  return tried;
}

// y = (1 + c₁D + c₂D² + c₃D³) Yθ with c₁ and c₂ free: what a family of filters is without its law between the two.
class FreeRows final : public identify::SeparableModel {
 public:
  FreeRows(const BandRows& rows, double third) : rows_(&rows), third_(third) {}
  [[nodiscard]] const Eigen::VectorXd& response() const override { return rows_->y; }
  [[nodiscard]] std::size_t outputs() const override { return rows_->outputs; }
  [[nodiscard]] Eigen::Index shapes() const override { return 2; }
  [[nodiscard]] Eigen::Index columns() const override { return rows_->Y[0].cols(); }
  bool evaluate(const Eigen::VectorXd& shape, bool derivatives, identify::SeparableValues& at) const override {
    const auto& Y = rows_->Y;
    at.offset.resize(0);
    at.offset_by.clear();
    at.columns = Y[0] + shape[0] * Y[1] + shape[1] * Y[2] + third_ * Y[3];
    at.columns_by.clear();
    if (derivatives) {
      at.columns_by = {Y[1], Y[2]};
    }
    return true;
  }

 private:
  const BandRows* rows_;
  double third_;
};

// What the rows tell of a filter and a constant shift.
enum class Told { neither, filter, shift };

// Wald's test of both laws, c₂ = c₁²/2 of a shift and that of `best`, in the model that has c₁ and c₂ free.
Told told_apart(const BandRows& rows, const Tried& best, const Eigen::VectorXd& weights) {
  constexpr double kMuchNearer = 3.0;  // where neither law holds exactly
  const Series series = series_of(best.candidate, best.fit.shape[0], rows.step);
  identify::VariableProjectionOptions options;
  options.start.resize(2);
  options.start << series.c[0], series.c[1];
  options.weights = weights;
  options.flat = 1e-6;
  const identify::SeparableFit fit = identify::variable_projection(FreeRows(rows, series.c[2]), options);
  if (fit.end != identify::SearchEnd::converged || fit.state[0] != identify::ShapeState::identified ||
      fit.state[1] != identify::ShapeState::identified) {
    return Told::neither;
  }
  const double c = fit.shape[0];
  const auto& covariance = fit.covariance;
  const auto error = [&](double slope) {
    return std::sqrt(covariance(1, 1) - 2.0 * slope * covariance(0, 1) + slope * slope * covariance(0, 0));
  };
  const double certain = core::student_quantile(1.0 - kFilterRisk, std::max(fit.freedom, 1.0));
  const double of_shift = std::abs(fit.shape[1] - 0.5 * c * c);
  const double slope = series.by[0] != 0.0 ? series.by[1] / series.by[0] : 0.0;
  const double of_filter = std::abs(fit.shape[1] - series.c[1] - slope * (c - series.c[0]));
  const bool no_shift = of_shift > certain * error(c), no_filter = of_filter > certain * error(slope);
  return no_shift && kMuchNearer * of_filter < of_shift    ? Told::filter
         : no_filter && kMuchNearer * of_shift < of_filter ? Told::shift
                                                           : Told::neither;
}

model::SpeedFilter filter_of(LowPass candidate) {
  return {.kind = candidate == LowPass::lag    ? SpeedFilterKind::lag
                  : candidate == LowPass::mean ? SpeedFilterKind::mean
                                               : SpeedFilterKind::exponential,
          .order = candidate == LowPass::exponential_twice ? 2 : 1,
          .found = true};
}

// The interval of T about `time`; a mean is of a whole number of rows.
Interval interval_about(const model::SpeedFilter& filter, bool exact, double time, double reach, double step) {
  Interval interval{std::max(time - reach, 0.1 * time), time + reach};
  if (filter.kind == SpeedFilterKind::mean && exact) {
    const double rows = std::round(time / step), least = std::ceil(interval.lower / step);
    if (std::abs(time - rows * step) <= std::max(reach, 0.25 * step)) {
      interval = least < std::floor(interval.upper / step)
                     ? Interval{least * step, std::floor(interval.upper / step) * step}
                     : Interval{rows * step, rows * step};
    }
  }
  return interval;
}

// What explains rows best.
struct Found {
  Tried best, shift, mean;
  Told told = Told::neither;
};

std::optional<Found> find_low_pass(const BandRows& rows, const Eigen::VectorXd& weights) {
  if (rows.y.size() < static_cast<Eigen::Index>(kFewestInstants * rows.outputs)) {
    return std::nullopt;
  }
  auto shift = attempt_filter(rows, LowPass::shift, weights), mean = attempt_filter(rows, LowPass::mean, weights);
  if (!shift || !mean) {
    return std::nullopt;
  }
  Tried best = *mean;
  for (const LowPass candidate : {LowPass::exponential, LowPass::lag, LowPass::exponential_twice}) {
    auto tried = attempt_filter(rows, candidate, weights);
    if (tried && tried->fit.weighted_rss < best.fit.weighted_rss) {
      best = std::move(*tried);
    }
  }
  const Told told = told_apart(rows, best, weights);
  return Found{std::move(best), std::move(*shift), std::move(*mean), told};
}

// The gyro by the wheels' yaw rate, in place of efforts by motion; nothing where there is none.
std::optional<BandRows> gyro_band(LogSource& log, const Setting& s, std::size_t most_rows) {
  if (!model::on_two_wheels(s.robot) || s.model.heading_coordinate < 0 || !log.find("gyro_z")) {
    return std::nullopt;
  }
  const Eigen::RowVectorXd yaw = s.model.motion.row(s.model.heading_coordinate);
  std::vector<std::string> columns = s.measurement.motion_columns;
  columns.emplace_back("gyro_z");
  RegressionBlock rows;
  rows.resize(std::min(most_rows, s.survey.rows), 1, 2);
  std::size_t count = 0, number = 0;
  core::for_each_sample(log, columns, [&](const core::LogSample& sample) {
    number += sample.starts ? 2 : 1;  // a segment does not follow on the last
    if (count == rows.instants()) {
      return;
    }
    const auto at = static_cast<Eigen::Index>(count);
    rows.sample[count] = number;
    rows.t[count] = sample.t;
    rows.Y(at, 0) = 0.0;
    for (Eigen::Index j = 0; j < yaw.size(); ++j) {
      rows.Y(at, 0) += yaw[j] * sample.values[static_cast<std::size_t>(j)];
    }
    rows.Y(at, 1) = 1.0;
    rows.y[at] = sample.values.back();
    ++count;
  });
  return in_band(rows, s.survey.median_step);
}

// Lateness c₁ of a fit, s, with its standard error.
std::pair<double, double> lateness(const Tried& tried, double step) {
  const Series series = series_of(tried.candidate, tried.fit.shape[0], step);
  return {series.c[0], std::abs(series.by[0]) * tried.fit.standard_error[0]};
}

}  // namespace

std::optional<SpeedSmoothing> speed_smoothing(LogSource& log, const Setting& s, const Fit& fit, std::size_t most_rows) {
  if (s.measurement.motion == MotionKind::angle || s.measurement.effort_unsigned || !s.measurement.correction.empty()) {
    return std::nullopt;
  }
  Setting wide = s;
  wide.measurement.delay = {0.0, 0.0};
  wide.robot.parameters = model::possible_parameters(s.robot);
  wide.model = model::make_model(wide.robot);
  TorqueRows stream = make_rows(log, wide, errors_of_fit(wide));
  const RegressionBlock block = first_rows(stream, most_rows);
  log.rewind();
  const double step = s.survey.median_step;
  try {
    const auto found = find_low_pass(in_band(block, step), fit.weights);
    if (!found) {
      return std::nullopt;
    }
    SpeedSmoothing out;
    if (found->told == Told::shift) {
      return std::nullopt;
    }
    out.told = found->told == Told::filter;
    out.delay = found->shift.fit.shape[0];
    out.steps = out.delay / s.survey.median_step;
    for (std::size_t j = 0; j < s.model.p(); ++j) {
      if (fit.excitation[j].state == identify::Excitation::identified) {
        const auto at = static_cast<Eigen::Index>(j);
        const double other = std::abs(found->best.fit.linear[at] - found->shift.fit.linear[at]);
        out.differs = std::max(out.differs, other / std::abs(found->best.fit.linear[at]));
      }
    }
    // c₂/c₁² is 0 to 1/4 of exponential filters, 1/2 of a shift: a mean is between them.
    const Tried* taken = out.told ? &found->best : &found->mean;
    const double certain = core::student_quantile(1.0 - kFilterRisk, std::max(taken->fit.freedom, 1.0));
    for (std::size_t j = 0; j < wide.model.p(); ++j) {
      const auto at = static_cast<Eigen::Index>(j);
      out.dry_friction = out.dry_friction || (wide.model.parameters[j].dry_friction &&
                                              taken->fit.linear[at] > certain * taken->fit.standard_error[at + 1]);
    }
    std::optional<Found> by_gyro;
    if (const auto band = gyro_band(log, s, most_rows)) {
      by_gyro = find_low_pass(*band, Eigen::VectorXd::Ones(1));
    }
    if (by_gyro) {
      const auto [late, error] = lateness(by_gyro->best, step);
      const auto [of_efforts, its_error] = lateness(found->best, step);
      if (std::abs(late - of_efforts) < certain * std::hypot(error, its_error) + kClockSlack * step) {
        if (by_gyro->told == Told::shift) {
          return std::nullopt;
        }
        out.gyro_agrees = true;
        if (by_gyro->told == Told::filter) {
          out.told = true;
          taken = &by_gyro->best;
        }
      }
    }
    out.filter = filter_of(taken->candidate);
    out.time = taken->fit.shape[0];
    out.standard_error = taken->fit.standard_error[0];
    out.filter.time = interval_about(out.filter, out.told, out.time, certain * out.standard_error, step);
    return out;
  } catch (const InvalidArgument&) {
    return std::nullopt;
  }
}

std::string declaration(const model::SpeedFilter& filter) {
  return fmt::format("speed_filter: {{kind: {}{}, time: [{:.4g}, {:.4g}]}}", to_string(filter.kind),
                     filter.order == 2 ? ", order: 2" : "", filter.time.lower, filter.time.upper);
}

std::optional<SpeedSmoothing> smoothing_behind(LogSource& log, const Setting& s, const Fit& fit,
                                               const EffortTiming& timing) {
  constexpr double kAboutHalf = 0.1, kErrors = 2.0;  // of a step, interpolation's own; standard errors beside that
  if (!(timing.delay < 0.0)) {
    return std::nullopt;
  }
  auto smoothing = speed_smoothing(log, s, fit);
  // Measured efforts that are held commands are early by half a step.
  const double step = s.survey.median_step;
  const bool held = s.measurement.hold == Hold::first_order &&
                    std::abs(timing.delay + 0.5 * step) < kAboutHalf * step + kErrors * timing.standard_error;
  return smoothing && held && !smoothing->told ? std::nullopt : smoothing;
}

std::string late_speeds(const SpeedSmoothing& smoothing) {
  const std::string dry =
      smoothing.dry_friction ? "; the log shows dry friction too, whose sign does not pass through a filter" : "";
  if (!smoothing.told) {
    constexpr double kAboutHalf = 0.15;
    const bool half_a_step = std::abs(smoothing.steps - 0.5) < kAboutHalf;
    return fmt::format(
        "the efforts come {:.3g} ms before the motion: the driver smooths the speeds{}, the actuators are slow to "
        "follow, or clocks differ, which this log does not tell apart and which moves parameters by {:.2g} %{}",
        1e3 * smoothing.delay,
        half_a_step ? " or takes them from differences of angles, stamped at their end (that is half a step)" : "",
        100.0 * smoothing.differs, dry);
  }
  const std::string time =
      fmt::format("{:.3g} ± {:.1g} ms (95 %)", 1e3 * smoothing.time, 2e3 * smoothing.standard_error);
  const std::string what = smoothing.filter.kind == SpeedFilterKind::mean
                               ? fmt::format("a moving mean over {}", time)
                               : fmt::format("a low-pass filter of {} order with a time constant of {}",
                                             smoothing.filter.order == 2 ? "second" : "first", time);
  return fmt::format(
      "the speeds follow the efforts as through {}, which a constant delay (the best, {:.3g} ms, moves parameters by "
      "{:.2g} %) does not explain: {}{}",
      what, 1e3 * smoothing.delay, 100.0 * smoothing.differs,
      smoothing.gyro_agrees ? "the driver smooths the speeds, as the gyro shows too"
                            : "the driver smooths the speeds, or the actuators are slow to follow",
      dry);
}

std::string way_out(const SpeedSmoothing& smoothing) {
  return fmt::format(
      "log angles, or speeds that are not smoothed{}",
      smoothing.dry_friction
          ? ""
          : fmt::format("; or write `{}` into the robot file, with what is known of the filter, and efforts pass "
                        "through it too{}",
                        declaration(smoothing.filter),
                        smoothing.told ? "; a delay declared instead makes the parameters wrong"
                                       : "; `effort: {delay: …}` only where the clocks are known to differ"));
}

}  // namespace wheelwright::commission
