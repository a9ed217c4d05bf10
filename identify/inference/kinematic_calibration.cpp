// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/kinematic_calibration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <Eigen/Core>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"
#include "identify/gram_kernels.hpp"
#include "identify/moments.hpp"
#include "identify/noise_level.hpp"

namespace wheelwright::inference {
namespace {

constexpr double kMadToSigma = 1.4826;
constexpr int kRescalings = 20;
constexpr std::size_t kFewestArcs = 8;

// Shared unknowns, all of order one: v = ρ r/2 (a_R ω_R + a_L ω_L), θ̇ = γ r/D (a_R ω_R − a_L ω_L), a = 1 ± ε; the
// pose's point is κ D ahead of the axle and its stamp is δ late.
enum Shared : int { kScale, kTurn, kAsymmetry, kOffset, kDelay, kShared };
using SharedVector = Eigen::Matrix<double, kShared, 1>;
using SharedMatrix = Eigen::Matrix<double, kShared, kShared>;

struct Pose {
  double t, x, y, theta;
};

struct Window {
  std::vector<double> t, right, left;
  std::vector<Pose> poses;
  std::array<double, 3> start{};  // θ, x, y at t.front()
};

double wrapped(double angle) { return std::remainder(angle, 2.0 * std::numbers::pi); }

// A pose and its derivatives by the shared unknowns and by the pose that the window starts from.
constexpr int kUnknowns = kShared + 3;
using Gradient = Eigen::Matrix<double, kUnknowns, 1>;
struct Place {
  double theta = 0.0, x = 0.0, y = 0.0;
  Gradient by_theta = Gradient::Unit(kShared), by_x = Gradient::Unit(kShared + 1), by_y = Gradient::Unit(kShared + 2);
};

// Where the robot is at the poses' stamps less δ, by the midpoint rule between wheel-speed samples (θ exactly).
template <bool derivatives>
std::vector<Place> predict(const Window& w, const KinematicOptions& o, const double* shared, const double* start) {
  const double right = 1.0 + shared[kAsymmetry], left = 1.0 - shared[kAsymmetry];
  const double per_forward = 0.5 * o.wheel_radius, forward = per_forward * shared[kScale];
  const double per_turning = o.wheel_radius / o.track_width, turning = per_turning * shared[kTurn];
  const double ahead = o.track_width * shared[kOffset];
  // `by_delay`: of the step.
  const auto moved = [&](Place at, std::size_t k, double step, double by_delay) {
    const double slope_r = 0.5 * (w.right[k + 1] - w.right[k]) / (w.t[k + 1] - w.t[k]);
    const double slope_l = 0.5 * (w.left[k + 1] - w.left[k]) / (w.t[k + 1] - w.t[k]);
    const double omega_r = w.right[k] + step * slope_r, omega_l = w.left[k] + step * slope_l;
    const double difference = right * omega_r - left * omega_l, sum = right * omega_r + left * omega_l;
    const double turn = step * turning * difference, way = step * forward * sum;
    const double heading = at.theta + 0.5 * turn, c = std::cos(heading), s = std::sin(heading);
    at.theta += turn;
    at.x += way * c;
    at.y += way * s;
    if constexpr (derivatives) {
      Gradient by_turn = Gradient::Zero(), by_way = Gradient::Zero();
      by_turn[kTurn] = step * per_turning * difference;
      by_turn[kAsymmetry] = step * turning * (omega_r + omega_l);
      by_turn[kDelay] = by_delay * turning * (difference + step * (right * slope_r - left * slope_l));
      by_way[kScale] = step * per_forward * sum;
      by_way[kAsymmetry] = step * forward * (omega_r - omega_l);
      by_way[kDelay] = by_delay * forward * (sum + step * (right * slope_r + left * slope_l));
      const Gradient by_heading = at.by_theta + 0.5 * by_turn;
      at.by_theta += by_turn;
      at.by_x += c * by_way - way * s * by_heading;
      at.by_y += s * by_way + way * c * by_heading;
    }
    return at;
  };
  std::vector<Place> places;
  places.reserve(w.poses.size());
  Place at{.theta = start[0], .x = start[1], .y = start[2]};
  std::size_t k = 0;
  for (const Pose& pose : w.poses) {
    const double end = pose.t - shared[kDelay];
    for (; k + 2 < w.t.size() && end >= w.t[k + 1]; ++k) {
      at = moved(at, k, w.t[k + 1] - w.t[k], 0.0);
    }
    Place& seen = places.emplace_back(moved(at, k, end - w.t[k], -1.0));
    const double c = std::cos(seen.theta), s = std::sin(seen.theta);
    seen.x += ahead * c;
    seen.y += ahead * s;
    if constexpr (derivatives) {
      seen.by_x -= ahead * s * seen.by_theta;
      seen.by_y += ahead * c * seen.by_theta;
      seen.by_x[kOffset] += o.track_width * c;
      seen.by_y[kOffset] += o.track_width * s;
    }
  }
  return places;
}

struct Spreads {
  double heading = 1.0;
  double position = 1.0;
};

// Residuals of a window over their spreads: θ, x, y of each pose, or θ alone. With a finite `huber` each is drawn in so
// that its square is Huber's loss (position: of the distance).
class WindowCost final : public ceres::CostFunction {
 public:
  WindowCost(const Window& window, const KinematicOptions& options, Spreads spreads, bool position, double huber)
      : window_(&window), options_(&options), spreads_(spreads), position_(position), huber_(huber) {
    *mutable_parameter_block_sizes() = {kShared, 3};
    set_num_residuals(static_cast<int>(window.poses.size() * (position ? 3 : 1)));
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    // The search may leave the range of the delay and come back; where the log does not show it, it shall not run away.
    const double delay = parameters[0][kDelay], most = options_->largest_delay;
    if (delay < -most || delay > 2.0 * most) {
      return false;
    }
    if (jacobians == nullptr) {
      return evaluate<false>(parameters, residuals, jacobians);
    }
    return evaluate<true>(parameters, residuals, jacobians);
  }

