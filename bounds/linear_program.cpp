// SPDX-License-Identifier: Apache-2.0
#include "bounds/linear_program.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Core>

namespace wheelwright::bounds {

using core::kInfinity;

namespace {

constexpr double kFeasible = 1e-12;    // violation of a row that is none
constexpr double kPriced = 1e-12;      // multiplier that is not negative, for a direction of norm one
constexpr double kPivot = 1e-10;       // smallest pivot
constexpr double kGoodPivot = 1e-7;    // below this the inverse is made afresh before it is believed
constexpr std::size_t kRefactor = 24;  // exchanges after which the inverse is made afresh
constexpr double kAccurate = 1e-13;    // residual of the basis' equations that needs no fresh inverse
constexpr double kRounding = 4.0;      // violations of rows over that of a row of the basis, both by rounding
constexpr double kCoarse = 1e-3;       // of the optimum, what that must not come to
constexpr std::size_t kSeen = 128;     // vertices to begin at
constexpr double kOnBox = 1e-9;        // multiplier of a side of the box that matters

}  // namespace

LinearProgram::LinearProgram(Eigen::VectorXd lower, Eigen::VectorXd upper)
    : p_(static_cast<std::size_t>(lower.size())),
      lower_(lower.data(), lower.data() + lower.size()),
      upper_(upper.data(), upper.data() + upper.size()),
      basis_{std::vector<int>(p_), std::vector<double>(p_ * p_), 0},
      x_(p_),
      lambda_(p_),
      row_(p_),
      alpha_(p_),
      direction_(p_) {}

double LinearProgram::coefficient(int row, std::size_t j) const {
  if (row >= 0) {
    return a_[j * stride_ + static_cast<std::size_t>(row)];
  }
  const auto side = static_cast<std::size_t>(-1 - row);
  return side / 2 != j ? 0.0 : side % 2 == 0 ? -1.0 : 1.0;
}

double LinearProgram::bound(int row) const {
  if (row >= 0) {
    return b_[static_cast<std::size_t>(row)];
  }
  const auto side = static_cast<std::size_t>(-1 - row);
  return side % 2 == 0 ? -lower_[side / 2] : upper_[side / 2];
}

kernels::Rows LinearProgram::view() const {
  const std::size_t padded = (count_ + kernels::kLanes - 1) / kernels::kLanes * kernels::kLanes;
  return {a_.data(), stride_, padded, p_, b_.data()};
}

double LinearProgram::violation(std::size_t first, const double* x) const {
  double worst = -kInfinity;
  for (std::size_t i = first; i < count_; ++i) {
    double excess = -b_[i];
    for (std::size_t j = 0; j < p_; ++j) {
      excess += a_[j * stride_ + i] * x[j];
    }
    worst = std::max(worst, excess);
  }
  return worst;
}

void LinearProgram::add_rows(const Eigen::MatrixXd& a_columns, const Eigen::VectorXd& b) {
  const auto added = static_cast<std::size_t>(b.size());
  if (count_ + added > stride_) {
    const std::size_t wanted = std::max<std::size_t>(2 * stride_, count_ + added);
    const std::size_t stride = (wanted + kernels::kTile - 1) / kernels::kTile * kernels::kTile;
    std::vector<double> a(stride * p_, 0.0);
    for (std::size_t j = 0; j < p_; ++j) {
      std::copy_n(a_.begin() + static_cast<std::ptrdiff_t>(j * stride_), count_,
                  a.begin() + static_cast<std::ptrdiff_t>(j * stride));
    }
    a_ = std::move(a);
    b_.resize(stride, kInfinity);
    slack_.resize(stride);
    along_.resize(stride);
    stride_ = stride;
  }
  for (std::size_t k = 0; k < added; ++k) {
    for (std::size_t j = 0; j < p_; ++j) {
      a_[j * stride_ + count_ + k] = a_columns(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k));
    }
    b_[count_ + k] = b[static_cast<Eigen::Index>(k)];
  }
  count_ += added;
  for (std::size_t k = 0; k < seen_.size(); ++k) {
    for (std::size_t j = 0; j < p_; ++j) {
      row_[j] = seen_x_[j * kSeen + k];
    }
    if (violation(count_ - added, row_.data()) > kFeasible) {
      seen_[k].rows.clear();
    }
  }
  settled_ = false;
}

