// SPDX-License-Identifier: Apache-2.0
/// \file
/// With which weight every single sample's error stands in a weighted sum of elements.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/regression.hpp"
#include "model/filter/element_filter.hpp"

namespace wheelwright::filter {

/// Box of parameters: middle ± radius (p each).
struct ParameterBox {
  Eigen::VectorXd middle, radius;
};

/// Error of one sample in several sums Σ_k g_kᵀ (torque_k − Y_k θ): it stands there times a number within
/// `middle` ± `spread` (one for each sum), whatever θ in the box.
struct SampleWeight {
  /// Sensor that the sample is of.
  enum class Sensor { motion, effort };
  Sensor sensor = Sensor::motion;
  std::size_t joint = 0;
  bool exact = true;   ///< false: the weight depends on what may have acted between samples, on the error itself too
  double moved = 0.0;  ///< motion: by how much the joint moved from sample to sample, two samples before (rad, m)
  const Eigen::VectorXd& middle;
  const Eigen::VectorXd& spread;
};

/// Follows elements and their weights g (n × sums), and hands out each sample's SampleWeight as soon as no later
/// element holds that sample. Errors enter through what is linear in them: accelerations, speeds, efforts. Functions of
/// the motion are enclosed for all errors within their bounds (WeakElement::functions).
class SampleWeights {
 public:
  SampleWeights() = default;
  /// For `sums` sums of elements of `elements`.
  SampleWeights(const ElementFilter& elements, ParameterBox box, Eigen::Index sums);

  /// The next element is the first of a segment. What was not handed out of the last segment is: call end() first.
  void begin() { elements_taken_ = 0; }

  /// Takes the newest element of `elements` with its weights; calls sink(const SampleWeight&).
  template <typename Sink>
  void take(const ElementFilter& elements, const core::RowMatrix& g, Sink&& sink) {
    add(elements, g);
    const std::size_t k = elements_taken_;
    if (!exact_) {
      for (std::size_t j = 0; j < joints_; ++j) {
        whole_effort(elements, g, j);
        sink(SampleWeight{SampleWeight::Sensor::effort, j, false, 0.0, zero_, spread_});
      }
    }
    hand_out_motion(k - 1, sink);
    if (exact_ && k >= effort_lag_) {
      hand_out_effort(k - effort_lag_, sink);
    }
  }

  /// The segment is over: hands out the rest.
  template <typename Sink>
  void end(Sink&& sink) {
    if (elements_taken_ == 0) {
      return;
    }
    const std::size_t k = elements_taken_;
    for (std::size_t s = k; s <= k + 1; ++s) {
      hand_out_motion(s, sink);
    }
    if (exact_) {
      for (std::size_t s = k + 1 > effort_lag_ ? k + 1 - effort_lag_ : 0; s <= k + 2; ++s) {
        hand_out_effort(s, sink);
      }
    }
    elements_taken_ = 0;
  }

 private:
  static constexpr std::size_t kSlots = 8;
  struct Slot {
    std::vector<Eigen::MatrixXd> motion;  // per joint: p × sums, what stands with θ_j
    Eigen::MatrixXd effort;               // joints × sums
  };

  void add(const ElementFilter& elements, const core::RowMatrix& g);
  void whole_effort(const ElementFilter& elements, const core::RowMatrix& g, std::size_t joint);
  void weigh_motion(const Slot& slot, std::size_t joint);

  template <typename Sink>
  void hand_out_motion(std::size_t sample, Sink&& sink) {
    const Slot& slot = slots_[sample % kSlots];
    for (std::size_t j = 0; j < joints_; ++j) {
      weigh_motion(slot, j);
      const double moved = sample >= 2 ? moved_[(sample - 2) % kSlots][static_cast<Eigen::Index>(j)] : 0.0;
      sink(SampleWeight{SampleWeight::Sensor::motion, j, true, moved, middle_, spread_});
    }
  }
  template <typename Sink>
  void hand_out_effort(std::size_t sample, Sink&& sink) {
    spread_.setZero();
    for (std::size_t j = 0; j < joints_; ++j) {
      middle_ = slots_[sample % kSlots].effort.row(static_cast<Eigen::Index>(j));
      sink(SampleWeight{SampleWeight::Sensor::effort, j, true, 0.0, middle_, spread_});
    }
  }

  ParameterBox box_;
  std::size_t joints_ = 0;
  std::size_t effort_lag_ = 1;  // element k is the last that holds the effort of sample k − lag
  bool exact_ = true;
  std::array<Slot, kSlots> slots_;
  std::array<Eigen::VectorXd, kSlots> moved_;  // per sample: way of each joint in the step that ends there
  std::size_t elements_taken_ = 0;
  Eigen::VectorXd middle_, spread_, zero_;
};

/// Σ_k g_kᵀ (torque_k − Y_k θ) for several sums, apart from its sensors' errors.
struct WeakSums {
  core::RowMatrix Y;   ///< sums × p
  Eigen::VectorXd y;   ///< sums
  core::RowMatrix dY;  ///< sums × p: bound on what Y lacks, >= 0
  Eigen::VectorXd dy;  ///< sums: bound on what y lacks, >= 0

  /// Zeros.
  WeakSums(Eigen::Index sums, Eigen::Index p);
  WeakSums() = default;
};

/// Adds elements to WeakSums.
class WeakSummation {
 public:
  WeakSummation() = default;
  /// For elements of `elements` and `sums` sums.
  WeakSummation(const ElementFilter& elements, Eigen::Index sums);
  /// The next element is the first of a segment.
  void begin() { any_ = false; }
  /// Takes the newest element with its weights `g` (n × sums).
  void take(const ElementFilter& elements, const core::RowMatrix& g);
  /// The segment is over: weights fall to 0 in the step after the last element.
  void end(const ElementFilter& elements);
  [[nodiscard]] const WeakSums& sums() const { return sums_; }

 private:
  void turn(const ElementFilter& elements, const core::RowMatrix& change, const Eigen::VectorXd& doubt, double step);

  WeakSums sums_;
  core::RowMatrix before_, change_;
  bool any_ = false;
};

/// The regressor of `element` (n × p) times its length: ∫ ω Y.
void element_regressor(const ElementFilter& elements, const WeakElement& element, core::RowMatrix& Y);

}  // namespace wheelwright::filter