 private:
  template <bool derivatives>
  bool evaluate(const double* const* parameters, double* residuals, double** jacobians) const {
    const std::vector<Place> places = predict<derivatives>(*window_, *options_, parameters[0], parameters[1]);
    int row = 0;
    const auto write = [&](double residual, const Gradient& gradient) {
      residuals[row] = residual;
      if (jacobians != nullptr && jacobians[0] != nullptr) {
        std::copy_n(gradient.data(), +kShared, jacobians[0] + kShared * row);
      }
      if (jacobians != nullptr && jacobians[1] != nullptr) {
        std::copy_n(gradient.data() + kShared, 3, jacobians[1] + 3 * row);
      }
      ++row;
    };
    for (std::size_t k = 0; k < places.size(); ++k) {
      const Pose& measured = window_->poses[k];
      const double turn = (places[k].theta - measured.theta) / spreads_.heading;
      const Gradient by_turn = places[k].by_theta / spreads_.heading;
      const Drawn of_turn = drawn_in(turn * turn);
      write(turn * of_turn.factor, (of_turn.factor + 2.0 * turn * turn * of_turn.slope) * by_turn);
      if (position_) {
        const double dx = (places[k].x - measured.x) / spreads_.position;
        const double dy = (places[k].y - measured.y) / spreads_.position;
        const Gradient by_x = places[k].by_x / spreads_.position, by_y = places[k].by_y / spreads_.position;
        const Drawn drawn = drawn_in(dx * dx + dy * dy);
        const Gradient by_factor = 2.0 * drawn.slope * (dx * by_x + dy * by_y);
        write(dx * drawn.factor, drawn.factor * by_x + dx * by_factor);
        write(dy * drawn.factor, drawn.factor * by_y + dy * by_factor);
      }
    }
    return true;
  }

  // √(Huber's loss of s over s), and its derivative by s.
  struct Drawn {
    double factor = 1.0, slope = 0.0;
  };
  [[nodiscard]] Drawn drawn_in(double squared) const {
    if (!(squared > huber_ * huber_)) {
      return {};
    }
    const double size = std::sqrt(squared), share = huber_ / size;  // factor² = 2 share − share²
    const double factor = std::sqrt(2.0 * share - share * share);
    return {factor, 0.5 * (share * share - share) / (squared * factor)};
  }

