// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/fault_margin.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace wheelwright::detector {
namespace {

constexpr double kPrecise = 1e-9;     // of a certain size, relative
constexpr double kHidden = 1e-3;      // of a hidden size, relative
constexpr double kSafe = 1e-12;       // relative, of sums that only tell whether it is worth while to look closer
constexpr double kNegligible = 1e-9;  // share of the largest size that is as good as 0

double smallest_size(const Interval& side) { return std::max({0.0, side.lower, -side.upper}); }

// Brackets the place where a function of κ, a quadratic on each of a few pieces, turns positive: f(below) <= 0 and
// f(above) > 0.
class Crossing {
 public:
  Crossing(double at_zero, double above, double at_above) : below_{0.0, at_zero}, above_{above, at_above} {}

  [[nodiscard]] double above() const { return above_.kappa; }
  [[nodiscard]] double width() const { return above_.kappa - below_.kappa; }

  // Where to look next: the root of the quadratic through both ends and the last point that was one, or of the chord;
  // off the ends by half of what `precise` (relative) leaves open, so that a root that is known closes the bracket.
  // Halves it where the last three steps did not.
  [[nodiscard]] double propose(double precise) const {
    if (slow_ >= 3) {
      return below_.kappa + 0.5 * width();
    }
    const double root = below_.kappa + (last_ ? root_of_quadratic() : -below_.f / slope(below_, above_));
    const double margin = 0.5 * std::min(precise * above_.kappa, width());
    return std::isfinite(root) ? std::clamp(root, below_.kappa + margin, above_.kappa - margin)
                               : below_.kappa + 0.5 * width();
  }

  void add(double kappa, double f) {
    Point& end = f > 0.0 ? above_ : below_;
    last_ = end;
    end = {kappa, f};
    ++slow_;
    if (width() <= 0.5 * measured_) {
      measured_ = width();
      slow_ = 0;
    }
  }

 private:
  struct Point {
    double kappa = 0.0, f = 0.0;
  };
  static double slope(const Point& a, const Point& b) { return (b.f - a.f) / (b.kappa - a.kappa); }

  // From `below_` on, of f(below) + u b + u² c: negative or 0 at 0, positive at the width, so one root is between.
  [[nodiscard]] double root_of_quadratic() const {
    const double c = (slope(*last_, above_) - slope(below_, above_)) / (last_->kappa - below_.kappa);
    const double b = slope(below_, above_) - width() * c;
    const double root = std::sqrt(std::max(b * b - 4.0 * c * below_.f, 0.0));
    return b > 0.0 ? -2.0 * below_.f / (b + root) : (root - b) / (2.0 * c);
  }

  Point below_, above_;
  std::optional<Point> last_;
  double measured_ = above_.kappa;
  int slow_ = 0;  // steps since the bracket was last half as wide
};

}  // namespace

// The regressor that acts, the one that is seen, and its error bound times `errors`. An error of y itself is in both,
// so that it counts by how far two θ of the set are apart.
FaultMargin::Sums FaultMargin::at(const FaultRow& row, double kappa, double side, double errors) {
  const std::size_t p = row.y.size();
  acting_.resize(p);
  seen_.resize(p);
  error_.resize(p);
  double predicted = 0.0, doubt = kappa * row.doubt, reach = 2.0 * row.dy + std::abs(kappa * row.c);
  for (std::size_t j = 0; j < p; ++j) {
    acting_[j] = row.y[j] + side * kappa * row.g1[j] + kappa * kappa * row.g2[j];
    seen_[j] = row.y[j] + side * kappa * row.s[j];
    error_[j] = errors * row.dY[j];
    const Interval side_of = rule_.set().hull().sides[j];
    doubt += row.range.empty() ? 0.0 : kappa * row.range[j] * core::magnitude(side_of);
    doubt += row.read.empty() ? 0.0 : row.read[j] * side_of.width();
    const double term = seen_[j] * rule_.estimate()[static_cast<Eigen::Index>(j)];
    predicted += term;
    reach += std::abs(term) + (std::abs(acting_[j]) + std::abs(seen_[j]) + error_[j]) * core::magnitude(side_of);
  }
  // Ten sums of p + 4 terms, here and in the detector: Higham 2002, section 3.1.
  return {predicted, doubt, 10.0 * static_cast<double>(p + 4) * std::numeric_limits<double>::epsilon() * reach};
}

