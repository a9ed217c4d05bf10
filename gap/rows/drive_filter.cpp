// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>

#include "core/check.hpp"
#include "gap/rows/drive.hpp"
#include "model/filter/kernel.hpp"

namespace wheelwright::gap {
namespace {

// step(cascade, k) advances over the interval from instant k − 1 to k.
template <typename Step>
Eigen::VectorXd walk(const Drive& drive, double beta, const Eigen::VectorXd& signal, const Step& step) {
  check::positive(beta, "beta");
  check::that(signal.size() == drive.rows(), "filtered signal", "one value per instant");
  const filter::StepWeights weights(beta, drive.step);
  const double gain = beta * beta;
  Eigen::VectorXd result(signal.size());
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    filter::Cascade cascade;
    result[first] = 0.0;
    for (Eigen::Index k = first + 1; k < last; ++k) {
      step(cascade, weights, k);
      result[k] = gain * cascade.z2;
    }
  }
  return result;
}

Eigen::VectorXd filtered_held(const Drive& drive, double beta, const Eigen::VectorXd& signal) {
  return walk(drive, beta, signal, [&signal](filter::Cascade& c, const filter::StepWeights& w, Eigen::Index k) {
    c.held(w, signal[k - 1]);
  });
}

Eigen::VectorXd values(const Drive& drive, const Term& term, const Eigen::VectorXd& heading) {
  const std::size_t most = std::max(drive.coordinates.size(), drive.joints.size());
  std::vector<double> speed(drive.coordinates.size()), joint(drive.joints.size());
  const std::vector<double> zeros(most, 0.0);
  Eigen::VectorXd result(drive.rows());
  for (Eigen::Index k = 0; k < drive.rows(); ++k) {
    for (std::size_t c = 0; c < speed.size(); ++c) speed[c] = drive.coordinates[c].speed[k];
    for (std::size_t j = 0; j < joint.size(); ++j) joint[j] = drive.joints[j].speed[k];
    result[k] = term.function({speed, std::span(zeros).first(speed.size()), joint, std::span(zeros).first(joint.size()),
                               heading[k], 0.0})
                    .value;
  }
  return result;
}

void add(Eigen::VectorXd& to, double scale, const Eigen::VectorXd& signal) {
  if (to.size() == 0) {
    to = scale * signal;
  } else {
    to += scale * signal;
  }
}

}  // namespace

Eigen::VectorXd filtered(const Drive& drive, double beta, const Eigen::VectorXd& signal) {
  return walk(drive, beta, signal, [&signal](filter::Cascade& c, const filter::StepWeights& w, Eigen::Index k) {
    c.linear(w, signal[k - 1], signal[k]);
  });
}

Eigen::VectorXd filtered_rate(const Drive& drive, double beta, const Eigen::VectorXd& signal) {
  return walk(drive, beta, signal, [&signal](filter::Cascade& c, const filter::StepWeights& w, Eigen::Index k) {
    c.increment(w, signal[k] - signal[k - 1]);
  });
}

std::vector<Eigen::VectorXd> filtered_outputs(const Drive& drive, double beta) {
  std::vector<Eigen::VectorXd> joints;
  for (const JointSignals& joint : drive.joints) {
    joints.push_back(joint.held_effort.size() > 0 ? filtered_held(drive, beta, joint.held_effort)
                                                  : filtered(drive, beta, joint.effort));
  }
  std::vector<Eigen::VectorXd> outputs(drive.model.n());
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    for (std::size_t j = 0; j < joints.size(); ++j) {
      add(outputs[i], drive.model.input(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)), joints[j]);
    }
  }
  return outputs;
}

std::vector<std::vector<Eigen::VectorXd>> filtered_regressor(const Drive& drive, double beta) {
  const Model& model = drive.model;
  std::vector<std::vector<Eigen::VectorXd>> rows(model.p(), std::vector<Eigen::VectorXd>(model.n()));
  std::vector<std::array<Eigen::VectorXd, 2>> of_coordinate(model.coordinates.size());
  Eigen::VectorXd heading;
  for (const Term& term : model.terms) {
    Eigen::VectorXd& row = rows[term.parameter][term.output];
    if (term.kind == Term::Kind::function) {
      if (heading.size() == 0) {
        heading = heading_or_odometry(drive);
      }
      add(row, term.scale, filtered(drive, beta, values(drive, term, heading)));
      continue;
    }
    const bool rate = term.kind == Term::Kind::acceleration;
    Eigen::VectorXd& signal = of_coordinate[term.coordinate][rate ? 1 : 0];
    if (signal.size() == 0) {
      const Eigen::VectorXd& speed = drive.coordinates[term.coordinate].speed;
      signal = rate ? filtered_rate(drive, beta, speed) : filtered(drive, beta, speed);
    }
    add(row, term.scale, signal);
  }
  return rows;
}

Mask settled(const Drive& drive, double beta, double memory) {
  check::positive(beta, "beta");
  check::non_negative(memory, "memory");
  Mask mask(drive.rows());
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first; k < last; ++k) {
      mask[k] = k > first && static_cast<double>(k - first) * drive.step * beta >= memory;
    }
  }
  return mask;
}

Mask moving(const Drive& drive, double beta, double share) {
  Mask mask = Mask::Constant(drive.rows(), drive.has_efforts);
  for (const JointSignals& joint : drive.joints) {
    mask = mask && filtered(drive, beta, joint.resting.cast<double>().matrix()).array() <= share;
  }
  return mask;
}

std::string why_few_rows(const Drive& drive, double beta) {
  constexpr double memory = 10.0;
  const Mask ready = settled(drive, beta, memory);
  const Eigen::Index left = ready.count(), used = (ready && moving(drive, beta)).count();
  const bool cut = drive.segment_starts.size() > 1 && 2 * left < drive.rows();
  const bool stands = 2 * used < left;
  return fmt::format(
      "of {} rows {} come in the {:.2g} s after each of {} beginning{} in which the filter settles, and {} "
      "of the others while a wheel stands still; {}",
      drive.rows(), drive.rows() - left, memory / beta, drive.segment_starts.size(),
      drive.segment_starts.size() == 1 ? "" : "s", left - used,
      cut      ? "record without gaps (`wheelwright doctor` names them), or drive longer"
      : stands ? "let the robot stand less, or drive longer"
               : "drive longer");
}

std::vector<Eigen::Index> rows_apart(const Drive& drive, const Mask& use, double row_step, double beta) {
  const auto apart = std::max<Eigen::Index>(1, std::lround(row_step / (beta * drive.step)));
  std::vector<Eigen::Index> rows;
  for (Eigen::Index k = 0; k < drive.rows(); k += apart) {
    if (use[k]) {
      rows.push_back(k);
    }
  }
  return rows;
}

}  // namespace wheelwright::gap