  const Window* window_;
  const KinematicOptions* options_;
  Spreads spreads_;
  bool position_;
  double huber_;
};

void validate(const KinematicOptions& o) {
  check::positive(o.wheel_radius, "wheel_radius");
  check::positive(o.track_width, "track_width");
  check::non_negative(o.largest_delay, "largest_delay");
  check::positive(o.window, "window");
  check::that(o.largest_delay < 0.5 * o.window, "largest_delay", "less than half a window");
  check::positive(o.huber, "huber");
  check::that(o.fewest_poses >= 4, "fewest_poses", "at least 4");
}

std::vector<Window> cut(const LogTable& log, const KinematicOptions& o, bool position, KinematicCalibration& result) {
  const auto& right = log.column("omega_r");
  const auto& left = log.column("omega_l");
  const auto& theta = log.column("theta");
  static const std::vector<double> none;
  const auto& x = position ? log.column("x") : none;
  const auto& y = position ? log.column("y") : none;
  std::vector<std::size_t> starts = log.segment_starts;
  if (starts.empty() || starts.front() != 0) {
    starts.insert(starts.begin(), 0);
  }
  std::vector<Window> windows;
  for (std::size_t s = 0; s < starts.size(); ++s) {
    const std::size_t end = s + 1 < starts.size() ? starts[s + 1] : log.rows();
    for (std::size_t first = starts[s]; first + 1 < end;) {
      // The last row of a window is the first of the next one, as far as wheel speeds go.
      std::size_t last = first + 1;
      while (last + 1 < end && log.t[last + 1] - log.t[first] <= o.window) ++last;
      Window w;
      std::optional<std::size_t> before;
      for (std::size_t k = first; k <= last; ++k) {
        w.t.push_back(log.t[k]);
        w.right.push_back(right[k]);
        w.left.push_back(left[k]);
        if (k == last && last + 1 < end) {
          break;
        }
        const bool held =
            before && theta[k] == theta[*before] && (!position || (x[k] == x[*before] && y[k] == y[*before]));
        result.held_poses += held ? 1 : 0;
        if (held) {
          continue;
        }
        if (log.t[k] - log.t[first] >= o.largest_delay) {
          const double heading = w.poses.empty() ? theta[k] : w.poses.back().theta + wrapped(theta[k] - theta[*before]);
          w.poses.push_back({log.t[k], position ? x[k] : 0.0, position ? y[k] : 0.0, heading});
        }
        before = k;
      }
      if (w.poses.size() >= o.fewest_poses) {
        result.poses += w.poses.size();
        w.start = {w.poses.front().theta, w.poses.front().x, w.poses.front().y};
        windows.push_back(std::move(w));
      }
      first = last;
    }
  }
  return windows;
}

double robust_spread(std::vector<double> residuals) {
  for (double& r : residuals) r = std::abs(r);
  return kMadToSigma * core::median(std::move(residuals));
}

class Fit {
 public:
  Fit(std::vector<Window> windows, const KinematicOptions& options, bool position)
      : windows_(std::move(windows)), options_(&options), position_(position) {
    shared_ << 1.0, 1.0, 0.0, 0.0, 0.5 * options.largest_delay;
    free_ = {position && options.radius, true, options.asymmetry, position && options.axle_offset,
             options.largest_delay > 0.0};
  }

  // A delay that would leave its range stays at the end of it, and the rest is sought once more: bounds in the search
  // itself cost several times as many steps.
  bool solve() {
    const SharedVector shared = shared_;
    std::vector<std::array<double, 3>> starts(windows_.size());
    std::ranges::transform(windows_, starts.begin(), &Window::start);
    bool good = search(free_[kDelay]);
    const double within = std::clamp(shared_[kDelay], 0.0, options_->largest_delay);
    if (free_[kDelay] && within != shared_[kDelay]) {
      shared_ = shared;
      shared_[kDelay] = within;
      for (std::size_t k = 0; k < starts.size(); ++k) {
        windows_[k].start = starts[k];
      }
      good = search(false);
    }
    return good;
  }