void LinearProgram::corner(const double* c) {
  for (std::size_t j = 0; j < p_; ++j) {
    basis_.rows[j] = -1 - static_cast<int>(2 * j + (c[j] > 0.0 ? 1 : 0));
  }
  factored_ = false;
}

bool LinearProgram::refactor() {
  const auto p = static_cast<Eigen::Index>(p_);
  Eigen::MatrixXd rows(p, p);
  for (std::size_t r = 0; r < p_; ++r) {
    for (std::size_t j = 0; j < p_; ++j) {
      rows(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(j)) = coefficient(basis_.rows[r], j);
    }
  }
  Eigen::Map<Eigen::MatrixXd> inverse(basis_.inverse.data(), p, p);
  inverse = core::LuFactors(rows).inverse();
  // One step of Newton's iteration halves the digits that are missing.
  inverse += inverse * (Eigen::MatrixXd::Identity(p, p) - rows * inverse);
  factored_ = inverse.allFinite() && inverse.cwiseAbs().maxCoeff() < 1e13;
  basis_.age = 0;
  return factored_;
}

void LinearProgram::place() {
  std::fill(x_.begin(), x_.end(), 0.0);
  for (std::size_t r = 0; r < p_; ++r) {
    const double b = bound(basis_.rows[r]);
    for (std::size_t j = 0; j < p_; ++j) {
      x_[j] += basis_.inverse[r * p_ + j] * b;
    }
  }
}

void LinearProgram::price(const double* c) {
  for (std::size_t r = 0; r < p_; ++r) {
    double sum = 0.0;
    for (std::size_t j = 0; j < p_; ++j) {
      sum += basis_.inverse[r * p_ + j] * c[j];
    }
    lambda_[r] = sum;
  }
}

/// Inverse, vertex and multipliers from the basis alone; false where it is singular.
bool LinearProgram::renew(const double* c) {
  if (!refactor()) {
    return false;
  }
  place();
  price(c);
  return true;
}

bool LinearProgram::priced() const {
  return std::all_of(lambda_.begin(), lambda_.end(), [](double l) { return l >= -kPriced; });
}

/// Whether vertex and multipliers still satisfy the equations of the basis.
bool LinearProgram::accurate(const double* c) const {
  double worst = 0.0;
  for (std::size_t j = 0; j < p_; ++j) {
    double rest = c[j];
    for (std::size_t r = 0; r < p_; ++r) {
      rest -= lambda_[r] * coefficient(basis_.rows[r], j);
    }
    worst = std::max(worst, std::abs(rest));
  }
  for (std::size_t r = 0; r < p_; ++r) {
    double rest = bound(basis_.rows[r]);
    for (std::size_t j = 0; j < p_; ++j) {
      rest -= coefficient(basis_.rows[r], j) * x_[j];
    }
    worst = std::max(worst, std::abs(rest));
  }
  return worst < kAccurate;
}

bool LinearProgram::inside() {
  kernels::best().slack(view(), x_.data(), slack_.data());
  slack_known_ = true;
  for (std::size_t i = 0; i < count_; ++i) {
    if (slack_[i] < -1e-11) {
      return false;
    }
  }
  for (std::size_t j = 0; j < p_; ++j) {
    if (x_[j] < lower_[j] - kFeasible || x_[j] > upper_[j] + kFeasible) {
      return false;
    }
  }
  return true;
}

/// Puts `entering` in the place of basis row `leaving`; alpha = Zᵀ a of the entering row.
void LinearProgram::exchange(std::size_t leaving, int entering, const double* alpha) {
  double* edge = basis_.inverse.data() + leaving * p_;
  const double pivot = 1.0 / alpha[leaving];
  for (std::size_t j = 0; j < p_; ++j) {
    edge[j] *= pivot;
  }
  for (std::size_t r = 0; r < p_; ++r) {
    if (r != leaving) {
      double* other = basis_.inverse.data() + r * p_;
      for (std::size_t j = 0; j < p_; ++j) {
        other[j] -= alpha[r] * edge[j];
      }
    }
  }
  basis_.rows[leaving] = entering;
  ++basis_.age;
}

