// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>

#include "core/error.hpp"
#include "tests/world/engine.hpp"
#include "tests/world/replay.hpp"
#include "tests/world/robot.hpp"
#include "tests/world/signals.hpp"

namespace wheelwright::reality {
namespace {

constexpr double kSettling = 1.0;   // s for which the robot stands before anything is compared
constexpr double kStiffness = 0.5;  // of the servo: of a wheel's speed error, corrected in a step
constexpr double kRest = 0.02;      // of the wheels' root mean square speed: hardly moving

// Quadratic over five samples (Savitzky and Golay 1964); the ends as they are.
std::vector<double> smoothed(const std::vector<double>& u) {
  std::vector<double> out = u;
  for (std::size_t k = 2; k + 2 < u.size(); ++k) {
    out[k] = (-3.0 * (u[k - 2] + u[k + 2]) + 12.0 * (u[k - 1] + u[k + 1]) + 17.0 * u[k]) / 35.0;
  }
  return out;
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) {
    sum += v * v;
  }
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

class Runner {
 public:
  Runner(const std::string& xml, const LogTable& log, const ReplayOptions& options)
      : options_(options), model_(compile(xml)), data_(mj_makeData(model_.get())), t_(log.t) {
    period_ = core::median_step(log.t);
    if (!(period_ > 0.0) || log.rows() < 16) {
      throw Error("replay: a log of fewer than 16 rows");
    }
    double& step = model_->opt.timestep;
    step = period_ / std::ceil(period_ / step - 1e-9);
    find_joints();
    for (std::size_t i = 0; i < 2; ++i) {
      speed_[i] = smoothed(log.column(i == right ? "omega_r" : "omega_l"));
      torque_[i] = log.column(i == right ? "tau_r" : "tau_l");
      for (const double value : torque_[i]) {
        largest_ = std::max(largest_, std::abs(value));
      }
    }
    x_ = smoothed(log.column("x"));
    y_ = smoothed(log.column("y"));
    heading_ = log.column("theta");
    for (std::size_t k = 1; k < heading_.size(); ++k) {
      heading_[k] = heading_[k - 1] + std::remainder(heading_[k] - heading_[k - 1], 2.0 * std::numbers::pi);
    }
    heading_ = smoothed(heading_);
    starts_.assign(log.rows(), false);
    for (const std::size_t start : log.segment_starts) {
      starts_[start] = true;
    }
    settle();
  }

  Replay run() {
    Replay out;
    out.wheel_radius = options_.wheel_radius.value_or(radius_);
    out.track_width = options_.track_width.value_or(track_);
    torques(out);
    open_loop(out);
    return out;
  }

 private:
  void find_joints() {
    for (std::size_t i = 0; i < 2; ++i) {
      const std::string& name = i == right ? options_.right : options_.left;
      const int id = mj_name2id(model_.get(), mjOBJ_JOINT, name.c_str());
      if (id < 0 || model_->jnt_type[id] != mjJNT_HINGE) {
        throw Error(fmt::format("replay: the file has no hinge called {}", name));
      }
      dof_[i] = model_->jnt_dofadr[id];
      body_[i] = model_->jnt_bodyid[id];
      for (int k = 0; k < model_->nu; ++k) {
        if (model_->actuator_trntype[k] == mjTRN_JOINT && model_->actuator_trnid[2 * k] == id &&
            model_->actuator_biastype[k] == mjBIAS_NONE && model_->actuator_gainprm[mjNGAIN * k] > 0.0) {
          motor_[i] = k;
        }
      }
    }
    for (int k = 0; k < model_->njnt; ++k) {
      if (model_->jnt_type[k] == mjJNT_FREE) {
        base_q_ = model_->jnt_qposadr[k];
        base_v_ = model_->jnt_dofadr[k];
        for (int body = 1; body < model_->nbody; ++body) {
          mass_ +=
              model_->body_rootid[body] == model_->body_rootid[model_->jnt_bodyid[k]] ? model_->body_mass[body] : 0.0;
        }
      }
    }
    if (base_q_ < 0) {
      throw Error("replay: the robot has no free joint");
    }
  }

  [[nodiscard]] double* q() { return data_->qpos; }
  [[nodiscard]] double* v() { return data_->qvel; }

  // Where it comes to rest, its wheels held; radius and track by its own wheels.
  void settle() {
    mj_resetData(model_.get(), data_.get());
    const auto steps = static_cast<std::size_t>(kSettling / model_->opt.timestep);
    for (std::size_t n = 0; n < steps; ++n) {
      for (const int dof : dof_) {
        v()[dof] = 0.0;
      }
      mj_step(model_.get(), data_.get());
    }
    rest_.assign(q(), q() + model_->nq);
    mj_forward(model_.get(), data_.get());
    const double* const a = data_->xpos + 3 * body_[right];
    const double* const b = data_->xpos + 3 * body_[left];
    radius_ = 0.5 * (a[2] + b[2]);
    track_ = std::hypot(a[0] - b[0], a[1] - b[1]);
    turned_ = heading_of(rest_.data() + base_q_ + 3);
  }

