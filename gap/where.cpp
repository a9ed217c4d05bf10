// SPDX-License-Identifier: Apache-2.0
#include "gap/where.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <unsupported/Eigen/FFT>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/log.hpp"
#include "core/statistics.hpp"
#include "gap/causes/candidate.hpp"
#include "gap/rows/drive.hpp"
#include "identify/moments.hpp"

namespace wheelwright::gap {
namespace {

// Means over cells of equal duration, in their order: those that have values. A pause of the clock has none, however
// long.
struct Cells {
  double count = 0.0;  // cells from the first time to the last, empty ones too
  std::vector<Eigen::Index> index;
  std::vector<double> value;
};

Cells cells_of(const Eigen::VectorXd& t, const Eigen::VectorXd& values, double width) {
  std::vector<std::pair<Eigen::Index, double>> placed;
  placed.reserve(static_cast<std::size_t>(t.size()));
  Cells cells;
  cells.count = std::floor((t[t.size() - 1] - t[0]) / width + 1.0 + 1e-9);
  for (Eigen::Index k = 0; k < t.size(); ++k) {
    const double at = std::min(cells.count - 1.0, std::floor((t[k] - t[0]) / width + 1e-6));
    if (at >= 0.0) {
      placed.emplace_back(static_cast<Eigen::Index>(at), values[k]);
    }
  }
  std::ranges::stable_sort(placed, {}, &std::pair<Eigen::Index, double>::first);
  for (std::size_t k = 0; k < placed.size();) {
    const Eigen::Index at = placed[k].first;
    double sum = 0.0, filled = 0.0;
    for (; k < placed.size() && placed[k].first == at; ++k) {
      sum += placed[k].second;
      filled += 1.0;
    }
    cells.index.push_back(at);
    cells.value.push_back(sum / filled);
  }
  return cells;
}

// Windows of `length` cells, overlapping by half, that are at least half filled: where each begins among the cells.
struct Window {
  Eigen::Index first = 0;          // cell
  std::size_t begin = 0, end = 0;  // of Cells::index
};

std::vector<Window> windows_of(const Cells& cells, Eigen::Index length) {
  const Eigen::Index half = length / 2;
  std::vector<Window> windows;
  Eigen::Index next = 0;  // windows before this one are done
  for (std::size_t begin = 0; begin < cells.index.size();) {
    const Eigen::Index earliest = (cells.index[begin] - length + half) / half;  // that holds the cell
    const Eigen::Index number = std::max(next, earliest), first = number * half;
    while (begin < cells.index.size() && cells.index[begin] < first) {
      ++begin;
    }
    std::size_t end = begin;
    while (end < cells.index.size() && cells.index[end] < first + length) {
      ++end;
    }
    if (static_cast<double>(first + length) <= cells.count && 2 * (end - begin) >= static_cast<std::size_t>(length)) {
      windows.push_back({first, begin, end});
    }
    next = number + 1;
  }
  return windows;
}

// The largest product of twos, threes and fives that is <= `length`: what a fast transform likes.
Eigen::Index smooth_length(Eigen::Index length) {
  for (; length > 1; --length) {
    Eigen::Index rest = length;
    for (const Eigen::Index factor : {2, 3, 5}) {
      while (rest % factor == 0) {
        rest /= factor;
      }
    }
    if (rest == 1) {
      break;
    }
  }
  return length;
}

}  // namespace

double Spectrum::power(double lower, double upper) const {
  if (frequency.size() == 0) {
    return 0.0;
  }
  const double spacing = frequency[0];
  double sum = 0.0;
  for (Eigen::Index k = 0; k < frequency.size(); ++k) {
    sum += frequency[k] >= lower && frequency[k] < upper ? spacing * density[k] : 0.0;
  }
  return sum;
}

Spectrum spectrum(const Eigen::VectorXd& t, const Eigen::VectorXd& values, const SpectrumOptions& options) {
  check::that(t.size() == values.size(), "spectrum", "one value for each time");
  Spectrum out;
  if (t.size() < 16 || !(t[t.size() - 1] > t[0])) {
    return out;
  }
  const double step = core::median_step({t.begin(), t.end()});
  if (!(step > 0.0)) {
    return out;
  }
  const double width = step * std::max(1.0, std::floor(0.25 / options.highest / step));
  const Cells cells = cells_of(t, values, width);
  const double duration = cells.count * width;
  const double window_seconds = duration >= 2.0 * options.window ? options.window : 0.5 * duration;
  const Eigen::Index length = smooth_length(static_cast<Eigen::Index>(window_seconds / width));
  if (length < 8) {
    return out;
  }
  const double exact = static_cast<double>(length) * width;
  const auto bins = std::min<Eigen::Index>(length / 2 - 1, static_cast<Eigen::Index>(options.highest * exact));
  out.frequency = Eigen::VectorXd::LinSpaced(bins, 1.0, static_cast<double>(bins)) / exact;
  const Eigen::ArrayXd taper = (Eigen::ArrayXd::LinSpaced(length, 0.5, static_cast<double>(length) - 0.5) *
                                (std::numbers::pi / static_cast<double>(length)))
                                   .sin()
                                   .square();
  const std::vector<Window> windows = windows_of(cells, length);
  out.windows = windows.size();
  if (windows.empty()) {
    return {};
  }
  out.density = Eigen::VectorXd::Zero(bins);
  Eigen::FFT<double> transform;
  Eigen::VectorXd window(length);
  Eigen::VectorXcd transformed;
  for (const Window& at : windows) {
    Eigen::ArrayXd value = Eigen::ArrayXd::Zero(length), filled = Eigen::ArrayXd::Zero(length);
    for (std::size_t k = at.begin; k < at.end; ++k) {
      value[cells.index[k] - at.first] = cells.value[k];
      filled[cells.index[k] - at.first] = 1.0;
    }
    window = taper * value;
    transform.fwd(transformed, window);
    const double norm = (taper * filled).square().sum();
    out.density += (2.0 * width / norm) * transformed.segment(1, bins).cwiseAbs2();
  }
  out.density /= static_cast<double>(out.windows);
  return out;
}

double filtered_noise_density(double beta, double sd, double frequency) {
  const double omega = 2.0 * std::numbers::pi * frequency, b2 = beta * beta;
  return sd * sd * (8.0 / beta) * (b2 * b2) / ((b2 + omega * omega) * (b2 + omega * omega));
}

namespace {

constexpr Eigen::Index kFewestLocated = 64;
constexpr int kNoises = 24;                                                     // of each kind
constexpr std::array kEdges = {0.0, 0.2, 0.5, 1.0, 2.0, 5.0, core::kInfinity};  // Hz
constexpr std::size_t kBands = kEdges.size() - 1;
using Bands = std::array<double, kBands>;

std::string band_name(std::size_t b) {
  return b == 0            ? fmt::format("below {:g} Hz", kEdges[1])
         : b + 1 == kBands ? fmt::format("above {:g} Hz", kEdges[b])
                           : fmt::format("{:g} to {:g} Hz", kEdges[b], kEdges[b + 1]);
}

// Row of the drive that holds at each of the times `t` − `delay`.
std::vector<Eigen::Index> rows_at(const Drive& drive, const Eigen::VectorXd& t, double delay) {
  std::vector<Eigen::Index> rows;
  rows.reserve(static_cast<std::size_t>(t.size()));
  const double* first = drive.t.data();
  for (Eigen::Index k = 0; k < t.size(); ++k) {
    const double* next = std::upper_bound(first, first + drive.rows(), t[k] - delay + 0.5 * drive.step);
    rows.push_back(std::max<Eigen::Index>(0, next - first - 1));
  }
  return rows;
}

Bands powers(const Spectrum& s) {
  Bands out{};
  for (std::size_t b = 0; b < kBands; ++b) {
    out[b] = s.power(kEdges[b], kEdges[b + 1]);
  }
  return out;
}

// Band powers of noise of unit variance, for each kind of noise.
struct BandNoise {
  std::vector<Bands> mean, variance;
};

// Signals of one noise on the rows of a series. kind: 0 white, each further one differentiated once more.
Eigen::VectorXd noise(const Drive& drive, const ResidualSeries& series, const std::vector<Eigen::Index>& rows,
                      double beta, int kind, std::mt19937_64& generator) {
  std::normal_distribution<double> normal;
  const bool dynamic = series.space == GapSpace::dynamic;
  Eigen::VectorXd white(dynamic ? drive.rows() : series.t.size() + 1);
  for (double& x : white) {
    x = normal(generator);
  }
  if (!dynamic) {
    const Eigen::Index n = series.t.size();
    return kind == 0 ? Eigen::VectorXd(white.head(n)) : Eigen::VectorXd(white.tail(n) - white.head(n));
  }
  if (kind == 2) {
    const Eigen::VectorXd before = white;
    white.tail(white.size() - 1) -= before.head(white.size() - 1);
  }
  const Eigen::VectorXd passed = kind == 0 ? filtered(drive, beta, white) : filtered_rate(drive, beta, white);
  Eigen::VectorXd out(series.t.size());
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    out[k] = passed[rows[static_cast<std::size_t>(k)]];
  }
  return out;
}

BandNoise band_noise(const Drive& drive, const ResidualSeries& series, const WhereOptions& options) {
  std::mt19937_64 generator(options.seed);
  const std::vector<Eigen::Index> rows = rows_at(drive, series.t, 0.0);
  BandNoise out;
  for (int kind = 0; kind < (series.space == GapSpace::dynamic ? 3 : 2); ++kind) {
    Bands sum{}, squares{};
    double variance = 0.0;
    for (int k = 0; k < kNoises; ++k) {
      const Eigen::VectorXd signal = noise(drive, series, rows, options.beta, kind, generator);
      const Bands p = powers(spectrum(series.t, signal));
      variance += signal.squaredNorm() / static_cast<double>(signal.size()) / kNoises;
      for (std::size_t b = 0; b < kBands; ++b) {
        sum[b] += p[b];
        squares[b] += p[b] * p[b];
      }
    }
    Bands mean{}, spread{};
    for (std::size_t b = 0; b < kBands; ++b) {
      mean[b] = sum[b] / kNoises / variance;
      spread[b] =
          std::max(0.0, squares[b] / kNoises / (variance * variance) - mean[b] * mean[b]) * kNoises / (kNoises - 1.0);
    }
    out.mean.push_back(mean);
    out.variance.push_back(spread);
  }
  return out;
}

// Probability that noise of these moments has at least `power`: a scaled χ² of the same mean and variance.
double band_p_value(double power, double mean, double variance) {
  if (!(mean > 0.0) || !(variance > 0.0)) {
    return 1.0;
  }
  const double freedom = 2.0 * mean * mean / variance;
  return core::chi_squared_tail(freedom, std::max(0.0, freedom * power / mean));
}

double share_of(double part, double whole) {
  return whole > 0.0 ? std::round(100.0 * std::clamp(part / whole, 0.0, 1.0)) / 100.0 : 0.0;
}

GapShare entry(const ResidualSeries& series, std::string kind, std::string regime) {
  GapShare out;
  out.space = series.space;
  out.channel = series.channel;
  out.kind = std::move(kind);
  out.regime = std::move(regime);
  return out;
}

// p-value that the mean of `excess` is above 0 by chance, with a floor (its square) of relative error `error`.
double mean_p_value(const Eigen::VectorXd& excess, double floor_square, double error) {
  identify::BlockSums sums(1);
  const double mean = excess.mean();
  for (const double e : excess) {
    sums.add(Eigen::VectorXd::Constant(1, e - mean));
  }
  const identify::LongRunCovariance covariance = identify::long_run_covariance(sums, 12);
  const double n = static_cast<double>(excess.size());
  const double variance = covariance.matrix(0, 0) / (n * n) + std::pow(2.0 * error * floor_square, 2);
  if (!(variance > 0.0) || !(covariance.freedom >= 1.0)) {
    return mean > 0.0 ? 0.0 : 1.0;
  }
  return core::student_tail(covariance.freedom, mean / std::sqrt(variance));
}

void add_regimes(std::vector<GapShare>& out, const Drive& drive, const std::vector<Regime>& all,
                 const ResidualSeries& series, const Eigen::VectorXd& excess, const WhereOptions& options,
                 double families) {
  const double delay = series.space == GapSpace::dynamic ? 2.0 / options.beta : 0.0;
  const std::vector<Eigen::Index> rows = rows_at(drive, series.t, delay);
  std::vector<Mask> masks;
  for (const Regime& regime : all) {
    Mask mask(excess.size());
    for (Eigen::Index k = 0; k < mask.size(); ++k) {
      mask[k] = regime.instants[rows[static_cast<std::size_t>(k)]];
    }
    masks.push_back(std::move(mask));
  }
  // Logarithms temper bursts, which would make any arrangement of the blocks look extreme.
  const double floor =
      series.floor > 0.0 ? series.floor : series.refitted.norm() / std::sqrt(static_cast<double>(excess.size()));
  const Eigen::VectorXd size = (series.refitted.array() / std::max(floor, 1e-300)).square().log1p();
  const std::vector<double> p =
      block_permutation_p_values(size, masks, memory_of_squares(series.refitted), options.permutations, options.seed);
  const double whole = excess.sum(), n = static_cast<double>(excess.size());
  for (std::size_t r = 0; r < all.size(); ++r) {
    GapShare share = entry(series, all[r].kind, all[r].name);
    share.presence = static_cast<double>(masks[r].count()) / n;
    if (share.presence < options.regimes.smallest_share) {
      continue;
    }
    share.share = share_of(masks[r].select(excess.array(), 0.0).sum(), whole);
    share.p_value = std::min(1.0, families * p[r]);
    out.push_back(std::move(share));
  }
}

void add_bands(std::vector<GapShare>& out, const ResidualSeries& series, const BandNoise& noise,
               const WhereOptions& options, double families) {
  const Bands measured = powers(spectrum(series.t, series.refitted));
  const double floor = series.floor * series.floor;
  Bands excess{}, room{};
  std::vector<double> p;
  for (std::size_t b = 0; b < kBands; ++b) {
    double worst = 0.0;
    for (std::size_t kind = 0; kind < noise.mean.size(); ++kind) {
      const double mean = floor * noise.mean[kind][b], error = 2.0 * options.floor_error * mean;
      room[b] = std::max(room[b], mean);
      // Mean and variance are known from as many noises only: at these levels Student's t with 23 degrees of freedom is
      // wider than the normal distribution by a root of 1.25.
      const double variance = floor * floor * 1.25 * noise.variance[kind][b] * (1.0 + 1.0 / kNoises) + error * error;
      worst = std::max(worst, floor > 0.0 ? band_p_value(measured[b], mean, variance) : 0.0);
    }
    excess[b] = std::max(0.0, measured[b] - room[b]);
    p.push_back(worst);
  }
  p = core::holm(p);
  const double whole = std::accumulate(excess.begin(), excess.end(), 0.0);
  const double rooms = std::accumulate(room.begin(), room.end(), 0.0);
  for (std::size_t b = 0; b < kBands; ++b) {
    if (room[b] > 0.0) {
      GapShare share = entry(series, "frequency", band_name(b));
      share.share = share_of(excess[b], whole);
      share.presence = room[b] / rooms;
      share.p_value = std::min(1.0, families * p[b]);
      out.push_back(std::move(share));
    }
  }
}

void check_input(const std::vector<ResidualSeries>& series, const WhereOptions& options) {
  check::positive(options.beta, "locate_gap: beta");
  check::non_negative(options.floor_error, "locate_gap: floor_error");
  check::that(options.permutations >= 19, "locate_gap: permutations", "at least 19");
  for (const ResidualSeries& s : series) {
    check::that(s.t.size() == s.refitted.size(), "locate_gap: " + s.channel, "one residual for each time");
    check::non_negative(s.floor, "locate_gap: floor of " + s.channel);
    check::that(s.refitted.allFinite() && s.t.allFinite(), "locate_gap: " + s.channel, "finite values");
  }
}

bool same_rows(const ResidualSeries& a, const ResidualSeries& b) {
  return a.space == b.space && a.t.size() == b.t.size() && a.t == b.t;
}

}  // namespace

