// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rows of a faulty robot from the onset of a fault on, as polynomials of its size.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "detector/faults/reference_motion.hpp"
#include "model/fault_type.hpp"
#include "model/filter/kernel.hpp"

namespace wheelwright::detector {

/// One output at one instant of a faulty drive. With the fault's size κ,
///
///     τ_f = (y + κ g1 + κ² g2) θ + κ c + e,     regressor as seen: y + κ s + δ,
///
/// |e| <= n̄ = dy, |δ| <= Δ = dY entry by entry. All spans have p entries. Where this is not all, τ_f and the threshold
/// together may be elsewhere by |κ| (`doubt` + Σ `range`_j|θ_j|) for every θ in the set, and y by `read`: both are
/// empty or have p entries.
struct FaultRow {
  std::span<const double> y;  ///< of the healthy motion
  std::span<const double> g1;
  std::span<const double> g2;
  std::span<const double> s;
  std::span<const double> dY;  ///< Δ
  double c = 0.0;
  double dy = 0.0;  ///< n̄
  double doubt = 0.0;
  std::span<const double> range{};
  std::span<const double> read{};
};

/// Motion that a fault adds at one instant: of the coordinates, and of the joints.
struct ExtraMotion {
  Eigen::VectorXd moved, joint_moved;  ///< of the robot
  Eigen::VectorXd seen, joint_seen;    ///< of what encoders show
};

/// Terms that a fault adds to the unfiltered equation at one instant, matrices n × p.
struct FaultSignals {
  core::RowMatrix g1, g2, s;
  Eigen::VectorXd c;

  /// Those of no fault, for the rows of `model`.
  [[nodiscard]] static FaultSignals none(const Model& model);
};

/// Rows of a faulty drive from a fault's onset on, whichever residual they belong to.
class FaultRows {
 public:
  virtual ~FaultRows() = default;
  /// Number of outputs.
  [[nodiscard]] virtual std::size_t outputs() const = 0;
  /// True if rows are those polynomials for every size in the fault's range. Where they are not, nothing is certain.
  [[nodiscard]] virtual bool exact() const { return true; }
  /// Sets the fault in at instant `onset` of the motion.
  virtual void begin(std::size_t onset) = 0;
  /// Goes on to the next instant; false at the end of the segment.
  virtual bool next() = 0;
  /// The instant that row() is of.
  [[nodiscard]] virtual std::size_t instant() const = 0;
  /// Row of output `i` at this instant. Its spans hold until the next call of next() or begin().
  [[nodiscard]] virtual FaultRow row(std::size_t i) const = 0;
};

/// True if the signature of `fault` for `model` is a polynomial of κ as FaultRow has it, over the fault's whole range.
/// Functions of the motion have to be at most quadratic in what the fault adds to it (dry friction, which only looks at
/// signs, and drag are; Stribeck friction is not), linear where it is only seen, and constant in it where the fault
/// changes an effort's gain too. A reading that stands still at an unknown value is none. Tried at some motions.
[[nodiscard]] bool polynomial(const FaultType& fault, const Model& model);

/// By how much a measured motion's errors carry a signature that is filtered from its onset on away from that of the
/// motion itself. The kernel of f₂*(s n̈) for a step s is that of f₂*n̈ cut off at the time x since the onset: its
/// derivatives' total variations do not grow by that, but for the error n_v of the speed at the onset, with weight
/// f₂(x), as at the start of a segment (noise.hpp). So with Δ the bounds of the healthy columns
///
///     gains H, G:  e1 = |H + G| (Δ + |scale| f₂(x) n_v)           (n_v for angles only)
///     motion K:    e1 = |K| Δ of acceleration and speed: f * d/dt(s K n) has no term at the onset
///     both:        e2 = |H + G| (|K| Δ + |scale| f₂(x) |K| n_v)
///     across d:    e1 = |d| Δ of the yaw rate           θ-change ϑ:  e_c = (Δ + …) |ϑ|
///     seen S:      e_s = |S| Δ.
///
/// where n_v is that of the step at the onset (shorter steps of angles have larger errors). Where s does not jump, the
/// fastest that it changes times Δ of the speed is added to f₂(x) n_v, for a bump times the static gain and n_v.
class SignatureErrors {
 public:
  /// Of one output at one instant.
  struct Row {
    Eigen::RowVectorXd e1, e2, es;  ///< |ĝ1 − g1|, |ĝ2 − g2|, |ŝ − s|: p entries
    double ec = 0.0;                ///< |ĉ − c|
  };

