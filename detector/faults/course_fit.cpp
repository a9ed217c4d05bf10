// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/course_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>

#include "bounds/polytope.hpp"
#include "core/for_all.hpp"
#include "core/limits.hpp"
#include "detector/faults/odometry_faults.hpp"
#include "detector/faults/odometry_isolation.hpp"
#include "detector/faults/onset_rows.hpp"
#include "detector/faults/size_over_time.hpp"
#include "detector/faults/step_elements.hpp"
#include "detector/threshold.hpp"
#include "model/filter/odometry_filter.hpp"

namespace wheelwright::detector {
namespace {

constexpr std::array<double, 22> kOffsets = {-6.0, -3.0, -1.5, -0.8, -0.4, -0.2, -0.1, 0.0,  0.1,  0.3,  0.7,
                                             1.5,  2.5,  4.0,  6.0,  9.0,  13.0, 18.0, 25.0, 34.0, 46.0, 60.0};  // s
constexpr std::size_t kBetween = 3;  // times of responses between two knots
constexpr double kFloor = 0.02;      // of an output's scale: errors of a model that fits
constexpr double kApart = 4.0;       // 1/β between independent rows
constexpr int kReweighted = 4;       // times
constexpr int kSweeps = 3000;        // of coordinates
constexpr double kRidge = 1e-6;      // of the largest diagonal entry

// ε and the scales of the rows.
void take_residual(const ReferenceMotion& motion, const std::vector<std::size_t>& instants,
                   const Eigen::VectorXd& estimate, const bounds::Polytope& set, CourseRows& out) {
  const RegressionBlock& rows = motion.rows;
  const std::size_t n = rows.outputs, p = rows.parameters;
  const ThresholdRule rule(set, estimate);
  out.outputs = n;
  out.residual.resize(static_cast<Eigen::Index>(instants.size() * n));
  std::vector<std::vector<double>> halves(n);
  for (std::size_t r = 0; r < instants.size(); ++r) {
    for (std::size_t i = 0; i < n; ++i) {
      const auto at = static_cast<Eigen::Index>(instants[r] * n + i);
      out.residual[static_cast<Eigen::Index>(r * n + i)] = rows.y[at] - rows.Y.row(at).dot(estimate);
      halves[i].push_back(0.5 *
                          rule.at({rows.Y.row(at).data(), p}, {rows.dY.row(at).data(), p}, rows.dy[at], i).width());
    }
  }
  out.scale = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(n));
  for (std::size_t i = 0; i < n && !instants.empty(); ++i) {
    const auto middle = halves[i].begin() + static_cast<std::ptrdiff_t>(halves[i].size() / 2);
    std::nth_element(halves[i].begin(), middle, halves[i].end());
    out.scale[static_cast<Eigen::Index>(i)] = std::max(*middle, std::numeric_limits<double>::min());
  }
}

FaultType without_profile(FaultType fault) {
  fault.profile = {};
  return fault;
}

bool has_known_course(const FaultType& fault) {
  using Kind = FaultProfile::Kind;
  return !fault.held_effort && (fault.profile.kind == Kind::step || fault.profile.kind == Kind::ramp) &&
         !(fault.whole && fault.seen.size() > 0);
}

// S of one fault, rows × (1 + times).
Eigen::MatrixXd torque_responses(const FaultType& fault, const ReferenceMotion& motion,
                                 const filter::RegressorFilter& filter, const Eigen::VectorXd& estimate,
                                 const std::vector<std::size_t>& instants, const std::vector<double>& times) {
  const Model& model = filter.model();
  const StepElements elements = step_elements(fault, model, filter.design().static_gain(), motion);
  const std::size_t n = elements.outputs;
  const auto p = static_cast<Eigen::Index>(elements.columns);
  const auto dot = [&](const std::vector<double>& of, std::size_t k, std::size_t i) {
    return Eigen::Map<const Eigen::VectorXd>(elements.at(of, k, i), p).dot(estimate);
  };
  std::vector<std::size_t> onsets;
  for (const double t : times) {
    onsets.push_back(static_cast<std::size_t>(std::ranges::lower_bound(motion.instant, t) - motion.instant.begin()));
  }
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(instants.size() * n),
                                              static_cast<Eigen::Index>(1 + times.size()));
  RowWeights weights(motion, filter.design());
  for (std::size_t r = 0; r < instants.size(); ++r) {
    const std::size_t row = instants[r];
    weights.of(row);
    for (std::size_t i = 0; i < n; ++i) {
      const auto at = static_cast<Eigen::Index>(r * n + i);
      double sum = 0.0;
      std::size_t next = onsets.size();
      while (next > 0 && onsets[next - 1] >= row) {
        --next;
      }
      for (std::size_t k = row; k-- > weights.first();) {
        const double weight = weights.weight(k);
        sum += weight * (dot(elements.g1, k, i) + elements.c[k * n + i]);
        for (; next > 0 && onsets[next - 1] == k; --next) {
          out(at, static_cast<Eigen::Index>(next)) = sum + weight * dot(elements.once, k, i);
        }
      }
      for (; next > 0; --next) {
        out(at, static_cast<Eigen::Index>(next)) = sum;
      }
      out(at, 0) = sum;
    }
  }
  return out;
}

