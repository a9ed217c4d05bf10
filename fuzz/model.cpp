// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/online_model_file.hpp>

#include "fuzz.hpp"

using namespace wheelwright;

// A model that is read makes a detector.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::clean([&] {
    const OnlineModel model =
        robots::model_from_json(files::parse_json(fuzz::text_of(data, size), "model.json"), "model.json");
    static_cast<void>(make_detector(model));
  });
}
