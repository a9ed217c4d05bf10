// SPDX-License-Identifier: Apache-2.0
/// \file
/// What a fault adds to the weighted sums of the detector at a stated risk, from its onset on.
///
/// A sum S = Σ w_k (torque_k − Y_k θ) of a faulty drive (scale_detector.hpp) is made of the elements that FaultElements
/// describes, times the same weights w_k = K((now − t_k)/T) g_k:
///
///     Σ w torque = (y + κ g1 + κ² g2) θ + κ c + e,     Σ w Y as seen = y + κ s,     |e| <= radius,
///
/// y the healthy sum's regressor, and g1, g2, s, c sums over what set in after the onset. It is the polynomial of
/// FaultRow, so that FaultMargin solves it exactly for every θ of the set at a stated risk. What stands beside it:
///
/// - **Weights** are known: g is foreseen from what the encoders show, which a fault of efforts, parameters, radii or
///   slip leaves as it is. A fault that changes what they show changes g of the shapes `effort` and `parameter`, too;
///   of such a fault the sums with constant weights alone are spoken of.
/// - **Quadratic terms** (g2: what a fault changes both the motion and the efforts' gain by) are kept.
/// - **A measured motion** is wrong by at most n a sample. In a sum over elements that is |Σ w_i (slope's error)|
///   <= n A_i, and n B_i of speeds, A and B sums of the sizes of second and first differences of w over steps
///   (summation by parts), and what the cut at the onset adds.
/// - **Between samples** motion and efforts may do what the detector allows for, more where a fault adds efforts
///   (SumDrive::growth), and as much again as functions of the motion and efforts' ranges are then in doubt.
///
/// `radius` holds but for a chance, of all sums and looks together ScaleDetectorOptions::false_alarms; the set but for
/// RiskModel::risk. So a fault that is certain in a sum is missed with no more probability than RiskModel::risk plus
/// that of one look (SumDrive::miss), in a drive whose encoders read as the log's.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "detector/faults/fault_rows.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/learnt_model.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "detector/multiscale/sum_kernel.hpp"

namespace wheelwright::detector {

/// A look at a sum.
struct SumLook {
  std::size_t instant = 0;  ///< of the motion, at which its newest element ends
  double t = 0.0;           ///< s, when it was looked at
  std::size_t weight = 0, scale = 0;
  double value = 0.0;   ///< Σ w (torque − Yθ̂)
  double radius = 0.0;  ///< of what errors can do
  double width = 0.0;   ///< max yθ − min yθ over the set
};

/// A drive as the sums see it, instant by instant of a ReferenceMotion.
struct SumDrive {
  std::vector<SumWeight> weights;
  std::vector<double> scales;  ///< s
  double miss = 0.0;           ///< probability that the set or the errors at one look are not within their bounds
  std::size_t instants = 0;    ///< of the motion that were walked
  std::vector<bool> element;   ///< whether an element ends at the instant
  std::vector<double> step;    ///< s, from the element before to it
  std::vector<double> way;     ///< s, of these steps since the segment's beginning
  std::vector<double> length;  ///< s, of the element
  Eigen::MatrixXd g;           ///< (weights · outputs) × instants: output by output, all weights
  Eigen::VectorXd n;           ///< per coordinate: error of a sample (of angles, of speeds)
  std::vector<SumLook> looks;  ///< in the order of time
  core::RowMatrix y;           ///< looks × p
  core::RowMatrix reading;  ///< looks × (A, B and L of each output, C of each output and coordinate, F of each output
                            ///< and function): SumErrors
  std::vector<double> growth;  ///< per look: of `radius` for each unit of effort that a fault adds
  std::vector<double>
      doubtful;  ///< per look: of `radius`, where a fault adds efforts and functions' signs are in doubt
};

/// Options of read_sum_drive().
struct SumDriveOptions {
  double most = 600.0;  ///< s of the log that are walked
  /// True: looks allow for any log that the sensors may write of that drive, and for a fault's efforts. False: they are
  /// those of the log itself.
  bool any_log = true;
  /// First row of the piece of the log that `motion` is of: the sums begin with the log, what is held with the piece.
  std::optional<std::size_t> piece{};
};

/// Walks `log`, whose motion is `motion` as read for `model` (read_reference()), through the ScaleDetector of `model`;
/// three times where it allows for any log. Empty where what the sensors may write leaves no bound on the motion
/// between samples. Throws InvalidArgument where `model` has nothing at a stated risk.
[[nodiscard]] std::optional<SumDrive> read_sum_drive(LogSource& log, const OnlineModel& model,
                                                     const ReferenceMotion& motion,
                                                     const SumDriveOptions& options = {});

/// Row of a fault in a sum: numbers of their own, for FaultRow's spans.
struct SumRow {
  Eigen::VectorXd y, g1, g2, s, range, none;  ///< p
  double c = 0.0, dy = 0.0, doubt = 0.0;

