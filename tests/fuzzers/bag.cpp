// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/fuzzers/log.hpp"

using namespace wheelwright;

// A folder as rosbag2 records it: metadata.yaml and, behind a zero byte, its file, which may be packed as a whole or
// message by message. What is read of it is clean, and the same a second time.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path bag = fuzz::folder_on_disk(".bag");
  const std::string_view input = fuzz::text_of(data, size);
  const std::size_t end = std::min(input.find('\0'), input.size());
  const auto put = [](const std::filesystem::path& path, std::string_view bytes) {
    std::filesystem::remove(path);
    std::ofstream(path, std::ios::binary) << bytes;
  };
  put(bag / "metadata.yaml", input.substr(0, end));
  put(bag / "a_0.mcap.zstd", input.substr(std::min(end + 1, input.size())));
  return fuzz::read_log(bag, size);
}
