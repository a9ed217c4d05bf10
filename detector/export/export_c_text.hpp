// SPDX-License-Identifier: Apache-2.0
/// \file
/// The parts of an exported detector that are the same for every model, as C99.
///
/// `pfx` stands for the user's prefix, `PFX` for the same in capitals. Each part mirrors one piece of the library
/// operation by operation; whoever changes one changes the other (tests/export/export_c_test.cpp compares every bit).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <Eigen/Core>

namespace wheelwright::exporter::c_text {

/// A number as it is, to the last bit; infinity as HUGE_VAL. Throws InvalidArgument where it is NaN.
[[nodiscard]] std::string hex(double x);
/// `text` as ASCII that is safe inside a C comment.
[[nodiscard]] std::string plain(std::string text);
/// Puts `to` wherever `text` has `from`.
/// matrix(row, 0) x[0] + matrix(row, 1) x[1] + …
[[nodiscard]] std::string combination(const Eigen::MatrixXd& matrix, std::size_t row, const char* x);

/// `count` items `of(i)` in braces, wrapped.
template <typename Of>
[[nodiscard]] std::string list(std::size_t count, Of of) {
  std::string text = "{";
  std::size_t column = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string item = of(i) + (i + 1 < count ? "," : "");
    if (column + item.size() > 110) {
      text += "\n ";
      column = 1;
    }
    text += (column == 1 ? "" : " ") + item;
    column += item.size() + 1;
  }
  return text + "}";
}

/// The numbers of a vector, and those of a matrix row by row, as an initialiser.
[[nodiscard]] std::string numbers(const Eigen::VectorXd& x);
[[nodiscard]] std::string numbers(const Eigen::MatrixXd& x);

/// Compiler settings that the numbers depend on.
extern const std::string_view kCompiler;
/// Types: channel, decision (detector/detector.hpp).
extern const std::string_view kTypes;
/// FilterKernel (model/filter/kernel.hpp) for nodes, smoothed and not: state, weights of a step, prepare, take, value.
extern const std::string_view kSoftKernel, kSmoothKernel;
extern const std::string_view kNodeKernel;
/// exponential_moments() (model/filter/kernel.hpp) as far as speeds need it, and FilterKernel for them: order 1 and 2.
extern const std::string_view kFirstOrderKernel;
extern const std::string_view kSpeedKernel;
/// faded() (model/filter/kernel.hpp) of all numbers of a piece of memory, around the comparison with kTrace.
extern const std::string_view kFade;
extern const std::string_view kFaded;
/// SlopeMajorant (model/filter/kernel.hpp).
extern const std::string_view kMajorant;
/// Box::support, of the hull.
extern const std::string_view kHull;
/// SupportTable::support: the walk in one block.
extern const std::string_view kFollow;
/// ThresholdRule::at.
extern const std::string_view kThreshold;
/// PersistenceCounter.
extern const std::string_view kPersistence;

}  // namespace wheelwright::exporter::c_text
