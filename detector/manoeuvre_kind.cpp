// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/detector/manoeuvre_kind.hpp>

#include <algorithm>
#include <cmath>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

constexpr double kStill = 0.03, kStraight = 0.1, kAccelerating = 0.5;

double rms(const Eigen::MatrixXd& x) { return std::sqrt(x.squaredNorm() / static_cast<double>(x.size())); }

}  // namespace

std::string_view words(ManoeuvreKind kind) {
  switch (kind) {
    case ManoeuvreKind::standstill: return "standing still";
    case ManoeuvreKind::cruising: return "cruising straight";
    case ManoeuvreKind::accelerating: return "accelerating straight";
    case ManoeuvreKind::turning: return "turning";
    case ManoeuvreKind::spinning: return "spinning on the spot";
  }
  return "";
}

ManoeuvreKind kind_of(const ReferenceMotion& motion, std::size_t first, std::size_t last) {
  check::that(first + 1 < last && last <= motion.instants(), "stretch", "two instants of the motion, or more");
  const auto from = static_cast<Eigen::Index>(first), count = static_cast<Eigen::Index>(last - first);
  const Eigen::MatrixXd w = motion.joint_speed.middleCols(from, count);
  const double speed = rms(w);
  if (!(speed > kStill * motion.joint_speed.cwiseAbs().maxCoeff())) {
    return ManoeuvreKind::standstill;
  }
  if (w.rows() == 2) {
    const double sum = rms(w.row(0) + w.row(1)), difference = rms(w.row(0) - w.row(1));
    if (sum < kStraight * difference) {
      return ManoeuvreKind::spinning;
    }
    if (difference >= kStraight * sum) {
      return ManoeuvreKind::turning;
    }
  }
  // Change over fifths of the stretch: single differences would show the encoder.
  const Eigen::Index gap = std::max<Eigen::Index>(1, count / 5);
  const Eigen::MatrixXd change = w.rightCols(count - gap) - w.leftCols(count - gap);
  return rms(change) * static_cast<double>(count) / static_cast<double>(gap) > kAccelerating * speed
             ? ManoeuvreKind::accelerating
             : ManoeuvreKind::cruising;
}

}  // namespace wheelwright