// Parts of a course: steps, and ramps between knots, from responses to steps.
Eigen::MatrixXd parts_of(const Eigen::MatrixXd& responses, const CourseGrid& grid) {
  const auto knots = static_cast<Eigen::Index>(grid.knots.size()), apart = static_cast<Eigen::Index>(kBetween + 1);
  Eigen::MatrixXd out(responses.rows(), knots + 1 + std::max<Eigen::Index>(knots - 1, 0));
  out.col(0) = responses.col(0);
  for (Eigen::Index j = 0; j < knots; ++j) {
    const Eigen::Index at = 1 + j * apart;
    out.col(1 + j) = responses.col(at);
    if (j + 1 < knots) {
      auto ramp = out.col(1 + knots + j);
      ramp = 0.5 * (responses.col(at) + responses.col(at + apart));
      for (Eigen::Index k = 1; k < apart; ++k) {
        ramp += responses.col(at + k);
      }
      ramp /= static_cast<double>(apart);
    }
  }
  return out;
}

// Normal equations of one output.
struct Channel {
  Eigen::MatrixXd gram{};
  Eigen::VectorXd right{};
  double square = 0.0, rows = 0.0, independent = 0.0, floor = 0.0;

  [[nodiscard]] double left(const Eigen::VectorXd& x) const {
    return std::max(0.0, square - 2.0 * x.dot(right) + x.dot(gram * x));
  }
  [[nodiscard]] double variance(double left_over) const { return left_over / rows + floor; }
};

// x >= 0 with a sum of at most `most`, to a minimum of ½xᵀGx − bᵀx.
Eigen::VectorXd non_negative(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right, double most) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(right.size()), gradient = -right;
  double sum = 0.0;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double moved = 0.0;
    for (Eigen::Index j = 0; j < x.size(); ++j) {
      const double curvature = gram(j, j);
      if (!(curvature > 0.0)) {
        continue;
      }
      const double to = std::clamp(x[j] - gradient[j] / curvature, 0.0, std::max(0.0, most - sum + x[j]));
      const double change = to - x[j];
      if (change != 0.0) {
        gradient += change * gram.col(j);
        sum += change;
        x[j] = to;
        moved = std::max(moved, change * change * curvature);
      }
    }
    if (moved <= 1e-10 * std::abs(right.dot(x))) {
      break;
    }
  }
  return x;
}

Eigen::VectorXd any_sign(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right) {
  Eigen::MatrixXd regular = gram;
  const double ridge = kRidge * std::max(gram.diagonal().maxCoeff(), std::numeric_limits<double>::min());
  regular.diagonal().array() += ridge;
  return regular.ldlt().solve(right);
}

enum class Way { rising, falling, any, once };

struct Solution {
  double cost = core::kInfinity, left = 1.0, amount = 0.0;
  Eigen::VectorXd parts{};
};

// Time in which parts of one sign go from a tenth to nine tenths of their sum.
double rise_of(const Eigen::VectorXd& parts, const CourseGrid& grid) {
  const double all = parts.cwiseAbs().sum();
  const auto knots = static_cast<Eigen::Index>(grid.knots.size());
  double sum = std::abs(parts[0]), low = -core::kInfinity, high = -core::kInfinity;
  bool begun = sum > 0.1 * all, ended = sum > 0.9 * all;
  const auto pass = [&](double amount, double from, double to) {
    const auto at = [&](double level) {
      return amount > 0.0 ? from + (to - from) * std::clamp((level * all - sum) / amount, 0.0, 1.0) : from;
    };
    if (!begun && sum + amount > 0.1 * all) {
      low = at(0.1);
      begun = true;
    }
    if (!ended && sum + amount > 0.9 * all) {
      high = at(0.9);
      ended = true;
    }
    sum += amount;
  };
  for (Eigen::Index j = 0; j < knots; ++j) {
    const double t = grid.knots[static_cast<std::size_t>(j)];
    pass(std::abs(parts[1 + j]), t, t);
    if (j + 1 < knots) {
      pass(std::abs(parts[1 + knots + j]), t, grid.knots[static_cast<std::size_t>(j + 1)]);
    }
  }
  // Of what was there before it is not known how long it took.
  return std::isfinite(low) && std::isfinite(high) ? high - low : std::isfinite(high) ? high - grid.knots.front() : 0.0;
}