  bool search(bool delay) {
    ceres::Problem problem;
    auto* order = new ceres::ParameterBlockOrdering;
    for (Window& w : windows_) {
      order->AddElementToGroup(w.start.data(), 0);
      problem.AddResidualBlock(new WindowCost(w, *options_, spreads_, position_, options_->huber), nullptr,
                               shared_.data(), w.start.data());
    }
    order->AddElementToGroup(shared_.data(), 1);
    std::vector<int> constant;
    for (int j = 0; j < kShared; ++j) {
      const bool needs_position = j == kScale || j == kOffset;
      const bool free = j == kDelay ? delay : free_[static_cast<std::size_t>(j)];
      if (!free || (needs_position && !position_)) constant.push_back(j);
    }
    if (!constant.empty()) {
      problem.SetManifold(shared_.data(), new ceres::SubsetManifold(kShared, constant));
    }
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_SCHUR;
    solver.linear_solver_ordering.reset(order);
    solver.max_num_iterations = 200;
    solver.max_num_consecutive_invalid_steps = 20;
    solver.function_tolerance = 1e-12;
    solver.parameter_tolerance = 1e-10;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    return summary.termination_type == ceres::CONVERGENCE;
  }

  // Solves and finds the spreads in turn until they settle. The heading goes first and alone, and keeps the spread it
  // has then: searched together, a small spread of the position could buy itself a large one of the heading.
  bool settle() {
    const bool position = position_;
    bool good = false;
    for (const bool with_position : {false, true}) {
      if (with_position && !position) {
        break;
      }
      position_ = with_position;
      for (int k = 0; k < kRescalings; ++k) {
        good = solve();
        if (rescale()) {
          break;
        }
      }
    }
    return good;
  }

  // Robust standard deviations of the residuals; true where they hardly changed.
  bool rescale() {
    std::vector<double> heading, position;
    for (const Window& w : windows_) {
      const auto poses = predict<false>(w, *options_, shared_.data(), w.start.data());
      for (std::size_t k = 0; k < poses.size(); ++k) {
        heading.push_back(poses[k].theta - w.poses[k].theta);
        position.push_back(poses[k].x - w.poses[k].x);
        position.push_back(poses[k].y - w.poses[k].y);
      }
    }
    // Exact data would leave nothing to divide by.
    const Spreads found{
        position_ ? spreads_.heading : std::max(robust_spread(heading), 1e-9),
        position_ ? std::max(robust_spread(position), 1e-9 * options_->track_width) : spreads_.position};
    const auto near = [](double a, double b) { return std::abs(a - b) <= 0.02 * b; };
    const bool settled = near(found.heading, spreads_.heading) && near(found.position, spreads_.position);
    spreads_ = found;
    return settled;
  }

  // Windows' information on the shared unknowns (their start poses eliminated) and scores, at the solution.
  struct Information {
    SharedMatrix total = SharedMatrix::Zero();
    std::vector<SharedMatrix> window;
    std::vector<SharedVector> score;
    std::size_t outlying = 0;
  };

  [[nodiscard]] Information information() const {
    Information info;
    for (const Window& w : windows_) {
      SharedMatrix A = SharedMatrix::Zero();
      Eigen::Matrix<double, kShared, 3> B = Eigen::Matrix<double, kShared, 3>::Zero();
      Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
      SharedVector score = SharedVector::Zero();
      Eigen::Vector3d own = Eigen::Vector3d::Zero();
      const WindowCost cost(w, *options_, spreads_, position_, core::kInfinity);
      const int rows = cost.num_residuals();
      Eigen::VectorXd residual(rows);
      Eigen::Matrix<double, Eigen::Dynamic, kShared, Eigen::RowMajor> J(rows, +kShared);
      Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> S(rows, 3);
      const std::array<const double*, 2> at = {shared_.data(), w.start.data()};
      std::array<double*, 2> jacobians = {J.data(), S.data()};
      cost.Evaluate(at.data(), residual.data(), jacobians.data());
      const auto add = [&](int first, int n) {
        const Eigen::VectorXd r = residual.segment(first, n);
        const auto Jk = J.middleRows(first, n);
        const auto Sk = S.middleRows(first, n);
        // Second derivative of Huber's loss: along a large residual it is linear.
        const double length = r.norm();
        const double weight = length > options_->huber ? options_->huber / length : 1.0;
        Eigen::MatrixXd curvature = Eigen::MatrixXd::Identity(n, n) * weight;
        if (length > options_->huber) {
          curvature -= weight * r * r.transpose() / (length * length);
        }
        info.outlying += length > 3.0 * std::sqrt(static_cast<double>(n)) ? 1 : 0;
        A += Jk.transpose() * curvature * Jk;
        B += Jk.transpose() * curvature * Sk;
        C += Sk.transpose() * curvature * Sk;
        score -= weight * Jk.transpose() * r;
        own -= weight * Sk.transpose() * r;
      };
      const int each = position_ ? 3 : 1;
      for (int first = 0; first < rows; first += each) {
        add(first, 1);
        if (position_) {
          add(first + 1, 2);
        }
      }
      if (!position_) {
        C.bottomRightCorner<2, 2>().setIdentity();
      }
      const Eigen::Matrix3d start = core::pseudo_inverse(C);
      info.window.push_back(A - B * start * B.transpose());
      info.score.push_back(score - B * start * own);
      info.total += info.window.back();
    }
    return info;
  }

