// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <mutex>
#include <numbers>

#include <fmt/format.h>

#include "core/error.hpp"
#include "tests/world/engine.hpp"
#include "tests/world/world.hpp"

namespace wheelwright::reality {
namespace {

constexpr double tau = 2.0 * std::numbers::pi;

double smooth(double x) {
  const double u = std::clamp(x, 0.0, 1.0);
  return u * u * u * (10.0 + u * (6.0 * u - 15.0));
}

using Course = std::function<double(double)>;

/// Appends a part; its size is cut until speeds and accelerations are within `share` of the robot's.
void append(Drive& drive, const RobotDesign& robot, double length, double share, const Course& v1, const Course& v2) {
  const auto count = static_cast<std::size_t>(length / Drive::step);
  std::vector<double> a(count), b(count);
  double speed = 0.0;
  double acceleration = 0.0;
  const double arm = robot.half_track;
  for (std::size_t k = 0; k < count; ++k) {
    const double t = Drive::step * static_cast<double>(k);
    a[k] = v1(t);
    b[k] = v2(t);
    speed = std::max(speed, std::abs(a[k]) + arm * std::abs(b[k]));
    if (k > 0) {
      acceleration =
          std::max(acceleration, (std::abs(a[k] - a[k - 1]) + arm * std::abs(b[k] - b[k - 1])) / Drive::step);
    }
  }
  const double size = share * std::min(robot.radius * robot.wheel_speed / std::max(speed, 1e-9),
                                       1.6 * robot.acceleration / std::max(acceleration, 1e-9));
  for (std::size_t k = 0; k < count; ++k) {
    drive.v1.push_back(size * a[k]);
    drive.v2.push_back(size * b[k]);
  }
}

Course multi_sine(Random& random, double length, double amplitude) {
  const std::size_t tones = 4 + random.below(3);
  std::vector<std::array<double, 3>> parts;
  for (std::size_t k = 0; k < tones; ++k) {
    const double frequency = random.log_uniform(0.08, 1.3);
    parts.push_back({amplitude / std::sqrt(frequency / 0.1), tau * frequency, random.uniform(0.0, tau)});
  }
  return [parts, length](double t) {
    double sum = 0.0;
    for (const auto& [size, rate, phase] : parts) {
      sum += size * std::sin(rate * t + phase);
    }
    return sum * smooth(t) * smooth(length - t);
  };
}

/// Up, hold, down, once in each direction.
Course there_and_back(double length, double ramp, double sign) {
  return [=](double t) {
    const double half = 0.5 * length;
    const double u = t < half ? t : t - half;
    const double value = smooth(u / ramp) * smooth((half - 0.2 - u) / ramp);
    return sign * (t < half ? value : -value);
  };
}

const Course nothing = [](double) { return 0.0; };

void append_part(Drive& drive, const RobotDesign& robot, Random& random, std::size_t kind) {
  const double share = random.uniform(0.6, 1.0);
  const double sign = random.sign();
  const double ramp = random.uniform(0.6, 1.4);
  if (kind == 0) {
    const double length = random.uniform(10.0, 16.0);
    const Course v1 = multi_sine(random, length, random.uniform(0.6, 1.4));
    const Course v2 = multi_sine(random, length, random.uniform(0.6, 1.4) / robot.half_track);
    append(drive, robot, length, share, v1, v2);
  } else if (kind == 1) {
    const double length = random.uniform(6.0, 10.0);
    append(drive, robot, length, share, there_and_back(length, ramp, sign), nothing);
  } else if (kind == 2) {
    const double length = random.uniform(6.0, 9.0);
    append(drive, robot, length, share, nothing, there_and_back(length, ramp, sign));
  } else if (kind == 3) {
    const double length = random.uniform(10.0, 14.0);
    const double rate = tau * 2.0 / length;
    const double turn = sign * random.uniform(0.6, 1.2) / robot.half_track;
    const Course gate = [=](double t) { return smooth(t / ramp) * smooth((length - t) / ramp); };
    append(
        drive, robot, length, share, [=](double t) { return gate(t); },
        [=](double t) { return turn * gate(t) * std::sin(rate * t); });
  } else {
    const double length = random.uniform(8.0, 11.0);
    const double turn = random.sign() * random.uniform(0.3, 0.9) / robot.half_track;
    const Course v1 = there_and_back(length, ramp, sign);
    append(drive, robot, length, share, v1, [=](double t) { return turn * std::abs(v1(t)); });
  }
  const auto rest = static_cast<std::size_t>(random.uniform(0.3, 1.2) / Drive::step);
  drive.v1.insert(drive.v1.end(), rest, 0.0);
  drive.v2.insert(drive.v2.end(), rest, 0.0);
}

}  // namespace

Drive draw_drive(const RobotDesign& robot, Random& random, double duration) {
  Drive drive;
  const auto rest = static_cast<std::size_t>(1.0 / Drive::step);
  drive.v1.assign(rest, 0.0);
  drive.v2.assign(rest, 0.0);
  // A multi-sine and each of the others in every round, in random order.
  while (static_cast<double>(drive.v1.size()) * Drive::step < duration - 5.0) {
    std::array<std::size_t, 6> order{0, 1, 2, 3, 4, 0};
    for (std::size_t k = order.size(); k > 1; --k) {
      std::swap(order[k - 1], order[random.below(k)]);
    }
    for (const std::size_t kind : order) {
      if (static_cast<double>(drive.v1.size()) * Drive::step < duration - 5.0) {
        append_part(drive, robot, random, kind);
      }
    }
  }
  drive.v1.insert(drive.v1.end(), rest, 0.0);
  drive.v2.insert(drive.v2.end(), rest, 0.0);
  return drive;
}

Model compile(const std::string& xml) {
  // The engine's parser keeps its last document in a global.
  static std::mutex parser;
  const std::lock_guard lock(parser);
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  const int index = mj_makeEmptyFileVFS(files.get(), "robot.xml", static_cast<int>(xml.size()));
  if (index < 0) {
    throw Error("reality: the engine takes no document");
  }
  std::memcpy(files->filedata[index], xml.data(), xml.size());
  std::array<char, 1000> message{};
  Model model(mj_loadXML("robot.xml", files.get(), message.data(), static_cast<int>(message.size())));
  mj_deleteVFS(files.get());
  if (!model) {
    throw Error(fmt::format("reality: the engine rejects the robot: {}", message.data()));
  }
  return model;
}

namespace {

/// Speed control with integrator and feed-forward, for sum and difference.
class SpeedControl {
 public:
  explicit SpeedControl(const RobotDesign& robot) : robot_(robot) {}