  static double heading_of(const double* quat) {
    return std::atan2(2.0 * (quat[0] * quat[3] + quat[1] * quat[2]),
                      1.0 - 2.0 * (quat[2] * quat[2] + quat[3] * quat[3]));
  }

  // The state of the log at row k; the robot's own pose at rest, turned.
  void set_state(std::size_t k) {
    mj_resetData(model_.get(), data_.get());
    std::ranges::copy(rest_, q());
    const double turn = heading_[k] - turned_;
    const double c = std::cos(0.5 * turn), s = std::sin(0.5 * turn);
    double* const quat = q() + base_q_ + 3;
    const std::array<double, 4> old = {quat[0], quat[1], quat[2], quat[3]};
    quat[0] = c * old[0] - s * old[3];
    quat[1] = c * old[1] - s * old[2];
    quat[2] = c * old[2] + s * old[1];
    quat[3] = c * old[3] + s * old[0];
    q()[base_q_] = x_[k];
    q()[base_q_ + 1] = y_[k];
    const double v1 = 0.5 * radius_ * (speed_[right][k] + speed_[left][k]);
    const double v2 = radius_ / track_ * (speed_[right][k] - speed_[left][k]);
    v()[base_v_] = v1 * std::cos(heading_[k]);
    v()[base_v_ + 1] = v1 * std::sin(heading_[k]);
    v()[base_v_ + 5] = v2;
    for (std::size_t i = 0; i < 2; ++i) {
      v()[dof_[i]] = speed_[i][k];
    }
    mj_forward(model_.get(), data_.get());
  }

  void command(std::size_t i, double torque) {
    if (motor_[i] >= 0) {
      data_->ctrl[motor_[i]] = torque;
    } else {
      data_->qfrc_applied[dof_[i]] = torque;
    }
  }

  // Commands beyond a motor's limits are all one; and none is three times the log's largest.
  [[nodiscard]] double within_limits(std::size_t i, double torque) const {
    const int k = motor_[i];
    double low = -3.0 * largest_, high = 3.0 * largest_;
    if (k >= 0 && model_->actuator_ctrllimited[k]) {
      low = std::max(low, model_->actuator_ctrlrange[2 * k]);
      high = std::min(high, model_->actuator_ctrlrange[2 * k + 1]);
    }
    if (k >= 0 && model_->actuator_forcelimited[k]) {
      const double gain = model_->actuator_gainprm[mjNGAIN * k];
      low = std::max(low, model_->actuator_forcerange[2 * k] / gain);
      high = std::min(high, model_->actuator_forcerange[2 * k + 1] / gain);
    }
    return std::clamp(torque, low, std::max(low, high));
  }

  [[nodiscard]] std::size_t steps_of_a_row() const {
    return static_cast<std::size_t>(std::lround(period_ / model_->opt.timestep));
  }

  static double at(const std::vector<double>& values, double place) {
    const double inside = std::clamp(place, 0.0, static_cast<double>(values.size()) - 1.001);
    const auto k = static_cast<std::size_t>(inside);
    const double part = inside - static_cast<double>(k);
    return values[k] + part * (values[k + 1] - values[k]);
  }

  // The state as it is, as row k of `log`.
  void add_row(std::size_t k, LogTable& log) {
    const double* const quat = q() + base_q_ + 3;
    log.t.push_back(t_[k]);
    log.columns[0].push_back(v()[dof_[right]]);
    log.columns[1].push_back(v()[dof_[left]]);
    log.columns[4].push_back(q()[base_q_]);
    log.columns[5].push_back(q()[base_q_ + 1]);
    const std::vector<double>& before = log.columns[6];
    const double heading = heading_of(quat);
    const double last = before.empty() ? heading_[k] : before.back();
    log.columns[6].push_back(last + std::remainder(heading - last, 2.0 * std::numbers::pi));
  }

  void torques(Replay& out) {
    const double h = model_->opt.timestep;
    const double stiffness = kStiffness * 0.5 * mass_ * radius_ * radius_ / h;
    const std::size_t inside = steps_of_a_row();
    // Row k takes the mean from half a row before it to half a row behind.
    std::array<std::vector<double>, 2> needed;
    for (std::vector<double>& one : needed) {
      one.assign(t_.size(), 0.0);
    }
    out.simulated.names = {"omega_r", "omega_l", "tau_r", "tau_l", "x", "y", "theta"};
    out.simulated.columns.resize(out.simulated.names.size());
    for (std::size_t k = 0; k + 1 < t_.size(); ++k) {
      if (k == 0 || starts_[k]) {
        set_state(k);
        out.simulated.segment_starts.push_back(k);
      }
      for (std::size_t n = 0; n < inside; ++n) {
        if (n == inside / 2) {
          add_row(k, out.simulated);
        }
        const double place = static_cast<double>(k) - 0.5 + static_cast<double>(n) / static_cast<double>(inside);
        for (std::size_t i = 0; i < 2; ++i) {
          // The servo follows with a lag of h/kStiffness; it is given what comes then.
          const double wanted = at(speed_[i], place + h / kStiffness / period_);
          const double torque = within_limits(i, stiffness * (wanted - v()[dof_[i]]));
          command(i, torque);
          needed[i][k] += torque / static_cast<double>(inside);
        }
        mj_step(model_.get(), data_.get());
      }
      out.simulated.columns[2].push_back(needed[right][k]);
      out.simulated.columns[3].push_back(needed[left][k]);
    }
    compare(needed, out);
  }

