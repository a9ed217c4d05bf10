// SPDX-License-Identifier: Apache-2.0
/// \file
/// An exported detector, compiled and loaded beside the library's.
#pragma once

#include <dlfcn.h>

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "detector/detector.hpp"

namespace wheelwright::testing_support {

/// Flags that the header promises to stand.
inline constexpr const char* kStrictC = "-std=c99 -Wall -Wextra -Wpedantic -Werror -ffp-contract=off";

/// True if there is a C compiler to be called.
inline bool has_c_compiler() { return std::system("cc --version > /dev/null 2>&1") == 0; }

/// An exported detector behind three plain functions.
class CDetector {
 public:
  /// Compiles `header`, whose prefix is `name`, in the directory `scratch` with the strict flags and `more`.
  CDetector(const std::filesystem::path& scratch, const std::string& header, const std::string& name,
            std::size_t inputs, std::size_t outputs, const std::string& more = "-O2")
      : inputs_(inputs), outputs_(outputs) {
    static int count = 0;
    const std::filesystem::path folder = scratch / fmt::format("c{}", count++);
    std::filesystem::create_directories(folder);
    std::ofstream(folder / (name + ".h")) << header;
    std::ofstream(folder / "detector.c") << fmt::format(R"(#include "{0}.h"
static {0}_state state;
void detector_init(void) {{ {0}_init(&state); }}
void detector_restart(void) {{ {0}_restart(&state); }}
void detector_run(long rows, const double *t, const double *sample, double *out) {{
  long k;
  int i;
  for (k = 0; k < rows; ++k) {{
    {0}_decision d;
    {0}_step(&state, t[k], sample + k * {1}, &d);
    *out++ = d.valid;
    *out++ = d.fault;
    for (i = 0; i < {2}; ++i) {{
      *out++ = d.channel[i].residual;
      *out++ = d.channel[i].predicted;
      *out++ = d.channel[i].lower;
      *out++ = d.channel[i].upper;
      *out++ = d.channel[i].dead_zone;
      *out++ = d.channel[i].outside;
      *out++ = d.channel[i].alarm;
    }}
  }}
}}
)",
                                                        name, inputs, outputs);
    const std::string command =
        fmt::format("cc {} {} -shared -fPIC -o '{}' '{}' -lm 2> '{}'", kStrictC, more,
                    (folder / "detector.so").string(), (folder / "detector.c").string(), (folder / "words").string());
    if (std::system(command.c_str()) != 0) {
      std::ifstream words(folder / "words");
      ADD_FAILURE() << command << '\n' << std::string(std::istreambuf_iterator<char>(words), {});
      return;
    }
    library_ = dlopen((folder / "detector.so").c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library_ == nullptr) {
      ADD_FAILURE() << dlerror();
      return;
    }
    init_ = std::bit_cast<void (*)()>(dlsym(library_, "detector_init"));
    restart_ = std::bit_cast<void (*)()>(dlsym(library_, "detector_restart"));
    run_ = std::bit_cast<void (*)(long, const double*, const double*, double*)>(dlsym(library_, "detector_run"));
    init_();
  }
  ~CDetector() {
    if (library_ != nullptr) {
      dlclose(library_);
    }
  }
  CDetector(const CDetector&) = delete;
  CDetector& operator=(const CDetector&) = delete;

  /// True if it was compiled and loaded.
  [[nodiscard]] bool loaded() const { return library_ != nullptr; }
  /// Forgets all but the model and the vertices it was at.
  void restart() { restart_(); }
  /// Steps through rows; 2 + 7 n numbers for each: valid, fault, then for each channel residual, predicted, lower,
  /// upper, dead zone, outside, alarm.
  [[nodiscard]] std::vector<double> run(const std::vector<double>& t, const std::vector<double>& samples) const {
    std::vector<double> out(t.size() * (2 + 7 * outputs_));
    run_(static_cast<long>(t.size()), t.data(), samples.data(), out.data());
    return out;
  }

 private:
  std::size_t inputs_, outputs_;
  void* library_ = nullptr;
  void (*init_)() = nullptr;
  void (*restart_)() = nullptr;
  void (*run_)(long, const double*, const double*, double*) = nullptr;
};

/// Result of a comparison.
struct Seen {
  std::size_t rows = 0, valid = 0, outside = 0, alarms = 0, different = 0;
};

/// Steps both through the same rows and counts decisions that differ in a bit.
inline Seen compare(TorqueDetector& ours, CDetector& theirs, const std::vector<double>& t,
                    const std::vector<double>& samples) {
  Seen seen;
  const std::size_t inputs = samples.size() / t.size();
  const std::vector<double> all = theirs.run(t, samples);
  const double* out = all.data();
  const auto same = [](double x, double y) {
    return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
  };
  for (std::size_t k = 0; k < t.size(); ++k) {
    const Decision& d = ours.step(t[k], {samples.data() + k * inputs, inputs});
    bool equal = out[0] == (d.valid ? 1.0 : 0.0) && out[1] == (d.fault ? 1.0 : 0.0);
    out += 2;
    for (const detector::ChannelDecision& c : d.channels) {
      if (d.valid) {
        equal = equal && same(out[0], c.residual) && same(out[1], c.predicted) && same(out[2], c.threshold.lower) &&
                same(out[3], c.threshold.upper) && same(out[4], c.dead_zone) && out[5] == (c.outside ? 1.0 : 0.0) &&
                out[6] == (c.alarm ? 1.0 : 0.0);
        seen.outside += c.outside ? 1 : 0;
        seen.alarms += c.alarm ? 1 : 0;
      }
      out += 7;
    }
    ++seen.rows;
    seen.valid += d.valid ? 1 : 0;
    seen.different += equal ? 0 : 1;
  }
  return seen;
}

}  // namespace wheelwright::testing_support