// For every θ of the set: h(seen) − min acting·θ >= (seen − acting)·θ, and Δ is worth at least Δ|θ| to the threshold.
bool FaultMargin::cannot_be_certain(const FaultRow& row, double kappa, double side, Direction direction) const {
  const std::vector<double>& theta = rule_.set().centre();
  double added = side * kappa * row.c, against = 2.0 * row.dy + kappa * row.doubt;
  for (std::size_t j = 0; j < theta.size(); ++j) {
    added += (side * kappa * (row.g1[j] - row.s[j]) + kappa * kappa * row.g2[j]) * theta[j];
    against += (2.0 * row.dY[j] + (row.range.empty() ? 0.0 : kappa * row.range[j])) * std::abs(theta[j]);
  }
  return (direction == Direction::up ? added : -added) <= against * (1.0 - kSafe);
}

// max acting·θ − h(seen) <= h(acting − seen), of which no size up to κ makes more than the terms' largest, and Δ is
// worth at least Δ|θ| to the threshold.
bool FaultMargin::cannot_be_possible(const FaultRow& row, double kappa, double side, double share,
                                     Direction direction) const {
  const double sign = direction == Direction::up ? side : -side;
  double once = sign * row.c + row.doubt, twice = 0.0, doubt = 0.0, allowed = row.dy, reach = 2.0 * row.dy;
  for (std::size_t j = 0; j < row.y.size(); ++j) {
    const Interval& theta = rule_.set().hull().sides[j];
    const double by = sign * (row.g1[j] - row.s[j]), by_twice = direction == Direction::up ? row.g2[j] : -row.g2[j];
    const double most = core::magnitude(theta);
    once += by * (by > 0.0 ? theta.upper : theta.lower) + (row.range.empty() ? 0.0 : row.range[j] * most);
    twice += by_twice * (by_twice > 0.0 ? theta.upper : theta.lower);
    doubt += row.read.empty() ? 0.0 : row.read[j] * theta.width();
    allowed += row.dY[j] * smallest_size(theta);
    reach += (std::abs(row.y[j]) + row.dY[j] + kappa * (std::abs(row.g1[j]) + std::abs(row.s[j]))) * most;
  }
  const double most = kappa * std::max(once, 0.0) + kappa * kappa * std::max(twice, 0.0) + doubt;
  return most + kSafe * reach <= (1.0 - share) * allowed;
}

double FaultMargin::certain_excess(const FaultRow& row, double kappa, double side, std::size_t channel,
                                   Direction direction) {
  const Sums sums = at(row, kappa, side, 2.0);
  const double added = side * kappa * row.c, doubt = sums.doubt + sums.rounding;
  if (direction == Direction::up) {
    const double upper = rule_.upper(seen_, error_, row.dy, 2 * channel + 1);
    return rule_.smallest(acting_, 2 * channel) + added - row.dy - (upper + sums.predicted) - doubt;
  }
  const double lower = rule_.lower(seen_, error_, row.dy, 2 * channel + 1);
  return lower + sums.predicted - (rule_.largest(acting_, 2 * channel) + added + row.dy) - doubt;
}

double FaultMargin::possible_excess(const FaultRow& row, double kappa, double side, double share, std::size_t channel,
                                    Direction direction) {
  const Sums sums = at(row, kappa, side, 1.0 - share);
  const double added = side * kappa * row.c, doubt = sums.doubt + sums.rounding;
  if (direction == Direction::up) {
    const double upper = rule_.upper(seen_, error_, row.dy, 2 * channel + 1);
    return rule_.largest(acting_, 2 * channel) + added + share * row.dy - (upper + sums.predicted) + doubt;
  }
  const double lower = rule_.lower(seen_, error_, row.dy, 2 * channel + 1);
  return lower + sums.predicted - (rule_.smallest(acting_, 2 * channel) + added - share * row.dy) + doubt;
}

bool FaultMargin::certain(const FaultRow& row, double kappa, double side, std::size_t channel) {
  const auto is = [&](Direction direction) {
    return !cannot_be_certain(row, kappa, side, direction) &&
           certain_excess(row, kappa, side, channel, direction) > 0.0;
  };
  return is(Direction::up) || is(Direction::down);
}

