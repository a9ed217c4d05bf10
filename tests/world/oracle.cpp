// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/world/oracle.hpp"
#include "tests/world/rivals.hpp"

namespace wheelwright::reality {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The four columns of the nominal model and the healthy robot's parameters.
struct Nominal {
  std::array<Column, 4> columns;  ///< of m, f1, I, f3
  Eigen::Vector4d healthy;
};

Nominal nominal_model(const RobotDesign& robot, const Signals& g) {
  const VectorXd none = VectorXd::Zero(g.rows());
  const double r = robot.radius;
  const double arm = robot.half_track;
  const double f1 = 2.0 * robot.damping / (r * r);
  return {{Column{r * g.a1, none, none, none}, Column{r * g.v1, none, none, none},
           Column{none, r / arm * g.a2, none, none}, Column{none, r / arm * g.v2, none, none}},
          Eigen::Vector4d(robot.mass, f1, robot.yaw_inertia, f1 * arm * arm)};
}

/// Turns columns into rows: filtered torque, then pose against odometry over half a second, each in units of its noise.
class Rows {
 public:
  Rows(const RobotDesign& robot, const Signals& g, double beta, double torque_sigma)
      : g_(g), beta_(beta), torque_weight_(1.0 / torque_sigma) {
    stride_ = std::max<Index>(1, static_cast<Index>(2.0 / (beta * g.period)));
    window_ = static_cast<Index>(std::lround(0.5 / g.period));
    torque_rows_ = (g.rows() - 1) / stride_ + 1;
    pose_rows_ = (g.rows() - 1) / window_;
    // What rolling without slip and the windows themselves leave on a healthy robot.
    constexpr double floor = 2e-4;
    place_weight_ = 1.0 / std::sqrt(2.0 * std::pow(robot.position_noise, 2) + floor * floor);
    heading_weight_ = 1.0 / std::sqrt(2.0 * std::pow(robot.heading_noise, 2) + floor * floor);
  }

  [[nodiscard]] Index torque_size() const { return 2 * torque_rows_; }
  [[nodiscard]] Index pose_size() const { return 2 * pose_rows_; }
  [[nodiscard]] Index size() const { return torque_size() + pose_size(); }

  [[nodiscard]] VectorXd operator()(const Column& column) const {
    VectorXd out(size());
    fill_torque(out, column.s, 0);
    fill_torque(out, column.d, torque_rows_);
    for (Index k = 0; k < pose_rows_; ++k) {
      const Index begin = k * window_;
      const double middle = g_.heading[begin + window_ / 2];
      double forward = 0.0;
      double yaw = 0.0;
      for (Index j = begin; j <= begin + window_; ++j) {
        const double weight = g_.period * (j == begin || j == begin + window_ ? 0.5 : 1.0);
        forward += weight * column.v1[j] * std::cos(g_.heading[j] - middle);
        yaw += weight * column.v2[j];
      }
      out[torque_size() + k] = place_weight_ * forward;
      out[torque_size() + pose_rows_ + k] = heading_weight_ * yaw;
    }
    return out;
  }

  /// Torque (the command where `torque` is empty), and pose less odometry.
  [[nodiscard]] VectorXd target(const std::array<VectorXd, 2>& torque, double late) const {
    VectorXd out(size());
    const bool command = torque[0].size() == 0;
    fill_torque(out, command ? g_.s : VectorXd(torque[right] + torque[left]), 0);
    fill_torque(out, command ? g_.d : VectorXd(torque[right] - torque[left]), torque_rows_);
    const VectorXd odometry = (*this)(Column{g_.s, g_.d, g_.v1, g_.v2});
    for (Index k = 0; k < pose_rows_; ++k) {
      const Index a = k * window_;
      const Index b = a + window_;
      const double middle = g_.heading[a + window_ / 2];
      const double along = (g_.x[b] - g_.x[a]) * std::cos(middle) + (g_.y[b] - g_.y[a]) * std::sin(middle);
      const double turned = g_.heading[b] - g_.heading[a];
      const Index row = torque_size() + k;
      out[row] = place_weight_ * (along - late * (g_.v1[b] - g_.v1[a])) - odometry[row];
      out[row + pose_rows_] = heading_weight_ * (turned - late * (g_.v2[b] - g_.v2[a])) - odometry[row + pose_rows_];
    }
    return out;
  }

 private:
  void fill_torque(VectorXd& out, const VectorXd& u, Index first) const {
    const VectorXd smooth = low_pass(u, g_.period, beta_);
    for (Index k = 0; k < torque_rows_; ++k) {
      out[first + k] = torque_weight_ * smooth[k * stride_];
    }
  }