std::vector<GapShare> locate_gap(const Drive& drive, const std::vector<ResidualSeries>& series,
                                 const WhereOptions& options) {
  check_input(series, options);
  std::vector<const ResidualSeries*> used;
  for (const ResidualSeries& s : series) {
    if (s.t.size() >= kFewestLocated && drive.rows() > 1) {
      used.push_back(&s);
    }
  }
  const std::vector<Regime> all = used.empty() ? std::vector<Regime>{} : regimes(drive, options.regimes);
  const double families = 3.0 * static_cast<double>(used.size());
  std::vector<GapShare> out;
  std::vector<double> sizes;
  double total = 0.0;
  BandNoise noise;
  const ResidualSeries* noise_of = nullptr;
  for (const ResidualSeries* s : used) {
    const double floor = s->floor * s->floor;
    const Eigen::VectorXd excess = s->refitted.array().square() - floor;
    const double unit =
        floor > 0.0 ? floor : std::max(s->refitted.squaredNorm() / static_cast<double>(excess.size()), 1e-300);
    sizes.push_back(std::max(0.0, excess.mean()) / unit);
    total += sizes.back();
    GapShare channel = entry(*s, "channel", "all");
    channel.presence = 1.0;
    channel.p_value = std::min(1.0, families * mean_p_value(excess, floor, options.floor_error));
    out.push_back(std::move(channel));
    add_regimes(out, drive, all, *s, excess, options, families);
    if (noise_of == nullptr || !same_rows(*noise_of, *s)) {
      noise = band_noise(drive, *s, options);
      noise_of = s;
    }
    add_bands(out, *s, noise, options, families);
  }
  std::size_t next = 0;
  for (GapShare& share : out) {
    if (share.kind == "channel") {
      share.share = share_of(sizes[next++], total);
    }
  }
  std::stable_sort(out.begin(), out.end(), [](const GapShare& a, const GapShare& b) {
    return std::make_pair(-a.share, a.presence) < std::make_pair(-b.share, b.presence);
  });
  return out;
}

bool is_finding(const GapShare& share) {
  return share.p_value < 0.05 && (share.kind == "channel" || share.share > share.presence);
}

}  // namespace wheelwright::gap