  Pair step(const Drive& drive, double t, const Pair& speed, double h) {
    const double place = std::min(t / Drive::step, static_cast<double>(drive.v1.size()) - 1.001);
    const auto k = static_cast<std::size_t>(place);
    const double part = place - static_cast<double>(k);
    const double r = robot_.radius;
    const double arm = robot_.half_track;
    const std::array<double, 2> actual{0.5 * r * (speed[right] + speed[left]),
                                       0.5 * r * (speed[right] - speed[left]) / arm};
    const std::array<double, 2> inertia{r * robot_.mass, r * robot_.yaw_inertia};
    const std::array<const std::vector<double>*, 2> wanted{&drive.v1, &drive.v2};
    std::array<double, 2> effort{};
    for (std::size_t c = 0; c < 2; ++c) {
      const double low = (*wanted[c])[k];
      const double high = (*wanted[c])[k + 1];
      const double error = low + part * (high - low) - actual[c];
      if (!clipped_) {
        integral_[c] += h * error;
      }
      const double gain = robot_.bandwidth;
      effort[c] = inertia[c] * (0.8 * (high - low) / Drive::step + gain * error + 0.3 * gain * gain * integral_[c]);
    }
    const Pair torque{0.5 * (effort[0] + effort[1] / arm), 0.5 * (effort[0] - effort[1] / arm)};
    const double limit = robot_.effort_limit;
    clipped_ = std::abs(torque[0]) > limit || std::abs(torque[1]) > limit;
    return {std::clamp(torque[0], -limit, limit), std::clamp(torque[1], -limit, limit)};
  }