  /// `model` and `motion` are kept by reference.
  SignatureErrors(const FaultType& fault, const Model& model, const FilterDesign& design,
                  const ReferenceMotion& motion);

  /// Filters from instant `onset` of the motion on.
  void begin(std::size_t onset);
  /// Largest error of the coordinates' speeds at the onset.
  [[nodiscard]] const Eigen::VectorXd& at_onset() const { return onset_; }

  /// Of output `i` at instant `k` of the motion, `since` s (of the filter's steps) after the onset. One object serves
  /// one thread; the row holds until the next call.
  [[nodiscard]] const Row& row(std::size_t k, std::size_t i, double since);

 private:
  [[nodiscard]] double shorter(double step) const;

  const Model* model_;
  const ReferenceMotion* reference_;
  FilterDesign design_;
  filter::FilterKernel kernel_;
  Eigen::MatrixXd motion_, effort_, seen_;  // |K|, |H| + |G|, |S|
  Eigen::VectorXd theta_;
  double lateral_ = 0.0;
  Eigen::VectorXd onset_;   // n_v there
  Eigen::VectorXd sample_;  // n_v of the shortest step
  Eigen::VectorXd slope_;   // per coordinate: what changes of s add where it does not jump
  bool moves_ = false, whole_ = false;
  Eigen::VectorXd cut_, of_acceleration_, of_speed_, acceleration_, speed_, moved_sample_, seen_sample_;  // of one row
  Row out_;
};

/// A fault's signature along a reference motion, element by element of the weak form (model/filter/element_filter.hpp):
/// what it adds between one instant and the next is shares()[0] at_begin() + shares()[1] at_end(), and in the first
/// element after an onset jump(), whatever weights the elements are summed with.
///
/// Products with the fault's profile need no derivative of noise. At the onset of a step the robot's own speed goes on
/// (its mass sees to that) and what the encoders show jumps; the reading of an effort changes with no more than its
/// gain.
class FaultElements {
 public:
  /// Throws InvalidArgument where `fault` does not fit `model`. `model` and `motion` are kept by reference.
  /// `static_gain`: of the filter that `motion` was read with.
  FaultElements(FaultType fault, const Model& model, double static_gain, const ReferenceMotion& motion);

  /// Sets the fault in at instant `onset` of the motion.
  void begin(std::size_t onset);
  /// The same for a fault that was there before instant `first`: nothing jumps.
  void begin_broken(std::size_t first);
  /// Goes on to the next element, which ends at the next instant; false at the end of the segment.
  bool next();
  /// The instant at which the element ends.
  [[nodiscard]] std::size_t instant() const { return k_; }

  /// s, by which the signature at the beginning and at the end of the element count.
  [[nodiscard]] const std::array<double, 2>& shares() const { return shares_; }
  [[nodiscard]] const FaultSignals& at_begin() const { return begin_; }
  [[nodiscard]] const FaultSignals& at_end() const { return end_signals_; }
  /// Integral of what jumps at the onset (g1 and s).
  [[nodiscard]] const FaultSignals& jump() const { return jump_; }
  /// True if a fault that jumps sets in at the beginning of the element.
  [[nodiscard]] bool sets_in() const { return sets_in_; }

 private:
  // The fault and the motion at one instant: s(t), what moves (s u) and what is seen (s S v) beyond v.
  struct Point {
    double profile = 0.0;
    ExtraMotion extra;
  };
  void take_point(std::size_t k, Point& point);

