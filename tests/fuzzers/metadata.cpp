// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>

#include "formats/logs/bag_files.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

namespace {

/// A folder as a recorder leaves it: two files that are there, and one beside it that nothing may reach.
std::filesystem::path folder() {
  const std::filesystem::path outside = fuzz::folder_on_disk(".metadata");
  std::filesystem::create_directory(outside / "bag");
  for (const char* const name : {"bag/a_0.mcap", "bag/a_1.mcap", "secret.mcap"}) {
    std::ofstream(outside / name) << "MCAP";
  }
  return outside / "bag";
}

}  // namespace

// Whatever metadata say, the files that are read lie in their folder.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path bag = folder();
  std::ofstream(bag / "metadata.yaml", std::ios::binary) << fuzz::text_of(data, size);
  return fuzz::clean([&] {
    for (const logs::bag::Part& part : logs::bag::parts_of(bag).files) {
      fuzz::require(part.path.lexically_normal().parent_path() == bag);
    }
  });
}
