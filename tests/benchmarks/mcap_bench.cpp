// SPDX-License-Identifier: Apache-2.0
// Reading an MCAP file message by message, with its checksums, against reading the same bytes and doing nothing.
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/logs/mcap.hpp"
#include "tests/benchmarks/bench.hpp"
#include "tests/benchmarks/temporary_file.hpp"

namespace wheelwright::bench::mcap_bench {
namespace {

constexpr std::size_t messages = 2'000'000;
constexpr int repetitions = 3;

/// Messages as a driver of two wheels sends them: a stamp, the names of the joints, and position, velocity and effort
/// of each, whose last digits are noise. Returns the bytes of all data.
std::size_t write_log(const std::filesystem::path& path, logs::McapCompression compression) {
  logs::McapWriter writer(path, {compression, std::size_t{1} << 20, "ros2", "wheelwright-bench"});
  const auto schema = writer.add_schema("sensor_msgs/msg/JointState", "ros2msg", "float64[] position\n");
  const auto channel = writer.add_channel(schema, "/joint_states", "cdr");
  const std::string names = "base_link: left_wheel_joint, right_wheel_joint                                  ";
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, 1e-3);
  std::size_t bytes = 0;
  std::string data;
  for (std::size_t k = 0; k < messages; ++k) {
    const double t = 0.001 * static_cast<double>(k);
    data.assign(reinterpret_cast<const char*>(&t), sizeof t);
    data += names;
    for (int column = 0; column < 6; ++column) {
      const double value = 5.0 * std::sin(0.7 * t + column) + noise(random);
      data.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    const auto time = static_cast<std::uint64_t>(k) * 1'000'000;
    writer.write({channel, static_cast<std::uint32_t>(k), time, time, data});
    bytes += data.size() + 31;
  }
  writer.commit();
  return bytes;
}

void read_bare(const std::filesystem::path& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) {
    throw Error(path.string() + ": cannot be opened");
  }
  std::setvbuf(file.get(), nullptr, _IONBF, 0);
  std::vector<char> buffer(std::size_t{1} << 20);
  while (std::fread(buffer.data(), 1, buffer.size(), file.get()) > 0) {
    DoNotOptimize(buffer);
  }
}

void read_messages(const std::filesystem::path& path) {
  logs::McapReader reader(path);
  logs::McapMessage message;
  double sum = 0.0;
  while (reader.next(message)) {
    double first = 0.0;
    std::memcpy(&first, message.data.data(), sizeof first);
    sum += first;
  }
  DoNotOptimize(sum);
  if (reader.report().messages != messages || !reader.report().clean()) {
    throw Error(path.string() + ": not everything was read");
  }
}

void measure(Form form, const char* name, logs::McapCompression compression) {
  const TemporaryFile file("mcap");
  const auto unpacked = static_cast<double>(write_log(file.path, compression));
  const auto size = static_cast<double>(std::filesystem::file_size(file.path));
  const auto note = [&](double seconds) {
    return fmt::format("{:.0f} MB/s of a file of {:.0f} MB, {:.0f} MB/s unpacked", 1e-6 * size / seconds, 1e-6 * size,
                       1e-6 * unpacked / seconds);
  };
  compare(
      form, {name, messages, 0, 1, "bare read", note}, [&] { read_messages(file.path); }, [&] { read_bare(file.path); },
      repetitions);
}

void mcap_against_bare_read(Form form) {
  measure(form, "logs/mcap none", logs::McapCompression::none);
  measure(form, "logs/mcap zstd", logs::McapCompression::zstd);
  measure(form, "logs/mcap lz4", logs::McapCompression::lz4);
}

const bool registered = register_bench("logs/mcap", mcap_against_bare_read);

}  // namespace
}  // namespace wheelwright::bench::mcap_bench