  FaultType fault_;
  const Model* model_;
  double static_gain_;
  const ReferenceMotion* motion_;
  core::RowMatrix held_;  // filtered rows at the onset over the static gain
  Eigen::MatrixXd from_motion_;
  Point before_, after_;
  Eigen::VectorXd v0_, v1_, joints0_, joints1_, acceleration_, moved_rate_, seen_rate_;  // of one element
  FaultSignals jump_, begin_, end_signals_;
  std::array<double, 2> shares_{};
  std::size_t onset_ = 0, k_ = 0, last_ = 0;
  bool fresh_ = false;  // the fault jumps at the onset, between two steps
  bool sets_in_ = false;
};

/// Rows of the torque residual: filters a fault's signature along a reference motion, with the filter's own kernel:
/// what happens between two instants counts as RegressorFilter counts it.
///
/// FaultRow::range and FaultRow::doubt bound the widening of the rows by the efforts that a fault adds. The hull of
/// efforts that change between samples: an effort's gain widens it by as much as the efforts do, any other fault by
/// what its own efforts change from sample to sample. The motion between samples, in dY: faults that multiply efforts,
/// or the speeds that are seen, by as much as they multiply them, any other by ReferenceMotion::effort_dY times the
/// largest effort that it has added since the onset, for every θ of the set, and by ReferenceMotion::effort_doubt.
///
/// The signature of a measured motion has its errors (SignatureErrors); that a bump's angles are the measured ones is
/// not counted.
class FaultFilter final : public FaultRows {
 public:
  /// Throws InvalidArgument where `fault` does not fit `model`. `model` and `motion` are kept by reference.
  FaultFilter(FaultType fault, const Model& model, const FilterDesign& design, const ReferenceMotion& motion);

  [[nodiscard]] std::size_t outputs() const override { return model_->n(); }
  [[nodiscard]] bool exact() const override { return polynomial(fault_, *model_); }
  void begin(std::size_t onset) override;
  /// The same for a fault that was there before instant `first`, at which the filter begins: nothing jumps.
  void begin_broken(std::size_t first);
  bool next() override;
  [[nodiscard]] std::size_t instant() const override { return k_; }
  [[nodiscard]] FaultRow row(std::size_t i) const override;
  /// The same as next() for who asks for bank() and filtered() only: nothing of what row() says of errors is kept up.
  bool next_state();
  /// What the filter remembers of each signal: entries of g1, g2, s and c, one after the other, row by row.
  [[nodiscard]] const filter::KernelBank& bank() const { return cascades_; }
  /// The filtered signature at this instant.
  [[nodiscard]] const FaultSignals& filtered() const { return filtered_; }

 private:
  void begin_filter(std::size_t onset);
  bool pass_element();
  void filter(const FaultSignals& begin, const FaultSignals& end, const std::array<double, 2>& shares, double h);
  [[nodiscard]] double most_added(const FaultSignals& signals) const;
  void widen(const FaultSignals& begin, const FaultSignals& end, bool sets_in, double h);

  FaultType fault_;
  const Model* model_;
  const ReferenceMotion* motion_;
  FaultElements elements_;
  filter::FilterKernel kernel_;
  filter::KernelBank cascades_;  // g1, g2, s, c one after the other
  FaultSignals filtered_;
  bool gain_only_ = false;       // a fault of an effort's gain, and nothing else
  Eigen::VectorXd gain_;         // per output: by how much it widens what is in doubt of efforts
  Eigen::MatrixXd from_motion_;  // speeds of the joints from those of the coordinates
  Eigen::MatrixXd to_joints_;    // efforts of the joints from those of the outputs
  FaultSignals last_;            // the signature before this step
  bool proportional_ = false;    // its efforts are multiples of the healthy ones
  double growth_ = 0.0;          // by how many of them, per unit of κ
  double most_kappa_ = 0.0;
  double added_ = 0.0;          // largest effort per unit of κ since the onset
  filter::KernelBank widened_;  // n × p of range_, then n of c
  core::RowMatrix range_;
  Eigen::VectorXd widened_c_;
  std::optional<SignatureErrors> read_errors_;  // of a measured motion
  Eigen::VectorXd row_doubt_;
  double since_ = 0.0;         // steps since the onset, s
  core::RowMatrix row_range_;  // range_, what grows in dY and the signature's errors
  core::RowMatrix row_dY_;     // with functions in doubt
  std::size_t onset_ = 0, k_ = 0;
};

/// The same at an operating point: coordinate speeds `v` and accelerations `a` that stay for as long as the filter
/// remembers, a fault that is fully there. Its `Y` is the filtered regressor.
struct SettledRows {
  core::RowMatrix Y;       ///< n × p
  FaultSignals signature;  ///< filtered
};
[[nodiscard]] SettledRows settled_rows(const FaultType& fault, const Model& model, const FilterDesign& design,
                                       const Eigen::VectorXd& v, const Eigen::VectorXd& a);

}  // namespace wheelwright::detector
