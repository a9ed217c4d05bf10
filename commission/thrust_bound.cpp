// SPDX-License-Identifier: Apache-2.0
#include "commission/thrust_bound.hpp"

#include <algorithm>
#include <vector>

#include "core/limits.hpp"
#include "model/filter/element_filter.hpp"

namespace wheelwright::commission {
namespace {

// What a step of held efforts says of one coordinate.
struct HeldStep {
  unsigned signs = 0;                   // which way joints turn, a bit for each
  double slowest = 0.0, fastest = 0.0;  // mean speed
  double least = 0.0, most = 0.0;       // effort
};

// The largest u1 − u2 of two steps of the same signs, the second of them no slower than the first; 0 without such.
double least_thrust(std::vector<HeldStep> steps) {
  double best = 0.0;
  std::vector<HeldStep> slower = steps;
  const auto by = [](double HeldStep::*speed) {
    return [speed](const HeldStep& a, const HeldStep& b) {
      return a.signs != b.signs ? a.signs < b.signs : a.*speed < b.*speed;
    };
  };
  std::ranges::sort(steps, by(&HeldStep::slowest));
  std::ranges::sort(slower, by(&HeldStep::fastest));
  auto next = slower.begin();
  unsigned signs = 0;
  double most = -core::kInfinity;
  for (const HeldStep& step : steps) {
    if (step.signs != signs) {
      signs = step.signs;
      most = -core::kInfinity;
    }
    for (; next != slower.end() && (next->signs < signs || (next->signs == signs && next->fastest <= step.slowest));
         ++next) {
      most = next->signs == signs ? std::max(most, next->least) : most;
    }
    best = std::max(best, most - step.most);
  }
  return best;
}

}  // namespace

filter::MotionBound thrust_bound(LogSource& log, const Model& model, const filter::Measurement& measurement,
                                 const filter::SignalErrors& errors) {
  const std::size_t n = model.coordinates.size();
  if (errors.motion.limit.size() == 0 || filter::flow_kind(model) == filter::FlowKind::none) {
    return {};
  }
  filter::ElementFilter elements(model, measurement, errors);
  std::vector<std::vector<HeldStep>> steps(n);
  core::for_each_sample(log, measurement.columns(), [&](const core::LogSample& sample) {
    if (sample.starts) {
      elements.restart();
    }
    if (!elements.step(sample.t, sample.values)) {
      return;
    }
    const filter::StepMotion& step = elements.last_step();
    if (!step.known || !step.held ||
        std::ranges::any_of(step.values, [](const model::TermValue& value) { return value.error > 0.0; })) {
      return;
    }
    unsigned signs = 0;
    for (Eigen::Index j = 0; j < step.joint_speed.size(); ++j) {
      signs = 2 * signs + (step.joint_speed[j] > 0.0 ? 1 : 0);
    }
    for (std::size_t c = 0; c < n; ++c) {
      const auto i = static_cast<Eigen::Index>(c);
      const double error = step.speed_error[i] + (step.ends ? step.departure[i] : 0.0);
      steps[c].push_back({signs, step.speed[i] - error, step.speed[i] + error, step.effort[i] - step.effort_error[i],
                          step.effort[i] + step.effort_error[i]});
    }
  });
  filter::MotionBound bound = errors.motion;
  bound.mobility = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  for (std::size_t c = 0; c < n; ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    const double thrust = least_thrust(std::move(steps[c]));
    if (!(thrust > 0.0)) {
      return {};
    }
    bound.mobility(i, i) = core::round_up((2.0 + 1e-9) * bound.limit[i] / thrust);
  }
  return bound;
}

void sharpen(filter::MotionBound& bound, const filter::MotionBound& thrust, const Box& box) {
  if (thrust.mobility.size() == 0) {
    return;
  }
  bound.mobility = bound.mobility.size() > 0 ? bound.mobility.cwiseMin(thrust.mobility).eval() : thrust.mobility;
  bound.largest = box.magnitudes();
}

}  // namespace wheelwright::commission
