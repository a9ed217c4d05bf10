// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include <wheelwright/reality/drive.hpp>

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

}  // namespace wheelwright::reality