// Everything of one fault: outputs of all residuals.
class Fit {
 public:
  Fit(const FaultType& fault, std::size_t number, const CourseGrid& grid, std::span<const CourseRows> residuals)
      : fault_(fault), grid_(grid) {
    for (const CourseRows& rows : residuals) {
      if (rows.responses[number].size() == 0) {
        known_ = false;
        return;
      }
      const Eigen::MatrixXd parts = parts_of(rows.responses[number], grid);
      const auto n = static_cast<Eigen::Index>(rows.outputs), count = rows.residual.size() / n;
      for (Eigen::Index i = 0; i < n; ++i) {
        Eigen::MatrixXd own(count, parts.cols());
        Eigen::VectorXd left(count);
        for (Eigen::Index r = 0; r < count; ++r) {
          own.row(r) = parts.row(r * n + i);
          left[r] = rows.residual[r * n + i];
        }
        own /= rows.scale[i];
        left /= rows.scale[i];
        channels_.push_back({.gram = own.transpose() * own,
                             .right = own.transpose() * left,
                             .square = left.squaredNorm(),
                             .rows = static_cast<double>(std::max<Eigen::Index>(count, 1)),
                             .independent = std::min(rows.independent, static_cast<double>(count)),
                             .floor = kFloor * kFloor});
        ways_.push_back(rows.ways);
      }
    }
  }

  [[nodiscard]] bool known() const { return known_ && !channels_.empty(); }

  [[nodiscard]] CourseFit best() const {
    CourseFit out{.known = true};
    const auto take = [&](Way way) {
      const Solution found = solve(way);
      if (found.cost < out.cost) {
        out.cost = found.cost;
        out.left = found.left;
        out.grows = way != Way::any;
        const double sigma = way == Way::falling || (way == Way::any && found.amount < 0.0) ? -1.0 : 1.0;
        out.size = size_of(fault_, sigma, std::abs(found.amount));
        out.rise = out.grows ? rise_of(found.parts, grid_) : 0.0;
      }
    };
    out.cost = core::kInfinity;
    if (fault_.whole) {
      take(Way::once);
      return out;
    }
    if (fault_.range.upper > 0.0) {
      take(Way::rising);
    }
    if (fault_.range.lower < 0.0) {
      take(Way::falling);
    }
    take(Way::any);
    return out;
  }

 private:
  [[nodiscard]] Solution solve(Way way) const {
    // What κ is of the amount in the kinematic residual, at the size that comes of it.
    double factor = 1.0;
    Solution found;
    for (int turn = 0; turn < 2; ++turn) {
      std::vector<Channel> scaled = channels_;
      for (std::size_t c = 0; c < scaled.size(); ++c) {
        if (ways_[c] && factor != 1.0) {
          scaled[c].gram *= factor * factor;
          scaled[c].right *= factor;
        }
      }
      found = solve(way, scaled);
      const double size = size_of(fault_, found.amount < 0.0 ? -1.0 : 1.0, std::abs(found.amount));
      const bool square = fault_.seen.size() == 0 && std::isfinite(size) && std::abs(found.amount) > 1e-9;
      factor = square ? std::abs(fault_.kappa(size) / found.amount) : 1.0;
      if (!square || std::abs(factor - 1.0) < 1e-3) {
        break;
      }
    }
    return found;
  }

  [[nodiscard]] Solution solve(Way way, const std::vector<Channel>& channels) const {
    const Eigen::Index parts = channels.front().right.size();
    std::vector<double> variance;
    double independent = 0.0, all = 0.0, rest = 0.0;
    for (const Channel& channel : channels) {
      variance.push_back(channel.variance(channel.square));
      independent += channel.independent;
      all += channel.square;
    }
    Eigen::VectorXd x = Eigen::VectorXd::Zero(parts);
    for (int turn = 0; turn < kReweighted; ++turn) {
      Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(parts, parts);
      Eigen::VectorXd right = Eigen::VectorXd::Zero(parts);
      for (std::size_t c = 0; c < channels.size(); ++c) {
        const double weight = channels[c].independent / channels[c].rows / variance[c];
        gram += weight * channels[c].gram;
        right += weight * channels[c].right;
      }
      x = best_parts(way, gram, right);
      for (std::size_t c = 0; c < channels.size(); ++c) {
        variance[c] = channels[c].variance(channels[c].left(x));
      }
    }
    Solution out{.cost = 0.0};
    for (const Channel& channel : channels) {
      const double left = channel.left(x);
      out.cost += 0.5 * channel.independent * std::log(channel.variance(left));
      rest += left;
    }
    const double largest = x.cwiseAbs().maxCoeff();
    const auto used = static_cast<double>((x.array().abs() > 1e-3 * largest).count());
    out.cost += 0.5 * (way == Way::once ? 1.0 : used) * std::log(std::max(independent, 2.0));
    out.left = all > 0.0 ? std::sqrt(rest / all) : 1.0;
    out.amount = x.sum();
    out.parts = x;
    return out;
  }