  /// The row as FaultMargin takes it; spans are of this object.
  [[nodiscard]] FaultRow row() const;
};

/// One fault in the sums of a drive.
class SumResponse {
 public:
  /// References are kept.
  SumResponse(FaultType fault, const OnlineModel& model, const ReferenceMotion& motion, const SumDrive& drive);

  /// True if the fault's rows are polynomials of its size (polynomial()); else nothing is said of it.
  [[nodiscard]] bool exact() const { return exact_; }

  /// A look after an onset.
  class At {
   public:
    std::size_t onset = 0;  ///< which of the onsets
    std::size_t look = 0;   ///< of the drive
    double once = 0.0;      ///< (g1 − s)θ̂ + c: what the look's value moves by, per κ ...
    double twice = 0.0;     ///< ... and g2 θ̂, per κ²
    /// All of it.
    [[nodiscard]] SumRow row() const { return of_->row(*this); }

   private:
    friend class SumResponse;
    const SumResponse* of_ = nullptr;
    const void* active_ = nullptr;
  };

  /// Sets the fault in at each of `onsets` (instants, ascending; each between two elements of a segment) and visits
  /// every look up to `within` s after each, in the order of time.
  void walk(std::span<const std::size_t> onsets, double within, const std::function<void(const At&)>& visit);

  /// Visits every look of a drive in which the fault was there from before each segment on, At::onset the segment's
  /// number. Throws InvalidArgument for a fault that is not there in full from its onset on.
  void walk_broken(const std::function<void(const At&)>& visit);

 private:
  struct Active;
  [[nodiscard]] SumRow row(const At& at) const;
  [[nodiscard]] std::size_t end_of(std::size_t segment) const;
  void visit_look(std::size_t which, const Active& active, const std::function<void(const At&)>& visit) const;
  void take(const FaultElements& elements, Eigen::Ref<Eigen::MatrixXd> last);
  void add_jump(const FaultSignals& jump);
  void weigh(std::size_t instant);
  [[nodiscard]] double value(const At& at, Eigen::Index weight, Eigen::Index column) const;
  void add_errors(const At& at, SumRow& row) const;

  FaultType fault_;
  const OnlineModel* model_;
  const ReferenceMotion* motion_;
  const SumDrive* drive_;
  bool exact_ = false, stationary_ = false, constant_only_ = false;
  double most_kappa_ = 0.0;
  Eigen::VectorXd largest_;                                // |θ|
  Eigen::MatrixXd motion_gain_, effort_gain_, seen_gain_;  // |K|, |H| + |G|, |S|
  Eigen::MatrixXd spread_;                                 // |input| |input⁺|
  Eigen::Index p_ = 0, n_ = 0, W_ = 0;
  Eigen::Index g1_ = -1, g2_ = -1, s_ = -1, c_ = -1, range_ = -1, columns_ = 2;  // first columns; -1: none
  Eigen::MatrixXd signals_;         // outputs × columns, of the newest element
  Eigen::ArrayXXd q_;               // weights × columns
  double added_ = 0.0;              // effort of the newest element
  std::vector<KernelSums> shared_;  // stationary: of all elements of the segment, per scale
};

}  // namespace wheelwright::detector
