// SPDX-License-Identifier: Apache-2.0
/// \file
/// Several streams of samples with clocks of their own, brought to the times of the first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

namespace wheelwright::logs {

/// One stream: which columns of a row it gives.
struct AlignedStream {
  std::vector<std::size_t> columns;  ///< of the row, one for each value of a sample
  std::vector<bool> angle;           ///< whether that value is an angle in turns of 2π, to be unwrapped (rad)
  std::int64_t longest_gap = 0;      ///< ns; between samples further apart nothing is interpolated
  std::int64_t time_error = 0;       ///< ns; by which times of samples may be wrong
};

/// Rows at the times of stream 0; values of the others are interpolated linearly between their neighbouring samples.
///
/// Between samples h apart, linear interpolation at the share a of the way is off by at most a (1 − a) h²/2 max|x''|.
/// error() is the largest such bound over all rows, with |x''| from the second divided differences at both ends of the
/// step, times 9/8, plus the slope times `time_error`. For a sine of period P the bend in the middle of a step exceeds
/// what the differences at its ends show by 2/((1 + cos u) cos u), u = πh/P, which is 1.125 at eight samples a period:
/// the bound holds for signals as slow as that, or slower. Noise of the samples is in it (it makes the bound wider, by
/// at most 9/16 of the noise's own bound).
class StreamAligner {
 public:
  /// `width` is the number of columns of a row. A row is handed out when every other stream has come past its time, has
  /// ended, or lies more than `patience` ns behind. Throws InvalidArgument where there is no stream or columns overlap.
  StreamAligner(std::size_t width, std::vector<AlignedStream> streams, std::int64_t patience = 2'000'000'000);

  /// A sample of `stream` at `time` (ns). Of other streams than the first, samples that are not later than the one
  /// before are left out (stale()).
  void push(std::size_t stream, std::int64_t time, std::span<const double> values);

  /// No more samples come.
  void finish();

  /// The next row in the order of stream 0: `time` in ns, `row` its columns; those of a stream that has no samples
  /// around this time are NaN. False when no row is ready.
  bool pop(std::int64_t& time, std::span<double> row);

  /// Largest interpolation error so far of each column, in its unit.
  [[nodiscard]] const std::vector<double>& error() const { return error_; }
  /// Samples left out of `stream`.
  [[nodiscard]] std::size_t stale(std::size_t stream) const { return streams_[stream].stale; }

 private:
  struct Sample {
    std::int64_t time = 0;
    std::vector<double> values;
  };
  struct Stream {
    AlignedStream layout;
    std::deque<Sample> samples;
    std::vector<Sample> spare;
    std::size_t stale = 0;
  };

  [[nodiscard]] bool ready(std::int64_t time) const;
  void interpolate(Stream& stream, std::int64_t time, std::span<double> row);

  std::size_t width_;
  std::vector<Stream> streams_;
  std::int64_t patience_;
  std::int64_t newest_;
  bool finished_ = false;
  std::vector<double> error_;
};

}  // namespace wheelwright::logs
