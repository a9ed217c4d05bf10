// SPDX-License-Identifier: Apache-2.0
#include "commission/at_risk/risk_reach.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "commission/physical.hpp"
#include "core/limits.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/multiscale/sum_margins.hpp"
#include "detector/multiscale/sum_response.hpp"
#include "model/filter/regressor_filter.hpp"

namespace wheelwright::commission {
namespace {

constexpr std::size_t kMostRows = 60000;  // of the log that are held

// The fault that a sum's weights are like.
model::FaultType fault_like(const detector::SumWeight& weight, const OnlineModel& model,
                            const std::vector<model::FaultType>& catalogue) {
  using Shape = detector::SumWeight::Shape;
  if (weight.shape == Shape::parameter) {
    Eigen::VectorXd theta = Eigen::VectorXd::Zero(model.estimate.size());
    theta[static_cast<Eigen::Index>(weight.which)] = model.estimate[static_cast<Eigen::Index>(weight.which)];
    return {.name = weight.name, .unit = "1", .range = {0.0, 100.0}, .theta = theta};
  }
  const std::string name = weight.shape == Shape::constant ? "effort_bias" : "effort_loss";
  std::size_t joint = 0;
  for (const model::FaultType& fault : catalogue) {
    if (fault.name.starts_with(name) && joint++ == weight.which) {
      return fault;
    }
  }
  return model::find_fault(catalogue, name);
}

}  // namespace

LogTable beginning_of(LogSource& log, const std::vector<std::string>& columns, double most) {
  LogTable table{columns, {}, {}, {}};
  const std::vector<std::size_t> pick = core::positions_of(log, table.names);
  table.columns.resize(pick.size());
  LogBlock block;
  log.rewind();
  bool done = false;
  while (!done && log.next(block)) {
    for (std::size_t k = 0; k < block.rows() && !done; ++k) {
      const bool starts = std::ranges::binary_search(block.segment_starts, k);
      done = table.rows() == kMostRows || (table.rows() > 0 && (starts || block.t[k] - table.t.front() > most));
      if (done) {
        break;
      }
      table.t.push_back(block.t[k]);
      for (std::size_t c = 0; c < pick.size(); ++c) {
        table.columns[c].push_back(block.columns[pick[c]][k]);
      }
    }
  }
  log.rewind();
  return table;
}

std::vector<RiskReach> risk_reach(LogSource& log, const OnlineModel& model, const RiskReachOptions& options) {
  const LogTable table = beginning_of(log, model.measurement.columns(), options.most);
  TableSource source(table);
  const detector::ReferenceMotion motion =
      detector::read_reference(source, RegressorFilter(model.model, model.filter, model.measurement, model.errors));
  const std::optional<detector::SumDrive> drive = detector::read_sum_drive(source, model, motion);
  if (!drive) {
    return {};
  }
  std::vector<std::size_t> onsets;
  double next = table.rows() > 0 ? table.t.front() + options.every : 0.0;
  for (std::size_t k = 0; k + 1 < motion.instants(); ++k) {
    if (motion.instant[k] >= next) {
      onsets.push_back(k);
      next = motion.instant[k] + options.every;
    }
  }
  const std::vector<model::FaultType> catalogue =
      model::fault_catalogue(model.model, model.estimate, model.robot.effort);
  std::vector<model::FaultType> faults;
  for (const detector::SumWeight& weight : drive->weights) {
    faults.push_back(fault_like(weight, model, catalogue));
  }
  detector::SumMarginOptions margins;
  margins.windows = options.within;
  margins.threads = options.threads;
  std::vector<RiskReach> result;
  for (const detector::FaultMargins& each : detector::margins_at_risk(*drive, model, motion, faults, onsets, margins)) {
    if (each.side < 0.0) {
      continue;
    }
    RiskReach reach{drive->weights[result.size()], {}, {}, options.within};
    reach.unit = reach.weight.shape == detector::SumWeight::Shape::constant
                     ? output_unit(model.robot, model.model.output_units.front())
                     : "1";
    for (std::size_t w = 0; w < options.within.size(); ++w) {
      reach.size.push_back(detector::summarise(each, w).median);
    }
    result.push_back(std::move(reach));
  }
  return result;
}

std::string sentence(const RiskReach& reach, const Model& model) {
  using Shape = detector::SumWeight::Shape;
  const std::string joint = model.joints.size() > 1 && reach.weight.shape != Shape::parameter
                                ? fmt::format(" of {}", model.joints[reach.weight.which].torque)
                                : std::string();
  std::string text = reach.weight.shape == Shape::constant ? "a bias" + joint
                     : reach.weight.shape == Shape::effort
                         ? "a lost share" + joint
                         : "a change of " + model.parameters[reach.weight.which].physical;
  const bool share = reach.unit == "1";
  for (std::size_t k = 0; k < reach.size.size(); ++k) {
    const double size = share ? 100.0 * reach.size[k] : reach.size[k];
    const bool seen = std::isfinite(size) && (!share || size < 100.0);
    text += fmt::format("{}{}", k == 0 ? " " : ", ", seen ? fmt::format("{:.2g}", size) : "–");
  }
  return text + (share ? " %" : " " + reach.unit);
}

}  // namespace wheelwright::commission