  [[nodiscard]] const SharedVector& shared() const { return shared_; }
  [[nodiscard]] bool is_free(int j) const { return free_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] const Spreads& spreads() const { return spreads_; }

 private:
  std::vector<Window> windows_;
  const KinematicOptions* options_;
  bool position_;
  SharedVector shared_;
  std::array<bool, kShared> free_{};
  Spreads spreads_{0.01, 0.01};
};

struct Spread {
  SharedMatrix covariance = SharedMatrix::Zero();
  std::array<bool, kShared> known{};
  double freedom = 0.0;
};

// Unknowns that the total information does not tell apart are dropped, the least informed first.
Spread spread_of(const Fit& fit, const Fit::Information& info) {
  constexpr double kRankTolerance = 1e-10;
  Spread s;
  std::vector<int> pick;
  for (int j = 0; j < kShared; ++j) {
    if (fit.is_free(j) && info.total(j, j) > 0.0) pick.push_back(j);
  }
  Eigen::MatrixXd H;
  for (;;) {
    H = info.total(pick, pick);
    const Eigen::VectorXd scale = H.diagonal().cwiseSqrt();
    const Eigen::MatrixXd unit = scale.cwiseInverse().asDiagonal() * H * scale.cwiseInverse().asDiagonal();
    const core::EigenPairs eigen = core::symmetric_eigen(unit);
    if (pick.empty() || eigen.values[0] > kRankTolerance) {
      break;
    }
    Eigen::Index worst = 0;
    eigen.vectors.col(0).cwiseAbs().maxCoeff(&worst);
    pick.erase(pick.begin() + worst);
  }
  const auto m = static_cast<Eigen::Index>(pick.size());
  if (m == 0) {
    return s;
  }
  identify::BlockSums scores(static_cast<std::size_t>(m));
  Eigen::MatrixXd apart = Eigen::MatrixXd::Zero(m, m);  // covariance of the sum if windows were independent
  for (std::size_t k = 0; k < info.score.size(); ++k) {
    const Eigen::MatrixXd without = H - Eigen::MatrixXd(info.window[k](pick, pick));
    const core::LdltFactors solver(without);
    Eigen::VectorXd score = info.score[k](pick);
    if (solver.positive()) {
      score = H * solver.solve(score);
    }
    scores.add(score);
    apart += score * score.transpose();
  }
  identify::LongRunCovariance spread = identify::long_run_covariance(scores);
  // The larger of the two in every direction, in units of the information.
  const Eigen::VectorXd unit = H.diagonal().cwiseSqrt();
  const Eigen::MatrixXd more =
      unit.cwiseInverse().asDiagonal() * (apart - spread.matrix) * unit.cwiseInverse().asDiagonal();
  const core::EigenPairs eigen = core::symmetric_eigen(more);
  spread.matrix += unit.asDiagonal() *
                   (eigen.vectors * eigen.values.cwiseMax(0.0).asDiagonal() * eigen.vectors.transpose()) *
                   unit.asDiagonal();
  const Eigen::MatrixXd inverse = core::LdltFactors(H).solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(m, m)));
  const Eigen::MatrixXd covariance = inverse * spread.matrix * inverse;
  for (Eigen::Index a = 0; a < m; ++a) {
    s.known[static_cast<std::size_t>(pick[static_cast<std::size_t>(a)])] = true;
    for (Eigen::Index b = 0; b < m; ++b) {
      s.covariance(pick[static_cast<std::size_t>(a)], pick[static_cast<std::size_t>(b)]) = covariance(a, b);
    }
  }
  s.freedom = spread.freedom;
  return s;
}

}  // namespace

