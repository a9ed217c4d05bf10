// SPDX-License-Identifier: Apache-2.0
/// \file
/// A detector as one self-contained C99 header.
#pragma once

#include <string>

#include "detector/detector.hpp"
#include "detector/multiscale/scale_detector.hpp"

namespace wheelwright::exporter {

/// Name of an exported detector, and the origin that its header states.
struct CExportOptions {
  std::string name = "wheelwright";  ///< prefix of all its names: a C identifier, at most 40 characters
  std::string robot{};               ///< name of the robot, for the header's comment
  std::string source{};              ///< file of the model, for the same
  std::string software{};            ///< what wrote it, for the same
};

/// `detector` as C99 (also C++17) with all its numbers inside: state, init, restart and step as static inline
/// functions. No heap, no mutable static data, no recursion, bounded work; of libm exp, fabs, and round, cos or sin
/// where the model needs them. Each operation of RegressorFilter, ThresholdRule and Detector is there in the same
/// order, what motion and efforts may do between samples included: with -ffp-contract=off and the same libm every
/// decision, residual and threshold has the same bits. What a model does not need is left out.
///
/// The detector counts as new: what it has seen is not exported. Throws InputError where `name` cannot be a prefix;
/// where effects correct the efforts, or efforts are late by a stated time; where a term of the model is a function
/// that this file does not know as C; and where the set has more vertices than a table takes (SupportTable).
[[nodiscard]] std::string c_header(const TorqueDetector& detector, const CExportOptions& options = {});

/// The same with the detector at a stated risk beside it, as a state of its own (pfx_sums) with init, restart and step:
/// each operation of ElementFilter and ScaleDetector, so that value, threshold and excess of all looks have the same
/// bits as those of a ScaleDetector that is restarted where the C restarts itself (a time that does not increase, a gap
/// of more than five steps). Of libm it calls expm1, log1p and sqrt, too. `sums` is of the same model, and counts as
/// new. Throws as c_header() does, and InputError where the set has more vertices than a table takes:
/// scale_detector_for_c() makes one whose set has not.
[[nodiscard]] std::string c_header(const TorqueDetector& detector, const detector::ScaleDetector& sums,
                                   const CExportOptions& options = {});

/// The detector of `model` as `options` ask for it, with the one at a stated risk where the model says something at
/// one, for an expected number of `false_alarms` in a second there. Throws as c_header() and make_detector() do.
[[nodiscard]] std::string c_header(const OnlineModel& model, const detector::DetectorOptions& detector,
                                   double false_alarms, const CExportOptions& options = {});

/// The detector at a stated risk of `model`, with the box of its set where `options` say so, or the set has more
/// vertices than a table takes. Throws as ScaleDetector.
[[nodiscard]] detector::ScaleDetector scale_detector_for_c(const OnlineModel& model,
                                                           detector::ScaleDetectorOptions options = {});

}  // namespace wheelwright::exporter
