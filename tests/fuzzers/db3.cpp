// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzzers/log.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return wheelwright::fuzz::read_log(data, size, ".db3");
}
