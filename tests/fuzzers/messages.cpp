// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include "formats/logs/ros_messages.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

// A message definition, and behind a zero byte a message of it in CDR.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMostPaths = 64;
  return fuzz::clean([&] {
    const std::string_view input = fuzz::text_of(data, size);
    const std::size_t end = std::min(input.find('\0'), input.size());
    const logs::RosDefinition definition = logs::parse_ros_definition("fuzz/msg/Type", input.substr(0, end));
    const std::string text = logs::ros_definition_text(definition);
    fuzz::require(logs::ros_definition_text(logs::parse_ros_definition("fuzz/msg/Type", text)) == text);
    std::vector<std::string> paths = logs::numeric_paths(definition);
    paths.resize(std::min(paths.size(), kMostPaths));
    const std::string_view message = input.substr(std::min(end + 1, input.size()));
    std::vector<double> values(paths.size());
    logs::RosExtractor extractor(definition, paths);
    fuzz::require(extractor.read(message, values) == extractor.error().empty());
    static_cast<void>(logs::read_names(definition, message));
  });
}
