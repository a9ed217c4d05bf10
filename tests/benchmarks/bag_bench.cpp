// SPDX-License-Identifier: Apache-2.0
// Numbers out of the messages of a recording, against handing out the same messages and not looking into them.
#include <array>
#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/logs/bag.hpp"
#include "formats/logs/bag_write.hpp"
#include "formats/logs/ros_messages.hpp"
#include "tests/benchmarks/bench.hpp"
#include "tests/benchmarks/temporary_file.hpp"

namespace wheelwright::bench::bag_bench {
namespace {

constexpr std::size_t messages = 1'000'000;
constexpr int repetitions = 3;

/// Joint states of two wheels, whose last digits are noise.
void write_log(const std::filesystem::path& path, logs::McapCompression compression) {
  logs::BagWriter writer(path, {.compression = compression});
  const auto topic =
      writer.add_topic("/joint_states", logs::RosJointState::type,
                       logs::ros_definition_text(logs::bundled_ros_definition(logs::RosJointState::type).value()));
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, 1e-3);
  logs::RosEncoder encoder;
  logs::RosJointState state;
  state.header.frame_id = "base_link";
  state.name = {"left_wheel_joint", "right_wheel_joint"};
  state.position = state.velocity = state.effort = {0.0, 0.0};
  for (std::size_t k = 0; k < messages; ++k) {
    const double t = 0.001 * static_cast<double>(k);
    state.header.stamp = static_cast<std::int64_t>(k) * 1'000'000;
    for (std::size_t joint = 0; joint < 2; ++joint) {
      const auto phase = static_cast<double>(joint);
      state.position[joint] = 5.0 * std::sin(0.7 * t + phase) + noise(random);
      state.velocity[joint] = 3.5 * std::cos(0.7 * t + phase) + noise(random);
      state.effort[joint] = 0.3 * std::cos(0.7 * t + phase + 0.2) + noise(random);
    }
    writer.write(topic, state.header.stamp, encoder.encode(state));
  }
  writer.commit();
}

void read_messages(const std::filesystem::path& path, bool decoded) {
  const auto bag = logs::open_bag({path});
  logs::RosExtractor extractor(*bag->topics().at(0).definition,
                               {"velocity[left_wheel_joint]", "velocity[right_wheel_joint]", "effort[left_wheel_joint]",
                                "effort[right_wheel_joint]"});
  std::array<double, 4> values{};
  logs::BagMessage message;
  double sum = 0.0;
  std::size_t count = 0;
  while (bag->next(message)) {
    if (decoded && !extractor.read(message.data, values)) {
      throw Error(path.string() + ": " + extractor.error());
    }
    sum += values[1];
    ++count;
  }
  DoNotOptimize(sum);
  if (count != messages || !bag->reports().at(0).losses.empty()) {
    throw Error(path.string() + ": not everything was read");
  }
}

void measure(Form form, const char* name, const char* ending, logs::McapCompression compression) {
  const TemporaryFile file(ending);
  write_log(file.path, compression);
  const auto size = static_cast<double>(std::filesystem::file_size(file.path));
  const auto note = [&](double seconds) {
    return fmt::format("{:.0f} MB/s of a file of {:.0f} MB, {:.0f} ns a message", 1e-6 * size / seconds, 1e-6 * size,
                       1e9 * seconds / static_cast<double>(messages));
  };
  compare(
      form, {name, messages, 0, 1, "not decoded", note}, [&] { read_messages(file.path, true); },
      [&] { read_messages(file.path, false); }, repetitions);
}

void bag_against_undecoded(Form form) {
  measure(form, "logs/bag mcap none", "mcap", logs::McapCompression::none);
  measure(form, "logs/bag mcap zstd", "mcap", logs::McapCompression::zstd);
  measure(form, "logs/bag mcap lz4", "mcap", logs::McapCompression::lz4);
  measure(form, "logs/bag db3", "db3", logs::McapCompression::none);
}

const bool registered = register_bench("logs/bag", bag_against_undecoded);

}  // namespace
}  // namespace wheelwright::bench::bag_bench