LinearProgram::Outcome LinearProgram::dual(const double* c) {
  bool bland = careful_;
  std::size_t still = 0;
  slack_known_ = false;
  double feasible = kFeasible;
  for (std::size_t step = 0; step < 400 + 40 * p_; ++step) {
    if (basis_.age >= kRefactor && !renew(c)) {
      return Outcome::stuck;
    }
    int entering = 0;
    double violation = feasible;
    if (count_ > 0) {
      if (bland) {
        kernels::best().slack(view(), x_.data(), slack_.data());
        for (std::size_t i = 0; i < count_; ++i) {
          if (slack_[i] < -feasible) {
            violation = -slack_[i];
            entering = static_cast<int>(i);
            break;
          }
        }
      } else {
        const kernels::Found worst = kernels::best().most_violated(view(), x_.data());
        if (worst.value > violation) {
          violation = worst.value;
          entering = static_cast<int>(worst.row);
        }
      }
    }
    for (std::size_t j = 0; j < p_ && !(bland && violation > feasible); ++j) {
      const double below = lower_[j] - x_[j], above = x_[j] - upper_[j];
      if (std::max(below, above) > violation * (1.0 + 1e-12)) {
        violation = std::max(below, above);
        entering = -1 - static_cast<int>(2 * j + (above > below ? 1 : 0));
      }
    }
    if (!(violation > feasible)) {
      return Outcome::optimal;
    }
    if (std::find(basis_.rows.begin(), basis_.rows.end(), entering) != basis_.rows.end()) {
      // A row of the basis is met but for rounding: what it shows of that, no row can be better than.
      if (basis_.age > 0) {
        basis_.age = kRefactor;
        continue;
      }
      feasible = kRounding * violation;
      const double steepest =
          std::accumulate(lambda_.begin(), lambda_.end(), 1.0, [](double sum, double l) { return sum + std::abs(l); });
      if (feasible * steepest > kCoarse) {
        return Outcome::stuck;
      }
      continue;
    }
    for (std::size_t j = 0; j < p_; ++j) {
      row_[j] = coefficient(entering, j);
    }
    double least = kInfinity;
    for (std::size_t r = 0; r < p_; ++r) {
      double sum = 0.0;
      for (std::size_t j = 0; j < p_; ++j) {
        sum += basis_.inverse[r * p_ + j] * row_[j];
      }
      alpha_[r] = sum;
      if (sum > kPivot) {
        least = std::min(least, std::max(lambda_[r], 0.0) / sum);
      }
    }
    if (least == kInfinity) {
      if (basis_.age > 0) {
        basis_.age = kRefactor;
        continue;
      }
      return Outcome::infeasible;
    }
    std::size_t leaving = p_;
    const double tie = least * (1.0 + 1e-14) + 1e-14;
    for (std::size_t r = 0; r < p_; ++r) {
      if (alpha_[r] > kPivot && std::max(lambda_[r], 0.0) <= tie * alpha_[r] &&
          (leaving == p_ || (bland ? basis_.rows[r] < basis_.rows[leaving] : alpha_[r] > alpha_[leaving]))) {
        leaving = r;
      }
    }
    if (alpha_[leaving] < kGoodPivot && basis_.age > 0) {
      basis_.age = kRefactor;
      continue;
    }
    still = least * violation > 1e-15 ? 0 : still + 1;
    bland = careful_ || still > 10 + 2 * p_;
    exchange(leaving, entering, alpha_.data());
    for (std::size_t r = 0; r < p_; ++r) {
      lambda_[r] = r == leaving ? least : lambda_[r] - least * alpha_[r];
    }
    double gap = bound(entering);
    for (std::size_t j = 0; j < p_; ++j) {
      gap -= row_[j] * x_[j];
    }
    for (std::size_t j = 0; j < p_; ++j) {
      x_[j] += basis_.inverse[leaving * p_ + j] * gap;
    }
  }
  return Outcome::stuck;
}