 private:
  const RobotDesign& robot_;
  std::array<double, 2> integral_{};
  bool clipped_ = false;
};

/// Everything at every step, before it is cut into sampling intervals.
struct History {
  std::array<std::vector<double>, 2> angle, speed, torque;
  std::vector<double> x, y, heading;
};

double between(const std::vector<double>& values, double place) {
  const double inside = std::clamp(place, 0.0, static_cast<double>(values.size()) - 1.001);
  const auto k = static_cast<std::size_t>(inside);
  const double part = inside - static_cast<double>(k);
  return values[k] + part * (values[k + 1] - values[k]);
}

Record sample(const History& history, double rate, double step, double late) {
  Record record;
  record.period = 1.0 / rate;
  const double stride = record.period / step;
  const auto rows = static_cast<std::size_t>(static_cast<double>(history.x.size() - 1) / stride);
  const double shift = late / step;
  for (std::size_t k = 0; k < rows; ++k) {
    const double begin = stride * static_cast<double>(k);
    const double middle = begin + 0.5 * stride;
    record.t.push_back(middle * step);
    for (std::size_t i = 0; i < 2; ++i) {
      const double from = between(history.angle[i], begin - shift);
      const double to = between(history.angle[i], begin + stride - shift);
      if (k == 0) {
        record.angle[i].push_back(from);
      }
      record.angle[i].push_back(to);
      record.speed[i].push_back((to - from) / record.period);
      record.acceleration[i].push_back(
          (between(history.speed[i], begin + stride - shift) - between(history.speed[i], begin - shift)) /
          record.period);
      double sum = 0.0;
      const auto first = static_cast<std::size_t>(std::lround(begin));
      const auto last = static_cast<std::size_t>(std::lround(begin + stride));
      for (std::size_t j = first; j < last; ++j) {
        sum += history.torque[i][j];
      }
      record.torque[i].push_back(sum / static_cast<double>(last - first));
    }
    record.x.push_back(between(history.x, middle));
    record.y.push_back(between(history.y, middle));
    record.heading.push_back(between(history.heading, middle));
  }
  return record;
}

}  // namespace

Record run_world(const RobotDesign& robot, std::vector<Effect>& effects, const Drive& drive, double step) {
  Body body = robot.body;
  for (Effect& effect : effects) {
    if (effect.build) {
      effect.build(body);
    }
  }
  const Model model = compile(engine_xml(body, step));
  const Data data(mj_makeData(model.get()));
  std::array<int, 2> dof{}, joint{}, motor{};
  for (std::size_t i = 0; i < 2; ++i) {
    const int id = mj_name2id(model.get(), mjOBJ_JOINT, i == right ? "right" : "left");
    dof[i] = model->jnt_dofadr[id];
    joint[i] = model->jnt_qposadr[id];
    motor[i] = mj_name2id(model.get(), mjOBJ_ACTUATOR, i == right ? "right" : "left");
  }
  double late = 0.0;
  for (const Effect& effect : effects) {
    late += effect.late;
  }

  SpeedControl control(robot);
  History history;
  State state;
  state.step = step;
  Pair encoder{};
  double heading = 0.0;
  const auto steps = static_cast<std::size_t>(drive.duration() / step);
  for (std::size_t n = 0; n <= steps; ++n) {
    const double* q = data->qpos;
    const double* v = data->qvel;
    const double raw = std::atan2(2.0 * (q[3] * q[6] + q[4] * q[5]), 1.0 - 2.0 * (q[5] * q[5] + q[6] * q[6]));
    heading += std::remainder(raw - heading, 2.0 * std::numbers::pi);
    const double c = std::cos(heading);
    const double s = std::sin(heading);
    state.t = step * static_cast<double>(n);
    state.x = q[0];
    state.y = q[1];
    state.heading = heading;
    state.v1 = c * v[0] + s * v[1];
    state.v2 = v[5];
    for (std::size_t i = 0; i < 2; ++i) {
      state.angle[i] = q[joint[i]];
      state.speed[i] = v[dof[i]];
    }
    Pair seen = state.speed;
    for (Effect& effect : effects) {
      if (effect.measure) {
        effect.measure(state, seen);
      }
    }
    for (std::size_t i = 0; i < 2; ++i) {
      // Semi-implicit steps: the angle moves with the speed at the end of the step.
      encoder[i] += n > 0 ? step * seen[i] : 0.0;
    }

    const Pair command = control.step(drive, state.t, seen, step);
    Pair torque = command;
    for (std::size_t i = 0; i < 2; ++i) {
      torque[i] = robot.gain[i] * torque[i] + robot.bias[i];
    }
    for (Effect& effect : effects) {
      if (effect.actuate) {
        effect.actuate(state, torque);
      }
    }
    state.torque = torque;
    Push push;
    for (Effect& effect : effects) {
      if (effect.push) {
        effect.push(state, push);
      }
    }
    for (std::size_t i = 0; i < 2; ++i) {
      history.angle[i].push_back(encoder[i]);
      history.speed[i].push_back(seen[i]);
      history.torque[i].push_back(command[i]);
      data->qfrc_applied[dof[i]] = push.wheel[i] + (motor[i] < 0 ? torque[i] : 0.0);
      if (motor[i] >= 0) {
        data->ctrl[motor[i]] = torque[i];
      }
    }
    history.x.push_back(q[0]);
    history.y.push_back(q[1]);
    history.heading.push_back(heading);
    data->qfrc_applied[0] = c * push.forward - s * push.sideways;
    data->qfrc_applied[1] = s * push.forward + c * push.sideways;
    data->qfrc_applied[5] = push.yaw;
    mj_step(model.get(), data.get());
  }
  if (data->warning[mjWARN_BADQACC].number + data->warning[mjWARN_BADQPOS].number +
          data->warning[mjWARN_BADQVEL].number >
      0) {
    throw Error("reality: the world became unstable");
  }
  return sample(history, robot.rate, step, late);
}

}  // namespace wheelwright::reality
