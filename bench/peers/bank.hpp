// SPDX-License-Identifier: Apache-2.0
/// \file
/// All detectors of the study side by side on one log.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "peers/field.hpp"
#include "peers/statistic.hpp"

namespace wheelwright::peers {

/// A column of the tables: a statistic and where its limits come from.
struct Column {
  enum class Limit {
    given,         ///< the same for all
    own_driving,   ///< the largest value of all fault-free samples of that robot in that class of driving
    every_driving  ///< of that robot in all classes
  };
  std::string name;
  std::size_t statistic = 0;
  Limit limit = Limit::own_driving;
  double given = 0.0;
};

/// The statistic, and the column of the best limit in hindsight, of |ε| against a constant.
inline constexpr std::size_t kConstant = 4;

/// In the order of Bank's statistics.
[[nodiscard]] const std::vector<Column>& columns();

/// Filter and detectors of a robot for one class of driving.
class Bank {
 public:
  /// `calibration`: fault-free logs that means, standard deviations and the Kalman filters' noise are fitted to.
  Bank(const Subject& subject, const std::vector<LogTable>& calibration);

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

 private:
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
