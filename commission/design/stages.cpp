// SPDX-License-Identifier: Apache-2.0
#include "commission/design/stages.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include <nlopt.hpp>

#include "commission/design/plan.hpp"
#include "commission/design/subject.hpp"
#include "core/check.hpp"
#include "core/error.hpp"
#include "core/for_all.hpp"
#include "core/random.hpp"
#include "detector/sum_weight.hpp"

namespace wheelwright::design {
namespace {

using Function = std::function<double(std::span<const double>)>;

constexpr double kNowhere = 1e300;  // where f is not defined

double value_at(const Function& f, std::span<const double> x) {
  try {
    const double value = f(x);
    return std::isfinite(value) ? value : kNowhere;
  } catch (const InvalidArgument&) {
    return kNowhere;
  }
}

struct Descent {
  const Function* f;
  SearchResult best;

  static double evaluate(const std::vector<double>& x, std::vector<double>&, void* data) {
    auto& self = *static_cast<Descent*>(data);
    const double value = value_at(*self.f, x);
    ++self.best.evaluations;
    if (value < self.best.value) {
      self.best.value = value;
      self.best.x = x;
    }
    return value;
  }

  // Simplices that begin anew, smaller, where the last one stood still.
  void run(std::size_t steps, double tolerance) {
    const std::size_t last = best.evaluations + steps;
    double reach = 0.2;
    while (best.evaluations < last) {
      const double before = best.value;
      descend(reach, last - best.evaluations, tolerance);
      reach *= 0.5;
      if (before - best.value <= tolerance * std::abs(before) && reach < 0.04) {
        return;
      }
    }
  }

  void descend(double reach, std::size_t steps, double tolerance) {
    nlopt::opt solver(nlopt::LN_NELDERMEAD, static_cast<unsigned>(best.x.size()));
    solver.set_lower_bounds(0.0);
    solver.set_upper_bounds(1.0);
    solver.set_initial_step(reach);
    solver.set_ftol_rel(tolerance);
    solver.set_xtol_abs(1e-4);
    solver.set_maxeval(static_cast<int>(std::min<std::size_t>(steps, 1000000)));
    solver.set_min_objective(evaluate, this);
    std::vector<double> x = best.x;
    double value = 0.0;
    try {
      solver.optimize(x, value);
    } catch (const nlopt::roundoff_limited&) {
      // The best point met is kept in any case.
    }
  }
};

}  // namespace

SearchResult minimise_over_cube(const Function& f, std::size_t dimension,
                                const std::vector<std::vector<double>>& starts, const SearchOptions& options) {
  check::that(dimension > 0, "dimension", "at least 1");
  check::that(options.samples + starts.size() > 0, "samples", "a point to begin with");
  std::vector<std::vector<double>> points = starts;
  std::mt19937_64 generator(options.seed);
  for (std::size_t i = 0; i < options.samples; ++i) {
    std::vector<double> x(dimension);
    std::generate(x.begin(), x.end(), [&generator] { return core::uniform(generator); });
    points.push_back(std::move(x));
  }
  for (const auto& x : points) {
    check::that(x.size() == dimension, "starts", "points of the cube's dimension");
  }
  const double work = static_cast<double>(points.size() + options.descents * options.steps);
  const auto tell = [&](double evaluations) {
    if (options.progress) {
      options.progress(evaluations / work);
    }
  };

  std::vector<double> values(points.size());
  core::for_all(
      points.size(), options.threads, [&](std::size_t i) { values[i] = value_at(f, points[i]); },
      [&](std::size_t i) { tell(static_cast<double>(i)); });
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });

  const std::size_t count = std::max<std::size_t>(1, std::min(options.descents, points.size()));
  std::vector<Descent> descents(count);
  for (std::size_t i = 0; i < count; ++i) {
    descents[i] = {&f, {points[order[i]], values[order[i]], 0}};
  }
  if (options.descents > 0) {
    core::for_all(
        count, options.threads, [&](std::size_t i) { descents[i].run(options.steps, options.tolerance); },
        [&](std::size_t i) { tell(static_cast<double>(points.size() + i * options.steps)); });
  }
  const auto best = std::min_element(descents.begin(), descents.end(),
                                     [](const Descent& a, const Descent& b) { return a.best.value < b.best.value; });
  check::that(best->best.value < kNowhere, "the function", "a finite value somewhere");
  SearchResult result = best->best;
  result.evaluations = points.size();
  for (const Descent& descent : descents) {
    result.evaluations += descent.best.evaluations;
  }
  return result;
}