LinearProgram::Outcome LinearProgram::primal(const double* c) {
  bool bland = careful_;
  std::size_t still = 0;
  for (std::size_t step = 0; step < 400 + 40 * p_; ++step) {
    if (basis_.age >= kRefactor) {
      if (!renew(c)) {
        return Outcome::stuck;
      }
      kernels::best().slack(view(), x_.data(), slack_.data());
    }
    if (enough_ < kInfinity) {
      double reached = 0.0;
      for (std::size_t j = 0; j < p_; ++j) {
        reached += c[j] * x_[j];
      }
      if (reached > enough_) {
        return Outcome::optimal;
      }
    }
    std::size_t leaving = p_;
    double steepest = -kPriced;
    for (std::size_t r = 0; r < p_; ++r) {
      if (lambda_[r] < -kPriced) {
        double norm = 0.0;
        for (std::size_t j = 0; j < p_; ++j) {
          norm += basis_.inverse[r * p_ + j] * basis_.inverse[r * p_ + j];
        }
        const double rate = lambda_[r] / std::sqrt(norm);
        if (leaving == p_ || (bland ? basis_.rows[r] < basis_.rows[leaving] : rate < steepest)) {
          steepest = rate;
          leaving = r;
        }
      }
    }
    if (leaving == p_) {
      return Outcome::optimal;
    }
    for (std::size_t j = 0; j < p_; ++j) {
      direction_[j] = -basis_.inverse[leaving * p_ + j];
    }
    double furthest = kInfinity, pivot = 0.0;
    int entering = 0;
    const auto offer = [&](int row, double ratio, double g) {
      const bool tie = ratio <= furthest + 1e-14 && ratio >= furthest - 1e-14;
      if (tie ? (bland ? row < entering : g > pivot) : ratio < furthest) {
        furthest = std::min(furthest, ratio);
        entering = row;
        pivot = g;
      }
    };
    if (count_ > 0) {
      const kernels::Found first =
          kernels::best().first_blocking(view(), slack_.data(), direction_.data(), kPivot, along_.data());
      if (first.value < kInfinity) {
        furthest = first.value;
        entering = static_cast<int>(first.row);
        pivot = along_[first.row];
        if (bland || pivot < kGoodPivot || furthest == 0.0) {
          for (std::size_t i = 0; i < count_; ++i) {
            if (along_[i] > kPivot) {
              offer(static_cast<int>(i), std::max(slack_[i], 0.0) / along_[i], along_[i]);
            }
          }
        }
      }
    }
    for (std::size_t j = 0; j < p_; ++j) {
      const double d = direction_[j];
      if (std::abs(d) > kPivot) {
        const double room = d > 0.0 ? upper_[j] - x_[j] : x_[j] - lower_[j];
        offer(-1 - static_cast<int>(2 * j + (d > 0.0 ? 1 : 0)), std::max(room, 0.0) / std::abs(d), std::abs(d));
      }
    }
    if (furthest == kInfinity || (pivot < kGoodPivot && basis_.age > 0)) {
      if (basis_.age == 0) {
        return Outcome::stuck;
      }
      basis_.age = kRefactor;
      continue;
    }
    still = -lambda_[leaving] * furthest > 1e-15 ? 0 : still + 1;
    bland = careful_ || still > 10 + 2 * p_;
    for (std::size_t r = 0; r < p_; ++r) {
      double sum = 0.0;
      for (std::size_t j = 0; j < p_; ++j) {
        sum += basis_.inverse[r * p_ + j] * coefficient(entering, j);
      }
      alpha_[r] = sum;
    }
    if (!(std::abs(alpha_[leaving]) > 0.5 * kPivot)) {
      return Outcome::stuck;
    }
    const double t = lambda_[leaving] / alpha_[leaving];
    exchange(leaving, entering, alpha_.data());
    for (std::size_t r = 0; r < p_; ++r) {
      lambda_[r] = r == leaving ? t : lambda_[r] - t * alpha_[r];
    }
    for (std::size_t j = 0; j < p_; ++j) {
      x_[j] += furthest * direction_[j];
    }
    for (std::size_t i = 0; i < count_; ++i) {
      slack_[i] -= furthest * along_[i];
    }
  }
  return Outcome::stuck;
}

LinearProgram::Outcome LinearProgram::solve(const double* c) {
  for (int round = 0; round < 4; ++round) {
    if (!factored_) {
      settled_ = false;
      if (!refactor()) {
        return Outcome::stuck;
      }
    }
    if (!settled_) {
      place();
      slack_known_ = false;
    }
    price(c);
    Outcome outcome = Outcome::stuck;
    if (priced()) {
      outcome = settled_ ? Outcome::optimal : dual(c);
    } else if ((settled_ && slack_known_) || inside()) {
      outcome = primal(c);
    }
    settled_ = outcome == Outcome::optimal;
    if (outcome != Outcome::optimal || basis_.age == 0 || accurate(c)) {
      return outcome;
    }
    // What a long walk has rounded is made afresh, and looked at once more.
    settled_ = false;
    if (!refactor()) {
      return Outcome::stuck;
    }
  }
  return Outcome::optimal;
}

