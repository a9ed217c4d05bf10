// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rows for a fault whose onset lies somewhere in an interval of time, from the motion of the faulty log itself.
///
/// A log's motion is the healthy encoders', measured: v + n. With the signature filtered from it, from the instant t_s
/// on (fault_rows.hpp), a row at t > t_s reads, for a fault that set in at any T in [t_a, t_b], t_b < t_s,
///
///     τ_f = (y + κ g1 + κ² g2) θ + κ c + α² (e^{−βx} A + x e^{−βx} B + e^{−γx} C) + e,     x = t − t_s,
///
/// (order 1: α e^{−βx} A): the filter is linear, so what happened in [T, t_s] lives on in its state at t_s alone
/// (kernel.hpp). A, B and C, for each output, are that state beyond the one of an onset at t_s itself. They are bounded
/// by what onsets at the instants of [t_a, t_s] leave there, times kTransition: that is what covers a step between two
/// samples, whose interval mixes both sides. Where the filter begins at t_a a step from before it leaves what one at
/// t_a does less the jump, since the weights of a segment begin with it (regressor_filter.hpp); that is held, too.
///
/// Errors |ĝ1 − g1| <= e1, |ĝ2 − g2| <= e2, |ĉ − c| <= e_c: SignatureErrors. Where motion between samples counts, Δ is
/// the row's own dY, from the efforts as they were logged: a faulty robot's motion may be what they say, or what they
/// say less the offset that the fault adds (effort_dY, effort_doubt).
///
/// A drift s = (t − T)/rise is a mixture of steps; that T is known to t_s − t_a only adds (t_s − t_a)/rise of the
/// step's signature to e1 and e_c, and twice that to e2.
///
/// A fault of the encoders shows (I + κ s S) v: then v = (I − κ' s S) v_seen, κ' = κ/(1 + κ), where S² = S. It is a
/// fault of motion with K = −S in κ'.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "detector/faults/fault_rows.hpp"

namespace wheelwright::detector {

/// One output at one instant under a hypothesis.
struct OnsetRow {
  Eigen::RowVectorXd e0;              ///< p entries: |δ| is larger by this, whatever κ
  Eigen::RowVectorXd g1, g2, e1, e2;  ///< p entries
  double c = 0.0, ec = 0.0;
  std::array<double, 3> left{};  ///< weights of A, B and C
};

/// A fault of the encoders alone as a fault of motion, in κ' = κ/(1 + κ), of what they show; its range is in κ' too.
[[nodiscard]] FaultType as_motion_of_reading(const FaultType& fault);

/// Rows of one fault for one onset interval after the other, whichever residual they belong to.
class HypothesisRows {
 public:
  virtual ~HypothesisRows() = default;
  /// The onset lies between instants `a` and `b` > a, b + 1 < end; where `a` is the first instant, it may also lie
  /// before it if the rows' memory begins there. Rows before `a` are healthy, rows of instants in [a, b + 1] are not
  /// spoken of.
  virtual void between(std::size_t a, std::size_t b) = 0;
  /// The instant of t_s, b + 1.
  [[nodiscard]] virtual std::size_t start() const = 0;
  /// Writes to `out`, whatever it held, the row of output `i` at instant k > start().
  virtual void row(std::size_t k, std::size_t i, OnsetRow& out) = 0;
  /// Whether what was before t_s leaves anything beside what row() says.
  [[nodiscard]] virtual bool leaves() const { return false; }
  /// |A|, |B| and |C| of output `i` are at most this for |θ_j| <= largest_j and |κ| <= `kappa`.
  [[nodiscard]] virtual std::array<double, 3> left_bounds(std::size_t /*i*/, double /*kappa*/,
                                                          const Eigen::VectorXd& /*largest*/) const {
    return {};
  }
  /// The same of an offset that was never larger than `size` times the fault's before t_s.
  [[nodiscard]] virtual std::array<double, 3> offset_left_bounds(std::size_t /*i*/, double /*size*/) const {
    return {};
  }
  /// True if κ of the rows is κ' of a fault of the encoders.
  [[nodiscard]] virtual bool encoder() const = 0;
};

/// Rows of the torque residual.
class OnsetRows final : public HypothesisRows {
 public:
  /// Times the states that onsets between two samples may leave.
  static constexpr double kTransition = 2.0;

  /// True if the fault's rows are known: a step or a drift whose S, if any, has S² = S and comes alone, that does not
  /// stand for a reading that stands still, and whose signature is a polynomial of κ (polynomial()).
  [[nodiscard]] static bool knows(const FaultType& fault, const Model& model);

  /// For the instants [first, end) of `motion`, of one segment. References are kept.
  OnsetRows(const FaultType& fault, const Model& model, const FilterDesign& design, const ReferenceMotion& motion,
            std::size_t first, std::size_t end);

  void between(std::size_t a, std::size_t b) override;
  [[nodiscard]] std::size_t start() const override { return s_; }
  void row(std::size_t k, std::size_t i, OnsetRow& out) override;
  [[nodiscard]] bool leaves() const override { return true; }
  [[nodiscard]] std::array<double, 3> left_bounds(std::size_t i, double kappa,
                                                  const Eigen::VectorXd& largest) const override;
  [[nodiscard]] std::array<double, 3> offset_left_bounds(std::size_t i, double size) const override;
  [[nodiscard]] bool encoder() const override { return encoder_; }

 private:
  // What a KernelBank remembers at one instant: z1, z2, fast and soft, each with the entries of g1, g2 and c.
  enum Part : std::size_t { z1, z2, fast, soft, parts };
  [[nodiscard]] const double* jump(std::size_t k) const { return jumps_.data() + (k - first_) * entries_; }
  [[nodiscard]] const double* state(std::size_t k) const { return states_.data() + (k - first_) * parts * width_; }
  void find_jumps();
  void left(std::size_t from, std::size_t at, std::vector<double>& out);
  void broken(std::size_t at, std::vector<double>& out);
  void pass(std::vector<double>& state, std::size_t from, std::size_t to) const;
  void filter_at(std::size_t k);
  [[nodiscard]] double way(std::size_t from, std::size_t to) const { return way_[to - first_] - way_[from - first_]; }
  void take(const FaultType& fault);

  FaultType fault_, step_;
  const Model* model_;
  FilterDesign design_;
  filter::FilterKernel kernel_;
  SignatureErrors errors_;
  bool encoder_;
  const ReferenceMotion* motion_;
  std::size_t first_, end_, s_ = 0;
  std::size_t entries_, width_;        // n p of g1 alone; 2 n p + n of g1, g2 and c
  double gain_, uncertain_ = 0.0;      // α^order; share of a drift that the onset leaves open
  std::vector<double> way_;            // s of steps from first_ to each instant, as the filter counts them
  std::vector<double> jumps_;          // impulse of a step at each instant, entries_ each
  std::vector<double> states_;         // of an onset at first_, parts × width_ for each instant
  std::vector<double> drifting_;       // filtered, of a drift from s_ on, width_ for each instant
  std::vector<double> bound_;          // parts × width_
  std::vector<double> left_, before_;  // of one instant: what left() wrote, and its workspace
  std::vector<double> filtered_;       // of a step that sets in at s_, at instant filtered_at_
  std::size_t filtered_at_ = 0;        // 0: of none
};

}  // namespace wheelwright::detector