namespace {

constexpr double kRest = 0.1;          // s of standstill at both ends
constexpr double kRise = 0.25;         // share of a ramp over which its acceleration rises, and falls
constexpr double kFrictionMost = 0.8;  // of the effort: the rest is for acceleration
constexpr double kShortest = 0.05;     // s of a ramp, where nothing limits the acceleration
constexpr double kSlack = 1e-9;  // share by which stages stay off the limits, so that rounding does not cross them

struct Shape {
  double value = 0.0;  // 0 → 1 along the ramp
  double rate = 0.0;   // per duration of the ramp
};

// The ramp at its share s in [0, 1]: acceleration a trapezium.
Shape ramp(double s) {
  const double peak = 1.0 / (1.0 - kRise);
  if (s <= 0.0 || s >= 1.0) {
    return {s <= 0.0 ? 0.0 : 1.0, 0.0};
  }
  const double to_end = std::min(s, 1.0 - s);
  Shape early;
  if (to_end < kRise) {
    early = {0.5 * peak * to_end * to_end / kRise, peak * to_end / kRise};
  } else {
    early = {peak * (to_end - 0.5 * kRise), peak};
  }
  return {s <= 0.5 ? early.value : 1.0 - early.value, early.rate};
}

}  // namespace

double shortest_duration(std::size_t stages) {
  return std::max(0.5, 2.0 * (kRest + (static_cast<double>(stages) + 1.0) * kShortest));
}

StageFamily::StageFamily(const DesignSubject& subject, const MotionLimits& limits, std::size_t stages)
    : subject_(&subject),
      limits_(limits),
      stages_(stages),
      joints_(subject.model.joints.size()),
      motion_(subject.model.motion) {
  validate(limits);
  check::that(stages > 0, "stages", "at least 1");
  check::that(limits.duration >= shortest_duration(stages), "limits.duration",
              "at least the shortest_duration of this many stages");
  Eigen::VectorXd creep = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(joints_), 1e-6 * limits.joint_speed);
  if (limits.effort) {
    const EffortModel effort(subject);
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(motion_.rows());
    check::that(effort.largest(motion_ * creep, none, 0.0).maxCoeff() < kFrictionMost * *limits.effort, "limits.effort",
                "more than 1.25 times what it takes to move at all");
  }
}

// Scales a speed down until its friction leaves effort to accelerate with.
void StageFamily::limit_friction(Eigen::VectorXd& joint_speed) const {
  if (!limits_.effort) {
    return;
  }
  const EffortModel effort(*subject_);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(motion_.rows());
  for (int i = 0; i < 60; ++i) {
    const double share =
        effort.largest(motion_ * joint_speed, none, 0.0).maxCoeff() / (kFrictionMost * *limits_.effort);
    if (share <= 1.0) {
      return;
    }
    joint_speed *= std::clamp(1.0 / share, 0.5, 0.98);
  }
}

