// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/study_json.hpp>

#include "fuzz.hpp"

using namespace wheelwright;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::clean([&] { static_cast<void>(results::parse_study(fuzz::text_of(data, size), "study.yaml", {})); });
}