KinematicCalibration calibrate_kinematics(const LogTable& log, const KinematicOptions& options) {
  validate(options);
  const bool position = log.find("x") != nullptr && log.find("y") != nullptr;
  KinematicCalibration result;
  std::vector<Window> windows = cut(log, options, position, result);
  result.windows = windows.size();
  check::that(windows.size() >= kFewestArcs, "kinematic calibration",
              "at least 8 windows with poses, found " + std::to_string(windows.size()));
  Fit fit(std::move(windows), options, position);
  result.converged = fit.settle();
  const Fit::Information info = fit.information();
  const Spread spread = spread_of(fit, info);
  result.outlying_poses = info.outlying;
  result.heading_spread = fit.spreads().heading;
  result.position_spread = position ? fit.spreads().position : 0.0;
  result.freedom = spread.freedom;

  const SharedVector& s = fit.shared();
  const double t95 = spread.freedom > 0.0 ? core::student_quantile(0.95, spread.freedom) : core::kInfinity;
  // A quantity with gradient `by` of the shared unknowns; given up where its interval is wider than ± `widest`.
  const auto quantity = [&](double estimate, const SharedVector& by, double widest, const char* reason) {
    KinematicQuantity q;
    q.estimate = q.lower = q.upper = estimate;
    bool searched = false;
    bool known = true;
    for (int j = 0; j < kShared; ++j) {
      if (by[j] != 0.0 && fit.is_free(j)) {
        searched = true;
        known = known && spread.known[static_cast<std::size_t>(j)];
      }
    }
    if (!searched) {
      return q;
    }
    q.standard_error = known ? std::sqrt(by.dot(spread.covariance * by)) : core::kInfinity;
    const double half = t95 * q.standard_error;
    q.state = half <= widest ? KinematicState::identified : KinematicState::not_identified;
    if (q.state == KinematicState::not_identified) {
      q.reason = reason;
    }
    q.lower = estimate - half;
    q.upper = estimate + half;
    return q;
  };
  const double r = options.wheel_radius;
  const double D = options.track_width;
  const char* turn = "the log hardly turns: drive arcs and turns on the spot";
  const char* straight = "the log hardly moves forward: drive straight lines and arcs";
  const char* both = "the log does not tell the wheels apart: drive straight and turn both ways";
  SharedVector by = SharedVector::Zero();
  by[kScale] = r * (1.0 + s[kAsymmetry]);
  by[kAsymmetry] = r * s[kScale];
  result.radius_right = quantity(r * s[kScale] * (1.0 + s[kAsymmetry]), by, 0.25 * r, straight);
  by[kScale] = r * (1.0 - s[kAsymmetry]);
  by[kAsymmetry] = -r * s[kScale];
  result.radius_left = quantity(r * s[kScale] * (1.0 - s[kAsymmetry]), by, 0.25 * r, straight);
  by.setZero();
  by[kScale] = D / s[kTurn];
  by[kTurn] = -D * s[kScale] / (s[kTurn] * s[kTurn]);
  const double track = D * s[kScale] / s[kTurn];
  result.track_width = quantity(track, by, 0.25 * std::abs(track), turn);
  by.setZero();
  by[kTurn] = -D / (s[kTurn] * s[kTurn]);
  result.track_at_nominal_radius = quantity(D / s[kTurn], by, 0.25 * std::abs(D / s[kTurn]), turn);
  result.radius_scale = quantity(s[kScale], SharedVector::Unit(kScale), 0.25, straight);
  result.asymmetry = quantity(s[kAsymmetry], SharedVector::Unit(kAsymmetry), 0.1, both);
  result.axle_offset = quantity(D * s[kOffset], D * SharedVector::Unit(kOffset), 0.25 * D, turn);
  result.delay = quantity(s[kDelay], SharedVector::Unit(kDelay), 0.5 * options.largest_delay,
                          "the motion changes too slowly to show a delay: accelerate and turn more briskly");
  return result;
}

}  // namespace wheelwright::inference