  [[nodiscard]] Eigen::VectorXd best_parts(Way way, const Eigen::MatrixXd& gram, const Eigen::VectorXd& right) const {
    if (way == Way::any) {
      return any_sign(gram, right);
    }
    if (way == Way::once) {
      Eigen::VectorXd best = Eigen::VectorXd::Zero(right.size());
      double least = core::kInfinity;
      for (Eigen::Index j = 0; j <= static_cast<Eigen::Index>(grid_.knots.size()); ++j) {
        const double value = 0.5 * gram(j, j) - right[j];
        if (value < least) {
          least = value;
          best.setZero();
          best[j] = 1.0;
        }
      }
      return best;
    }
    const double sigma = way == Way::rising ? 1.0 : -1.0;
    const double most = amount_of(fault_, way == Way::rising ? fault_.range.upper : fault_.range.lower);
    return sigma * non_negative(gram, sigma * right, most);
  }

  const FaultType& fault_;
  const CourseGrid& grid_;
  bool known_ = true;
  std::vector<Channel> channels_;
  std::vector<bool> ways_;
};

}  // namespace

CourseGrid course_grid(const Interval& window, double outside) {
  CourseGrid grid;
  for (const double offset : kOffsets) {
    const double t = outside + offset;
    if (t > window.lower && t < window.upper) {
      grid.knots.push_back(t);
    }
  }
  if (grid.knots.empty()) {
    grid.knots.push_back(outside);
  }
  for (std::size_t j = 0; j < grid.knots.size(); ++j) {
    grid.times.push_back(grid.knots[j]);
    for (std::size_t k = 1; k <= kBetween && j + 1 < grid.knots.size(); ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(kBetween + 1);
      grid.times.push_back((1.0 - share) * grid.knots[j] + share * grid.knots[j + 1]);
    }
  }
  return grid;
}

CourseRows course_rows(const ReferenceMotion& motion, const filter::RegressorFilter& filter,
                       const Eigen::VectorXd& estimate, const bounds::Polytope& set,
                       const std::vector<FaultType>& faults, const Interval& window, const CourseGrid& grid,
                       std::size_t most, std::size_t threads) {
  const std::vector<std::size_t> instants = settled_within(motion, window, most);
  CourseRows out;
  take_residual(motion, instants, estimate, set, out);
  out.independent = std::max(1.0, window.width() * filter.design().beta / kApart);
  out.responses.resize(faults.size());
  core::for_all(faults.size(), threads, [&](std::size_t k) {
    const FaultType step = without_profile(faults[k]);
    if (has_known_course(faults[k]) && (step.whole || OnsetRows::knows(step, filter.model()))) {
      // An encoder's as one of motion, whose amount is of one sign.
      out.responses[k] = torque_responses(step.seen.size() > 0 ? as_motion_of_reading(step) : step, motion, filter,
                                          estimate, instants, grid.times);
    }
  });
  return out;
}

CourseRows course_rows_by_odometry(const OdometryReference& reference, const Model& model,
                                   const filter::OdometryMeasurement& measurement, const filter::OdometryErrors& errors,
                                   double length, const Eigen::VectorXd& estimate, const bounds::Polytope& set,
                                   const std::vector<FaultType>& faults, const Interval& window, const CourseGrid& grid,
                                   std::size_t most) {
  const std::vector<std::size_t> instants = settled_within(reference.motion, window, most);
  CourseRows out;
  out.ways = true;
  take_residual(reference.motion, instants, estimate, set, out);
  out.independent = std::max(1.0, window.width() / length);
  std::vector<double> times{reference.motion.t.empty() ? 0.0 : reference.motion.t.front()};
  times.insert(times.end(), grid.times.begin(), grid.times.end());
  for (const FaultType& fault : faults) {
    if (!has_known_course(fault)) {
      out.responses.emplace_back();
    } else if (!shows_in_odometry(fault)) {
      out.responses.emplace_back(Eigen::MatrixXd::Zero(out.residual.size(), static_cast<Eigen::Index>(times.size())));
    } else {
      out.responses.push_back(
          odometry_responses(reference, model, measurement, errors, without_profile(fault), estimate, instants, times));
    }
  }
  return out;
}

std::vector<CourseFit> fit_courses(const std::vector<FaultType>& faults, const CourseGrid& grid,
                                   std::span<const CourseRows> residuals) {
  std::vector<CourseFit> out(faults.size());
  for (std::size_t k = 0; k < faults.size(); ++k) {
    const Fit fit(faults[k], k, grid, residuals);
    if (fit.known()) {
      out[k] = fit.best();
    }
  }
  return out;
}

}  // namespace wheelwright::detector
