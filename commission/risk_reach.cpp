// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/risk_reach.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/commission/physical.hpp>
#include <wheelwright/core/limits.hpp>

namespace wheelwright::commission {
namespace {

struct Look {
  double t = 0.0, threshold = 0.0, c0 = 0.0, c1 = 0.0;
};

// Smallest size that a sum certainly shows between `from` and `to`, after an onset at its first look in that time.
double smallest(const std::vector<Look>& looks, double scale, double from, double to) {
  const auto first = std::ranges::lower_bound(looks, from, {}, &Look::t);
  double best = core::kInfinity;
  for (auto look = first; look != looks.end() && look->t <= to; ++look) {
    const double x = (look->t - first->t) / scale;
    const double since = look->c0 - std::exp(-x) * (first->c0 + first->c1 * x);
    if (std::abs(since) > 0.0) {
      best = std::min(best, 2.0 * look->threshold / std::abs(since));
    }
  }
  return best;
}

}  // namespace

std::vector<RiskReach> risk_reach(LogSource& log, const OnlineModel& model, const RiskReachOptions& options) {
  detector::ScaleDetector detector(model, {.exact_thresholds = true});
  const std::size_t weights = detector.weights().size(), scales = detector.scales().size();
  std::vector<std::vector<Look>> looks(weights * scales);
  const std::vector<std::size_t> pick = core::positions_of(log, model.measurement.columns());
  std::vector<double> sample(pick.size());
  // Of the first segment.
  double first = 0.0, last = 0.0;
  bool any = false, done = false;
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    done = done || (starts && any) || (any && block.t[k] - first > options.most);
    if (done) {
      return;
    }
    if (starts) {
      detector.restart();
    }
    for (std::size_t c = 0; c < pick.size(); ++c) {
      sample[c] = block.columns[pick[c]][k];
    }
    first = any ? first : block.t[k];
    last = block.t[k];
    any = true;
    detector.step(block.t[k], sample);
    for (const detector::SumState& state : detector.looks()) {
      looks[state.weight * scales + state.scale].push_back({block.t[k], state.threshold, state.c0, state.c1});
    }
  });
  std::vector<RiskReach> result;
  for (std::size_t w = 0; w < weights; ++w) {
    RiskReach reach;
    reach.within = options.within;
    reach.weight = detector.weights()[w];
    reach.unit = reach.weight.shape == detector::SumWeight::Shape::constant
                     ? output_unit(model.robot, model.model.output_units.front())
                     : "1";
    for (const double within : options.within) {
      std::vector<double> sizes;
      for (double onset = first + options.every; onset + within <= last; onset += options.every) {
        double best = core::kInfinity;
        for (std::size_t s = 0; s < scales; ++s) {
          best = std::min(best, smallest(looks[w * scales + s], detector.scales()[s], onset, onset + within));
        }
        sizes.push_back(best);
      }
      std::ranges::sort(sizes);
      reach.size.push_back(sizes.empty() ? core::kInfinity : sizes[sizes.size() / 2]);
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