  const Signals& g_;
  double beta_;
  double torque_weight_;
  double place_weight_ = 1.0;
  double heading_weight_ = 1.0;
  Index stride_ = 1;
  Index window_ = 1;
  Index torque_rows_ = 0;
  Index pose_rows_ = 0;
};

VectorXd least_squares(const MatrixXd& a, const VectorXd& b) {
  const VectorXd scale = a.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse();
  const MatrixXd scaled = a * scale.asDiagonal();
  MatrixXd normal = scaled.transpose() * scaled;
  normal.diagonal().array() += 1e-12;
  return scale.asDiagonal() * normal.ldlt().solve(scaled.transpose() * b);
}

/// Fits of effects to one drive.
class Trial {
 public:
  Trial(const RobotDesign& robot, const Signals& g, const Rows& rows, bool parametric)
      : robot_(robot), g_(g), rows_(rows), parametric_(parametric) {
    const Nominal model = nominal_model(robot, g);
    for (std::size_t j = 0; j < 4; ++j) {
      nominal_.col(static_cast<Index>(j)) = rows(model.columns[j]);
    }
    healthy_ = model.healthy;
  }

  struct Fit {
    double torque = 0.0;  ///< squared, in units of the noise variance
    double pose = 0.0;
    double shape = 0.0;
    [[nodiscard]] double sum() const { return torque + pose; }
  };

  /// With both effects at given shapes; either may be null.
  [[nodiscard]] Fit at(const Rival* one, double p, const Rival* two, double q) const {
    std::vector<VectorXd> columns;
    std::array<VectorXd, 2> torque;
    double late = 0.0;
    Signals changed;
    const Signals* signals = &g_;
    for (const auto& [rival, shape] : {std::pair{one, p}, std::pair{two, q}}) {
      if (rival == nullptr) {
        continue;
      }
      const Guess guess = rival->guess(robot_, *signals, shape);
      for (const Column& column : guess.columns) {
        columns.push_back(rows_(column));
      }
      late += guess.late;
      if (guess.torque[0].size() > 0) {
        torque = guess.torque;
        changed = g_;
        changed.torque = torque;
        changed.s = torque[right] + torque[left];
        changed.d = torque[right] - torque[left];
        signals = &changed;
      }
    }
    VectorXd target = rows_.target(torque, late);
    const Index free = parametric_ ? 0 : 4;
    if (parametric_) {
      target -= nominal_ * healthy_;
    }
    MatrixXd a(rows_.size(), free + static_cast<Index>(columns.size()));
    a.leftCols(free) = nominal_.leftCols(free);
    for (std::size_t j = 0; j < columns.size(); ++j) {
      a.col(free + static_cast<Index>(j)) = columns[j];
    }
    const VectorXd left_over = a.cols() > 0 ? VectorXd(target - a * least_squares(a, target)) : target;
    return {left_over.head(rows_.torque_size()).squaredNorm(), left_over.tail(rows_.pose_size()).squaredNorm(), p};
  }

  /// The same with the best shape of `one`: a grid, then golden sections around its best point.
  [[nodiscard]] Fit best(const Rival& one, const Rival* two, double q) const {
    if (one.low == one.high) {
      return at(&one, one.low, two, q);
    }
    constexpr int points = 9;
    const bool log = one.low > 0.0;
    const auto shape = [&](double u) {
      return log ? one.low * std::pow(one.high / one.low, u) : one.low + u * (one.high - one.low);
    };
    Fit best{std::numeric_limits<double>::infinity(), 0.0, 0.0};
    double centre = 0.0;
    for (int k = 0; k < points; ++k) {
      const double u = k / (points - 1.0);
      const Fit fit = at(&one, shape(u), two, q);
      if (fit.sum() < best.sum()) {
        best = fit;
        centre = u;
      }
    }
    double a = std::max(0.0, centre - 1.0 / (points - 1.0));
    double b = std::min(1.0, centre + 1.0 / (points - 1.0));
    constexpr double golden = 0.6180339887498949;
    for (int k = 0; k < 10; ++k) {
      const double u = b - golden * (b - a);
      const double v = a + golden * (b - a);
      const Fit low = at(&one, shape(u), two, q);
      const Fit high = at(&one, shape(v), two, q);
      (low.sum() < high.sum() ? b : a) = low.sum() < high.sum() ? v : u;
      for (const Fit& fit : {low, high}) {
        best = fit.sum() < best.sum() ? fit : best;
      }
    }
    return best;
  }

 private:
  const RobotDesign& robot_;
  const Signals& g_;
  const Rows& rows_;
  bool parametric_;
  Eigen::Matrix<double, Eigen::Dynamic, 4> nominal_{rows_.size(), 4};
  Eigen::Vector4d healthy_;
};

bool names(const std::vector<std::string>& truth, std::string_view rival) {
  return std::any_of(truth.begin(), truth.end(), [&](const std::string& name) { return nests(rival, name); });
}

/// How far `fit` is beyond the noise: the larger of both spaces, 0 where it does not stand out of its own scatter.
double excess(const Trial::Fit& fit, const Rows& rows) {
  const auto beyond = [](double square, Index size) {
    return square > 16.0 ? square / static_cast<double>(size) : 0.0;
  };
  return std::max(beyond(fit.torque, rows.torque_size()), beyond(fit.pose, rows.pose_size()));
}

double rms(const VectorXd& s, const VectorXd& d) {
  return std::sqrt((s.squaredNorm() + d.squaredNorm()) / static_cast<double>(2 * s.size()));
}

}  // namespace