  void compare(const std::array<std::vector<double>, 2>& needed, Replay& out) const {
    const auto rows = static_cast<Eigen::Index>(t_.size()) - 1;
    Eigen::VectorXd sum(rows), difference(rows), resting = Eigen::VectorXd::Zero(rows);
    const double slow = kRest * std::hypot(root_mean_square(speed_[right]), root_mean_square(speed_[left]));
    for (Eigen::Index k = 0; k < rows; ++k) {
      const auto j = static_cast<std::size_t>(k);
      const double r = within_limits(right, torque_[right][j]) - needed[right][j];
      const double l = within_limits(left, torque_[left][j]) - needed[left][j];
      sum[k] = r + l;
      difference[k] = 0.5 * out.track_width * (r - l);
      resting[k] = std::min(std::abs(speed_[right][j]), std::abs(speed_[left][j])) < slow ? 1.0 : 0.0;
    }
    const Eigen::VectorXd s = low_pass(sum, period_, options_.beta), d = low_pass(difference, period_, options_.beta);
    const Eigen::VectorXd still = low_pass(resting, period_, options_.beta);
    std::vector<double> along, across;
    double since = 0.0;
    for (Eigen::Index k = 0; k < rows; ++k) {
      since = starts_[static_cast<std::size_t>(k)] ? 0.0 : since + period_;
      if (since > 10.0 / options_.beta && still[k] < kRest) {
        along.push_back(s[k]);
        across.push_back(d[k]);
      }
    }
    out.sum = root_mean_square(along);
    out.difference = root_mean_square(across);
    out.rows = along.size();
  }

  void open_loop(Replay& out) {
    const auto every = static_cast<std::size_t>(std::max(1L, std::lround(options_.every / period_)));
    const auto length = static_cast<std::size_t>(std::max(1L, std::lround(options_.horizon / period_)));
    const std::size_t inside = steps_of_a_row();
    std::vector<double> velocity, yaw_rate, position, heading;
    for (std::size_t first = 4; first + length + 4 < t_.size(); first += every) {
      const bool broken = std::any_of(starts_.begin() + static_cast<std::ptrdiff_t>(first) + 1,
                                      starts_.begin() + static_cast<std::ptrdiff_t>(first + length) + 1,
                                      [](bool starts) { return starts; });
      if (broken) {
        continue;
      }
      set_state(first);
      for (std::size_t n = 0; n < length * inside; ++n) {
        const double place = static_cast<double>(first) + (static_cast<double>(n) + 0.5) / static_cast<double>(inside);
        for (std::size_t i = 0; i < 2; ++i) {
          command(i, at(torque_[i], place));
        }
        mj_step(model_.get(), data_.get());
      }
      const std::size_t last = first + length;
      const double r = v()[dof_[right]] - speed_[right][last], l = v()[dof_[left]] - speed_[left][last];
      velocity.push_back(0.5 * out.wheel_radius * (r + l));
      yaw_rate.push_back(out.wheel_radius / out.track_width * (r - l));
      position.push_back(std::hypot(q()[base_q_] - x_[last], q()[base_q_ + 1] - y_[last]));
      heading.push_back(std::remainder(heading_of(q() + base_q_ + 3) - heading_[last], 2.0 * std::numbers::pi));
    }
    out.runs = velocity.size();
    out.velocity = root_mean_square(velocity);
    out.yaw_rate = root_mean_square(yaw_rate);
    out.position = root_mean_square(position);
    out.heading = root_mean_square(heading);
  }

  const ReplayOptions& options_;
  Model model_;
  Data data_;
  std::vector<double> t_, x_, y_, heading_, rest_;
  std::array<std::vector<double>, 2> speed_, torque_;
  std::vector<bool> starts_;
  std::array<int, 2> dof_{}, body_{}, motor_{-1, -1};
  int base_q_ = -1, base_v_ = -1;
  double period_ = 0.0, mass_ = 0.0, largest_ = 0.0, radius_ = 0.0, track_ = 0.0, turned_ = 0.0;
};

}  // namespace

Replay replay(const std::string& xml, const LogTable& log, const ReplayOptions& options) {
  return Runner(xml, log, options).run();
}

}  // namespace wheelwright::reality