LpSolution LinearProgram::report(const Eigen::VectorXd& c, double norm) {
  LpSolution result;
  const auto p = static_cast<Eigen::Index>(p_);
  result.x = Eigen::Map<const Eigen::VectorXd>(x_.data(), p);
  result.value = c.dot(result.x);
  result.status = LpSolution::Status::optimal;
  std::vector<double> positive;
  for (std::size_t r = 0; r < p_; ++r) {
    if (basis_.rows[r] < 0) {
      if (lambda_[r] > kOnBox) {
        result.status = LpSolution::Status::failed;
      }
    } else if (lambda_[r] > 0.0) {
      result.rows.push_back(basis_.rows[r]);
      positive.push_back(lambda_[r] * norm);
    }
  }
  result.multipliers = Eigen::Map<const Eigen::VectorXd>(positive.data(), static_cast<Eigen::Index>(positive.size()));
  return result;
}

LinearProgram::Outcome LinearProgram::solve_cold(const double* c) {
  Outcome outcome = Outcome::stuck;
  for (const bool careful : {false, true}) {
    careful_ = careful;
    corner(c);
    outcome = solve(c);
    if (outcome == Outcome::optimal) {
      break;
    }
  }
  careful_ = false;
  factored_ = factored_ && outcome == Outcome::optimal;
  settled_ = settled_ && factored_;
  return outcome;
}

/// Goes to the best of the vertices seen, if it is better than where the program stands.
void LinearProgram::recall(const double* c) {
  double value[kSeen] = {}, here = 0.0;
  for (std::size_t j = 0; j < p_; ++j) {
    here += c[j] * x_[j];
    for (std::size_t k = 0; k < kSeen; ++k) {
      value[k] += c[j] * seen_x_[j * kSeen + k];
    }
  }
  std::size_t best = kSeen;
  for (std::size_t k = 0; k < kSeen; ++k) {
    if (!seen_[k].rows.empty() && value[k] > here + kPriced) {
      here = value[k];
      best = k;
    }
  }
  if (best < kSeen) {
    basis_ = seen_[best];
    for (std::size_t j = 0; j < p_; ++j) {
      x_[j] = seen_x_[j * kSeen + best];
    }
    slack_known_ = false;
  }
}

void LinearProgram::remember() {
  seen_[next_seen_] = basis_;
  for (std::size_t j = 0; j < p_; ++j) {
    seen_x_[j * kSeen + next_seen_] = x_[j];
  }
  next_seen_ = (next_seen_ + 1) % kSeen;
}

std::optional<double> LinearProgram::reach(const double* c, double enough) {
  Outcome outcome = Outcome::stuck;
  enough_ = enough;
  if (seen_.empty()) {
    seen_.resize(kSeen);
    seen_x_.resize(kSeen * p_);
  }
  bool walked = true;
  if (factored_) {
    if (settled_) {
      recall(c);
      price(c);
    }
    walked = !(settled_ && priced());
    outcome = walked ? solve(c) : Outcome::optimal;
  }
  if (outcome != Outcome::optimal) {
    outcome = solve_cold(c);
  }
  if (walked && outcome == Outcome::optimal) {
    remember();
  }
  enough_ = kInfinity;
  if (outcome != Outcome::optimal) {
    return std::nullopt;
  }
  double value = 0.0;
  for (std::size_t j = 0; j < p_; ++j) {
    value += c[j] * x_[j];
  }
  return value;
}

LpSolution LinearProgram::maximise(const Eigen::VectorXd& c) {
  Basis last = factored_ ? basis_ : Basis{};
  return maximise(c, last);
}

LpSolution LinearProgram::maximise(const Eigen::VectorXd& c, Basis& start) {
  const double norm = c.norm();
  if (!(norm > 0.0) || !std::isfinite(norm)) {
    return {};
  }
  const Eigen::VectorXd unit = c / norm;
  const double* direction = unit.data();
  Outcome outcome = Outcome::stuck;
  if (!start.rows.empty()) {
    if (start.rows != basis_.rows || !factored_) {
      factored_ = !start.inverse.empty();
      basis_.rows = start.rows;
      if (factored_) {
        basis_ = start;
      }
      settled_ = false;
    }
    outcome = solve(direction);
  }
  if (outcome != Outcome::optimal) {
    outcome = solve_cold(direction);
  }
  if (outcome != Outcome::optimal) {
    LpSolution result;
    result.status = outcome == Outcome::infeasible ? LpSolution::Status::infeasible : LpSolution::Status::failed;
    return result;
  }
  start = basis_;
  return report(c, norm);
}

}  // namespace wheelwright::bounds
