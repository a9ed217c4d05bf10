// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/peers/bank.hpp"

#include <cmath>

#include "tests/benchmarks/peers/confidence_threshold.hpp"
#include "tests/benchmarks/peers/constant_threshold.hpp"
#include "tests/benchmarks/peers/cusum.hpp"
#include "tests/benchmarks/peers/scale_sums.hpp"
#include "tests/benchmarks/peers/tight_threshold.hpp"

namespace wheelwright::peers {
namespace {

constexpr double kChiWindow = 0.5;  // s
constexpr std::size_t kUnsettled = 50;
constexpr std::size_t kMostFitted = 20'000;                // rows that the Kalman filters' noise is fitted to: enough
constexpr std::size_t kLeastSquares = 6, kCalibrated = 7;  // statistics; four for each calibration from there on

// Rows of the calibration as the Kalman filter of one coordinate sees them.
struct AxisLog {
  std::vector<double> t, position, effort;
};

// Noise of largest likelihood on a grid of multiples of what the sensors have.
AxisModel most_likely(const AxisModel& start, Hold hold, const std::vector<AxisLog>& logs) {
  AxisModel best = start;
  double least = std::numeric_limits<double>::infinity();
  for (const double position : {0.5, 1.0, 2.0, 4.0, 10.0}) {
    for (int half_decades = 0; half_decades <= 16; ++half_decades) {
      AxisModel trial = start;
      trial.position_variance *= position;
      trial.effort_variance *= std::pow(10.0, 0.5 * half_decades);
      Likelihood likelihood(trial, hold, kUnsettled);
      for (const AxisLog& log : logs) {
        likelihood.restart();
        for (std::size_t k = 0; k < log.t.size(); ++k) {
          likelihood.add(log.t[k], log.position[k], log.effort[k]);
        }
      }
      if (likelihood.deviance() < least) {
        least = likelihood.deviance();
        best = trial;
      }
    }
  }
  return best;
}

}  // namespace

const std::vector<Column>& columns() {
  static const std::vector<Column> all = [] {
    using enum Tuning;
    std::vector<Column> list = {{"tight, polytope", 0, given, 0.5},
                                {"tight, box", 1, given, 0.5},
                                {"tight, ρ", 2, given, 0.5},
                                {"tight, statistical noise", 3, given, 0.5},
                                {"sums (one false alarm in ten years)", kSums, given, 0.5},
                                {"dead zone or sums", 0, given, 0.5, kSums},
                                {"constant", kConstant, own_driving},
                                {"constant, all driving", kConstant, every_driving}};
    const std::array<std::string, 4> calibrated = {"CUSUM 0.5", "CUSUM 2", "χ²", "χ², 0.5 s"};
    const auto add_calibrated = [&](std::size_t calibration, Tuning tuning) {
      for (std::size_t i = 0; i < calibrated.size(); ++i) {
        list.push_back({calibrated[i], kCalibrated + calibration * calibrated.size() + i, tuning});
      }
    };
    add_calibrated(0, own_driving);
    list.push_back({"LS, tuned", kLeastSquares, own_driving});
    list.push_back({"LS, z = 4", kLeastSquares, given, 4.0});
    for (const Tuning tuning : {minute, usual, usual_margin}) {
      list.push_back({"constant", kConstant, tuning});
      add_calibrated(tuning == minute ? 1 : 2, tuning);
      list.push_back({"LS", kLeastSquares, tuning});
    }
    return list;
  }();
  return all;
}

Calibration calibrate(const Subject& subject, const std::vector<LogTable>& logs) {
  Bank bank(subject);
  Calibration result;
  std::array<double, kOutputs> square{};
  std::array<std::vector<AxisLog>, kOutputs> axes;
  double count = 0.0;
  std::size_t rows = 0;
  for (const LogTable& table : logs) {
    TableSource log(table);
    bank.restart();
    bank.pick(log);
    for (auto& each : axes) {
      each.emplace_back();
    }
    LogBlock block;
    while (log.next(block)) {
      for (std::size_t k = 0; k < block.rows(); ++k, ++rows) {
        const bool valid = bank.observe(block, k);
        const Observation& now = bank.now_;
        count += valid ? 1.0 : 0.0;
        for (std::size_t i = 0; i < kOutputs; ++i) {
          result.mean[i] += valid ? now.residual[i] : 0.0;
          square[i] += valid ? now.residual[i] * now.residual[i] : 0.0;
          if (rows < kMostFitted) {
            AxisLog& axis = axes[i].back();
            axis.t.push_back(now.t);
            axis.position.push_back(now.position[i]);
            axis.effort.push_back(now.effort[i]);
          }
        }
      }
    }
  }
  const OnlineModel& m = subject.model;
  for (std::size_t i = 0; i < kOutputs; ++i) {
    result.mean[i] /= count;
    result.sd[i] = std::sqrt(square[i] / count - result.mean[i] * result.mean[i]);
    const auto row = static_cast<Eigen::Index>(i);
    // θ_L = r·[m, I, f1, f3].
    const AxisModel start = {m.estimate[row], m.estimate[row + 2],
                             m.model.input.row(row).squaredNorm() * subject.torque_sd * subject.torque_sd,
                             m.model.motion.row(row).squaredNorm() * subject.angle_sd * subject.angle_sd};
    result.axes[i] = most_likely(start, m.measurement.hold, axes[i]);
  }
  return result;
}

Bank::Bank(const Subject& subject)
    : subject_(&subject),
      filter_(subject.model.model, subject.model.filter, subject.model.measurement, subject.model.errors),
      statistical_filter_(subject.model.model, subject.model.filter, subject.model.measurement,
                          subject.statistical.errors) {}

Bank::Bank(const Subject& subject, const std::array<Calibration, 3>& calibrations) : Bank(subject) {
  const OnlineModel& m = subject.model;
  const auto window = static_cast<std::size_t>(std::lround(kChiWindow * subject.scenario.rate));
  using Kind = TightThreshold::Kind;
  statistics_.push_back(std::make_unique<TightThreshold>(subject.rule(), Kind::two_sided));
  statistics_.push_back(
      std::make_unique<TightThreshold>(subject.rule(detector::ParameterSetKind::box), Kind::two_sided));
  statistics_.push_back(std::make_unique<TightThreshold>(subject.rule(), Kind::symmetric));
  statistics_.push_back(std::make_unique<TightThreshold>(subject.statistical_rule(), Kind::statistical));
  statistics_.push_back(std::make_unique<ScaleSums>(m));
  statistics_.push_back(std::make_unique<ConstantThreshold>());
  statistics_.push_back(std::make_unique<ConfidenceThreshold>(subject.covariance, subject.variance));
  for (const Calibration& each : calibrations) {
    statistics_.push_back(std::make_unique<Cusum>(each.mean, each.sd, 0.5));
    statistics_.push_back(std::make_unique<Cusum>(each.mean, each.sd, 2.0));
    statistics_.push_back(std::make_unique<Innovations>(each.axes, m.measurement.hold, 1));
    statistics_.push_back(std::make_unique<Innovations>(each.axes, m.measurement.hold, window));
  }
  std::size_t total = 0;
  for (const auto& statistic : statistics_) {
    first_.push_back(total);
    total += statistic->size();
  }
  first_.push_back(total);
  values_.resize(total);
}

std::vector<double> Bank::with_margin(const std::vector<double>& largest, double margin) const {
  std::vector<double> limits(largest.size());
  for (std::size_t s = 0; s < statistics_.size(); ++s) {
    for (std::size_t v = first_[s]; v < first_[s + 1]; ++v) {
      limits[v] = statistics_[s]->with_margin(largest[v], margin);
    }
  }
  return limits;
}

void Bank::restart() {
  filter_.restart();
  statistical_filter_.restart();
  for (const auto& statistic : statistics_) {
    statistic->restart();
  }
}

void Bank::pick(const LogSource& log) {
  pick_.clear();
  for (const std::string& name : subject_->model.measurement.columns()) {
    pick_.push_back(log.find(name).value());
  }
  sample_.resize(pick_.size());
}

bool Bank::observe(const LogBlock& block, std::size_t k) {
  for (std::size_t c = 0; c < pick_.size(); ++c) {
    sample_[c] = block.columns[pick_[c]][k];
  }
  const OnlineModel& m = subject_->model;
  now_.t = block.t[k];
  now_.sample = sample_;
  now_.valid = filter_.step(now_.t, sample_);
  statistical_filter_.step(now_.t, sample_);
  now_.row = &filter_.row();
  now_.statistical = &statistical_filter_.row();
  for (std::size_t i = 0; i < kOutputs; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    now_.position[i] = m.model.motion(row, 0) * sample_[0] + m.model.motion(row, 1) * sample_[1];
    now_.effort[i] = m.model.input(row, 0) * sample_[2] + m.model.input(row, 1) * sample_[3];
    if (now_.valid) {
      now_.residual[i] = now_.row->y[row] - now_.row->Y.row(row).dot(m.estimate);
    }
  }
  return now_.valid;
}

bool Bank::step(const LogBlock& block, std::size_t k) {
  observe(block, k);
  for (std::size_t s = 0; s < statistics_.size(); ++s) {
    statistics_[s]->step(now_, std::span(values_).subspan(first_[s], statistics_[s]->size()));
  }
  return now_.valid;
}

}  // namespace wheelwright::peers