Gap measure_gap(const RobotDesign& robot, const Signals& g, double beta) {
  const Nominal model = nominal_model(robot, g);
  const Index n = g.rows();
  MatrixXd a(2 * n, 4);
  VectorXd b(2 * n);
  b << low_pass(g.s, g.period, beta), low_pass(g.d, g.period, beta);
  for (std::size_t j = 0; j < 4; ++j) {
    const Column& column = model.columns[j];
    a.col(static_cast<Index>(j)) << low_pass(column.s, g.period, beta), low_pass(column.d, g.period, beta);
  }
  const Eigen::Vector4d fitted = least_squares(a, b);
  const double whole = b.norm();
  const double after = (b - a * fitted).norm();
  const VectorXd centred = b.array() - b.mean();
  return {100.0 * (b - a * model.healthy).norm() / whole, 100.0 * after / whole,
          1.0 - after * after / centred.squaredNorm(), fitted};
}

double noise_floor(const RobotDesign& robot, const Signals& clean, const Signals& log, double beta) {
  const Nominal model = nominal_model(robot, clean);
  const double r = robot.radius;
  const double arm = robot.half_track;
  // The accelerations of the log are central differences: so must be those of the noise-free speeds.
  const auto differenced = [&](const VectorXd& v) {
    VectorXd out = VectorXd::Zero(v.size());
    const Index n = v.size() - 2;
    out.segment(1, n) = (v.tail(n) - v.head(n)) / (2.0 * clean.period);
    return out;
  };
  const Eigen::Vector4d& h = model.healthy;
  const VectorXd s = (log.s - clean.s) - r * (h[0] * (log.a1 - differenced(clean.v1)) + h[1] * (log.v1 - clean.v1));
  const VectorXd d =
      (log.d - clean.d) - r / arm * (h[2] * (log.a2 - differenced(clean.v2)) + h[3] * (log.v2 - clean.v2));
  return 100.0 * rms(low_pass(s, clean.period, beta), low_pass(d, clean.period, beta)) /
         rms(low_pass(clean.s, clean.period, beta), low_pass(clean.d, clean.period, beta));
}

Oracle ask_oracle(const RobotDesign& robot, const Signals& clean, const std::vector<std::string>& truth,
                  bool parametric, double floor_percent, double beta) {
  Oracle oracle;
  oracle.floor_percent = floor_percent;
  oracle.beta = beta;
  if (truth.empty()) {
    return oracle;
  }
  const double torque = rms(low_pass(clean.s, clean.period, beta), low_pass(clean.d, clean.period, beta));
  const Rows rows(robot, clean, beta, 0.01 * floor_percent * torque);
  const Trial trial(robot, clean, rows, parametric);
  const std::vector<Rival> all = rivals(robot);
  std::vector<const Rival*> own;
  for (const std::string& name : truth) {
    for (const Rival& rival : all) {
      if (rival.name == name) {
        own.push_back(&rival);
      }
    }
  }
  double nearest = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Rival& rival, const Rival* beside, double shape, const std::string& label) {
    const double value = excess(trial.best(rival, beside, shape), rows);
    if (value < nearest) {
      nearest = value;
      oracle.closest_rival = label;
    }
  };
  const double none = trial.at(nullptr, 0.0, nullptr, 0.0).sum();
  if (own.size() == 1 && truth.size() == 1) {
    oracle.own_form = std::sqrt(trial.best(*own[0], nullptr, 0.0).sum() / none);
  }
  if (own.size() == 2) {
    double shapes[2] = {0.0, trial.best(*own[1], nullptr, 0.0).shape};
    for (int k = 0; k < 2; ++k) {
      shapes[0] = trial.best(*own[0], own[1], shapes[1]).shape;
      shapes[1] = trial.best(*own[1], own[0], shapes[0]).shape;
    }
    oracle.own_form = std::sqrt(trial.at(own[0], shapes[0], own[1], shapes[1]).sum() / none);
    for (std::size_t k = 0; k < 2; ++k) {
      for (const Rival& rival : all) {
        if (!names(truth, rival.name) && !rival.parametric) {
          consider(rival, own[k], shapes[k], std::string(own[k]->name) + " + " + std::string(rival.name));
        }
      }
    }
  } else {
    for (const Rival& rival : all) {
      // With the nominal parameters free, changes of them explain nothing but by their kinematics.
      const bool kinematic = rival.name == "wheel_radius" || rival.name == "track_width" ||
                             rival.name == "encoder_scale" || rival.name == "wheel_radius_asymmetric";
      const bool comparable = kinematic || rival.parametric == parametric;
      if (!names(truth, rival.name) && comparable) {
        consider(rival, nullptr, 0.0, std::string(rival.name));
      }
    }
  }
  oracle.excess = nearest;
  oracle.separable = nearest > 0.1;
  return oracle;
}

}  // namespace wheelwright::reality