double FaultMargin::missing(const FaultRow& row, double kappa, double side, std::size_t channel) {
  const double excess = std::max(certain_excess(row, kappa, side, channel, Direction::up),
                                 certain_excess(row, kappa, side, channel, Direction::down));
  const double width = rule_.at(seen_, error_, row.dy, 2 * channel + 1).width();
  return excess >= 0.0 ? 0.0 : -excess / std::max(width, std::numeric_limits<double>::min());
}

bool FaultMargin::possible(const FaultRow& row, double kappa, double side, double share, std::size_t channel) {
  return possible_excess(row, kappa, side, share, channel, Direction::up) > 0.0 ||
         possible_excess(row, kappa, side, share, channel, Direction::down) > 0.0;
}

std::optional<double> FaultMargin::smallest_certain(const FaultRow& row, double largest, double side,
                                                    std::size_t channel) {
  std::optional<double> best;
  for (const Direction direction : {Direction::up, Direction::down}) {
    double above = best.value_or(largest);
    if (cannot_be_certain(row, above, side, direction)) {
      continue;
    }
    const auto excess = [&](double kappa) { return certain_excess(row, kappa, side, channel, direction); };
    const double excess_above = excess(above);
    if (!(excess_above > 0.0)) {
      continue;
    }
    Crossing crossing(std::min(excess(0.0), 0.0), above, excess_above);
    for (int step = 0; crossing.width() > kPrecise * crossing.above() && step < 200; ++step) {
      const double kappa = crossing.propose(kPrecise);
      crossing.add(kappa, excess(kappa));
    }
    above = crossing.above();
    best = above;
  }
  return best;
}

double FaultMargin::largest_hidden(const FaultRow& row, double largest, double side, double share,
                                   std::size_t channel) {
  if (cannot_be_possible(row, largest, side, share, Direction::up) &&
      cannot_be_possible(row, largest, side, share, Direction::down)) {
    return largest;
  }
  double slope = row.doubt;  // of the threshold and of doubt, per unit of κ, at most
  double curvature = 0.0;    // |g2 θ|, at most
  for (std::size_t j = 0; j < row.y.size(); ++j) {
    const double size = core::magnitude(rule_.set().hull().sides[j]);
    slope += (std::abs(row.s[j]) + (row.range.empty() ? 0.0 : row.range[j])) * size;
    curvature += std::abs(row.g2[j]) * size;
  }
  double hidden = largest;
  for (const Direction direction : {Direction::up, Direction::down}) {
    if (cannot_be_possible(row, hidden, side, share, direction)) {
      continue;
    }
    const auto excess = [&](double kappa) { return possible_excess(row, kappa, side, share, channel, direction); };
    // From the left, pieces on which no size can be seen are passed over; a quadratic rises above its chord by no more
    // than a fourth of its second coefficient times the squared width.
    double from = 0.0, at_from = excess(0.0), width = hidden;
    // The longest piece that may be passed over if the excess rises so much per unit of κ.
    const auto reach = [&](double rise) {
      const double linear = std::max(rise, 0.0) + 0.5 * slope;
      const double sum = linear + std::sqrt(linear * linear - curvature * at_from);
      return sum > 0.0 ? -2.0 * at_from / sum : hidden;
    };
    for (bool failed = false; from < hidden && at_from <= 0.0;) {
      const double precise = std::max(kHidden * from, kNegligible * largest);
      width = std::min(std::max(width, precise), hidden - from);
      const double to = from + width, at_to = excess(to), rise = (at_to - at_from) / width;
      const double most = std::max(at_from, at_to) + 0.25 * width * width * curvature + 0.5 * width * slope;
      if (most <= 0.0) {
        from = to;
        at_from = at_to;
        width = reach(rise);
        failed = false;
      } else if (width <= precise) {
        break;
      } else {
        width = std::min((1.0 - 0.25 * kHidden) * reach(rise), (failed ? 0.5 : 0.9) * width);
        failed = true;
      }
    }
    hidden = std::min(hidden, from);
  }
  return hidden;
}

}  // namespace wheelwright::detector
