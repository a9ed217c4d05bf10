// SPDX-License-Identifier: Apache-2.0
#include "model/filter/encoder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/check.hpp"

namespace wheelwright::filter {
namespace {

constexpr double kMostRounding = 0.25;     // of a count: beyond it a multiple cannot be told from its neighbour
constexpr std::size_t kFewest = 50;        // non-zero speeds below which nothing is claimed
constexpr std::size_t kFewestCounts = 8;   // different numbers of counts: a drive at two or three speeds has as few
constexpr double kSharp = 0.01;            // with less of either, how near N and the counts must be to whole numbers
constexpr std::size_t kFewestOfAll = 4;    // of numbers of counts that leave no great gaps: such speeds are a lattice
constexpr double kDense = 3.0;             // of these, the largest number of counts
constexpr double kLittleRounding = 0.015;  // of a count, of a lattice
constexpr double kMostCounts = 4194304.0;  // 2^22

double turn_over(double quantum, double step) { return 2.0 * std::numbers::pi / (quantum * step); }

double worst_rounding(std::span<const double> magnitudes, double quantum) {
  double worst = 0.0;
  for (const double m : magnitudes) {
    const double counts = m / quantum;
    worst = std::max(worst, std::abs(counts - std::round(counts)));
    if (worst >= kMostRounding) {
      break;
    }
  }
  return worst;
}

// How many different numbers of counts sorted `magnitudes` are.
std::size_t different_counts(std::span<const double> magnitudes, double quantum) {
  std::size_t different = 0;
  double last = -1.0;
  for (const double m : magnitudes) {
    const double counts = std::round(m / quantum);
    different += counts != last ? 1 : 0;
    last = counts;
  }
  return different;
}

// From the smallest speed upwards every multiple sharpens the quantum for the next.
double refine(std::span<const double> magnitudes, double quantum) {
  double sum_wn = 0.0;
  double sum_nn = 0.0;
  for (const double m : magnitudes) {
    const double n = std::round(m / quantum);
    if (std::abs(m / quantum - n) >= kMostRounding) {
      return 0.0;
    }
    sum_wn += m * n;
    sum_nn += n * n;
    quantum = sum_wn / sum_nn;
  }
  return quantum;
}

// Whether `quantum` is 1, 2 or 5 · 10ᵏ, to the relative accuracy `near`.
bool is_decimal(double quantum, double near) {
  const double scaled = quantum / std::pow(10.0, std::floor(std::log10(quantum * (1.0 + near))));
  return std::ranges::any_of(std::vector{1.0, 2.0, 5.0}, [&](double d) { return std::abs(scaled / d - 1.0) < near; });
}

// The whole number that `counts`, known to ±`doubt`, is taken for: a power of two, else a whole hundred, where one is
// as near as that, else the nearest.
double whole_counts(double counts, double doubt) {
  const double power = std::exp2(std::round(std::log2(counts))), hundred = 100.0 * std::round(counts / 100.0);
  for (const double round : {power, hundred}) {
    if (round > 0.0 && std::abs(counts - round) <= doubt) {
      return round;
    }
  }
  return std::round(counts);
}

constexpr double kClock = 2e-4;  // relative error of the step that a driver divides by, and a log shows
constexpr double kNearDecimal = 1e-6;
constexpr double kNearRpm = 1e-4;  // printed decimals blur a quantum that is no decimal number itself
constexpr double kRpm = 2.0 * std::numbers::pi / 60.0;

std::optional<EncoderFinding> search(std::span<const double> speeds, double step, bool of_angles,
                                     std::optional<double> counts_per_turn) {
  check::positive(step, "find_encoder step");
  std::vector<double> magnitudes;
  magnitudes.reserve(speeds.size());
  for (const double speed : speeds) {
    if (speed != 0.0) {
      magnitudes.push_back(std::abs(speed));
    }
  }
  const std::size_t moving = magnitudes.size();
  std::sort(magnitudes.begin(), magnitudes.end());
  magnitudes.erase(std::unique(magnitudes.begin(), magnitudes.end()), magnitudes.end());
  if (counts_per_turn) {
    const double quantum = turn_over(check::positive(*counts_per_turn, "encoder_counts_per_turn"), step);
    const double rounding = worst_rounding(magnitudes, quantum);
    if (magnitudes.empty() || rounding >= kMostRounding) {
      return std::nullopt;
    }
    return EncoderFinding{*counts_per_turn, quantum, rounding};
  }
  if (moving < kFewest || magnitudes.empty()) {
    return std::nullopt;
  }
  for (int divisor = 1; divisor <= 16; ++divisor) {
    double quantum = refine(magnitudes, magnitudes.front() / divisor);
    if (quantum <= 0.0) {
      continue;
    }
    const double counts = turn_over(quantum, step);
    if (counts < 8.0 || counts > kMostCounts || is_decimal(quantum, kNearDecimal) ||
        (!of_angles && is_decimal(quantum / kRpm, kNearRpm))) {
      return std::nullopt;
    }
    const double most = std::round(magnitudes.back() / quantum);
    const double doubt = counts * (worst_rounding(magnitudes, quantum) / most + (of_angles ? 0.0 : kClock));
    double found = whole_counts(counts, doubt);
    const double whole = turn_over(found, step);
    if (found == std::round(counts) && worst_rounding(magnitudes, whole) < kMostRounding) {
      quantum = whole;
    } else if (found == std::round(counts)) {
      found = counts;
    }
    const double rounding = worst_rounding(magnitudes, quantum);
    const std::size_t different = different_counts(magnitudes, quantum);
    const bool many = magnitudes.size() >= kFewest && different >= kFewestCounts;
    const bool dense = different >= kFewestOfAll && most <= kDense * static_cast<double>(different);
    const double apart = std::abs(counts - whole_counts(counts, doubt));
    const bool in_a_row = most == static_cast<double>(different);  // one count, two, three
    const double sharp = different == 1 ? 0.8 * kSharp : in_a_row ? std::clamp(doubt, kSharp, 10.0 * kSharp) : kSharp;
    if (many    ? rounding < kMostRounding
        : dense ? rounding < kLittleRounding && apart <= std::max(doubt, kSharp)
                : rounding < kSharp && apart < sharp && (different > 1 || divisor == 1)) {
      return EncoderFinding{found, quantum, rounding};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<EncoderFinding> find_encoder(std::span<const double> speeds, double step,
                                           std::optional<double> counts_per_turn) {
  return search(speeds, step, false, counts_per_turn);
}

std::optional<EncoderFinding> find_encoder_of_angles(std::span<const double> steps) {
  return search(steps, 1.0, true, std::nullopt);
}

}  // namespace wheelwright::filter
