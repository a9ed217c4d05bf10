// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "detector/online_model.hpp"
#include "formats/robots/online_model_file.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

// JSON that is read is written as the same; a model that is read makes a detector.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::clean([&] {
    const Json json = files::parse_json(fuzz::text_of(data, size), "model.json");
    fuzz::promised([&] { fuzz::require(files::parse_json(files::json_text(json), "again.json") == json); });
    const OnlineModel model = robots::model_from_json(json, "model.json");
    static_cast<void>(make_detector(model));
  });
}