// The shortest ramp, for the motion and for its mirror image (v̇, −v): |±F + G/T| <= |F| + |G|/T.
double StageFamily::ramp_time(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const {
  const double peak = 1.0 / (1.0 - kRise);
  const Eigen::VectorXd change = to - from;
  double time = change.isZero(0.0) ? 0.0 : kShortest;
  if (limits_.joint_acceleration) {
    time = std::max(time, peak * change.cwiseAbs().maxCoeff() / *limits_.joint_acceleration);
  }
  if (limits_.effort) {
    const EffortModel effort(*subject_);
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(motion_.rows());
    const Eigen::VectorXd inertia = effort.largest(none, motion_ * change, 0.0) - effort.largest(none, none, 0.0);
    for (int i = 0; i <= 16; ++i) {
      const Shape shape = ramp(i / 16.0);
      const Eigen::VectorXd friction = effort.largest(motion_ * (from + shape.value * change), none, 0.0);
      for (Eigen::Index k = 0; k < friction.size(); ++k) {
        const double left = std::max(*limits_.effort - friction[k], 0.02 * *limits_.effort);
        time = std::max(time, shape.rate * inertia[k] / left);
      }
    }
  }
  return time * (1.0 + kSlack);
}

// The last resort, and the guarantee: whatever is beyond a limit is scaled down.
void StageFamily::keep_within(Plan& plan) const {
  const double space = space_use(plan, limits_);
  if (space > 1.0) {
    const double scale = (1.0 - kSlack) / space;
    plan.speed.row(0) *= scale;
    plan.acceleration.row(0) *= scale;
    plan.pose.topRows<2>() *= scale;
  }
  for (int i = 0; i < 60; ++i) {
    const double use = limit_use(plan, *subject_, limits_).largest();
    if (use <= 1.0) {
      return;
    }
    const double scale = std::clamp(1.0 / use, 0.5, 1.0 - 1e-3);
    plan.speed *= scale;
    plan.acceleration *= scale;
    integrate_pose(plan, subject_->model);
  }
  throw InvalidArgument("limits: no motion was found within them: expected an effort limit above dry friction");
}

Plan StageFamily::plan(std::span<const double> x, double step) const {
  check::that(x.size() == dimension(), "x", "stages · (joints + 1) numbers");
  const auto joints = static_cast<Eigen::Index>(joints_);
  std::vector<Eigen::VectorXd> target(stages_, Eigen::VectorXd(joints));
  std::vector<double> weight(stages_);
  for (std::size_t k = 0; k < stages_; ++k) {
    const double* of_stage = x.data() + k * (joints_ + 1);
    for (Eigen::Index j = 0; j < joints; ++j) {
      target[k][j] = (1.0 - kSlack) * limits_.joint_speed * (2.0 * std::clamp(of_stage[j], 0.0, 1.0) - 1.0);
    }
    limit_friction(target[k]);
    weight[k] = std::clamp(of_stage[joints_], 0.0, 1.0) + 1e-3;
  }

  // Out: 0 → u_1 → … → u_K, and half of the ramp u_K → −u_K on which the way back begins.
  const double half = 0.5 * limits_.duration - kRest;
  std::vector<double> ramps(stages_ + 1);
  double moving = 0.0;
  for (;;) {
    for (std::size_t k = 0; k <= stages_; ++k) {
      const Eigen::VectorXd from = k == 0 ? Eigen::VectorXd::Zero(joints) : target[k - 1];
      const Eigen::VectorXd to = k == stages_ ? Eigen::VectorXd(-from) : target[k];
      ramps[k] = ramp_time(from, to);
    }
    moving = std::accumulate(ramps.begin(), ramps.end() - 1, 0.5 * ramps.back());
    if (moving <= half) {
      break;
    }
    if (moving <= (stages_ + 1.0) * kShortest || half < (1.0 - 1e-12) * (stages_ + 1.0) * kShortest) {
      throw InvalidArgument("limits.duration: expected more time for this many stages");
    }
    for (Eigen::VectorXd& u : target) {
      u *= std::min(half / moving, 0.98);
    }
  }
  const double hold = (half - moving) / std::accumulate(weight.begin(), weight.end(), 0.0);

  Plan plan;
  plan.step = step;
  const auto samples = static_cast<Eigen::Index>(std::floor(limits_.duration / step * (1.0 + 1e-12))) + 1;
  plan.speed = Eigen::MatrixXd::Zero(motion_.rows(), samples);
  plan.acceleration = Eigen::MatrixXd::Zero(motion_.rows(), samples);
  const double middle = 0.5 * limits_.duration;
  for (Eigen::Index i = 0; i < samples; ++i) {
    const double t = plan.t(i);
    const double sign = t <= middle ? 1.0 : -1.0;
    double local = (t <= middle ? t : limits_.duration - t) - kRest;
    if (local <= 0.0) {
      continue;
    }
    std::size_t k = 0;
    while (k < stages_ && local > ramps[k] + hold * weight[k]) {
      local -= ramps[k] + hold * weight[k];
      ++k;
    }
    const Eigen::VectorXd from = k == 0 ? Eigen::VectorXd::Zero(joints) : target[k - 1];
    const Eigen::VectorXd change = (k == stages_ ? Eigen::VectorXd(-from) : target[k]) - from;
    const Shape shape = ramps[k] > 0.0 ? ramp(local / ramps[k]) : Shape{1.0, 0.0};
    plan.speed.col(i) = sign * (motion_ * (from + shape.value * change));
    if (ramps[k] > 0.0) {
      plan.acceleration.col(i) = motion_ * change * (shape.rate / ramps[k]);
    }
  }
  integrate_pose(plan, subject_->model);
  keep_within(plan);
  return plan;
}

}  // namespace wheelwright::design
