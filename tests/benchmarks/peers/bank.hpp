// SPDX-License-Identifier: Apache-2.0
/// \file
/// All detectors of the study side by side on one log.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/benchmarks/peers/field.hpp"
#include "tests/benchmarks/peers/innovations.hpp"
#include "tests/benchmarks/peers/statistic.hpp"

namespace wheelwright::peers {

/// Logs that a peer's limits, means and noise come from.
enum class Tuning {
  given,          ///< limits that are the same for all
  own_driving,    ///< in hindsight: all fault-free samples of that robot in that class of driving
  every_driving,  ///< in hindsight: of that robot in all classes
  minute,         ///< the log of 60 s that the model was commissioned on, with a margin
  usual,          ///< other drives of the same robot (usual_logs())
  usual_margin,   ///< the same with a margin
};

/// A column of the tables: a statistic and where its limits come from.
struct Column {
  std::string name;
  std::size_t statistic = 0;
  Tuning tuning = Tuning::own_driving;
  double given = 0.0;
  std::optional<std::size_t> also{};  ///< another statistic with the same limit: either may raise the alarm

  /// True if the limits know the very samples that are judged.
  [[nodiscard]] bool hindsight() const { return tuning == Tuning::own_driving || tuning == Tuning::every_driving; }
};

/// Statistics that others refer to.
inline constexpr std::size_t kSums = 4, kConstant = 5;

/// Columns that others refer to: dead zone, sums, and both together.
inline constexpr std::size_t kDeadZoneColumn = 0, kSumsColumn = 4, kEitherColumn = 5, kConstantColumn = 6;

/// Every column: the project's own, peers tuned in hindsight, peers tuned on other logs.
[[nodiscard]] const std::vector<Column>& columns();

/// What is fitted to fault-free logs: mean and standard deviation of the residual, noise of the Kalman filters.
struct Calibration {
  std::array<double, kOutputs> mean{}, sd{};
  std::array<AxisModel, kOutputs> axes{};
};
[[nodiscard]] Calibration calibrate(const Subject& subject, const std::vector<LogTable>& logs);

/// Filter and detectors of a robot for one class of driving.
class Bank {
 public:
  /// Calibrations for own_driving, minute and usual.
  Bank(const Subject& subject, const std::array<Calibration, 3>& calibrations);

  /// Walks `log` from its beginning. After every row `at(t, values)`, with the values of all statistics one after the
  /// other, where the residuals are valid.
  template <class At>
  void walk(LogSource& log, At&& at) {
    restart();
    log.rewind();
    pick(log);
    LogBlock block;
    while (log.next(block)) {
      for (std::size_t k = 0; k < block.rows(); ++k) {
        if (step(block, k)) {
          at(block.t[k], values_);
        }
      }
    }
  }

  /// Number of values of all statistics together, and the first of statistic `i`.
  [[nodiscard]] std::size_t values() const { return values_.size(); }
  [[nodiscard]] std::size_t first(std::size_t i) const { return first_[i]; }
  /// Largest values of all statistics, with a margin (Statistic::with_margin).
  [[nodiscard]] std::vector<double> with_margin(const std::vector<double>& largest, double margin) const;

 private:
  friend Calibration calibrate(const Subject& subject, const std::vector<LogTable>& logs);
  /// The filter alone.
  explicit Bank(const Subject& subject);

  void restart();
  void pick(const LogSource& log);
  bool step(const LogBlock& block, std::size_t k);
  bool observe(const LogBlock& block, std::size_t k);

  const Subject* subject_;
  RegressorFilter filter_, statistical_filter_;
  std::vector<std::unique_ptr<Statistic>> statistics_;
  std::vector<std::size_t> first_, pick_;
  std::vector<double> sample_, values_;
  Observation now_;
};

}  // namespace wheelwright::peers
