// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/bag_metadata.hpp>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/byte_source.hpp>
#include <wheelwright/files/suggest.hpp>

namespace wheelwright::bag {
namespace {

constexpr std::size_t longest_metadata = std::size_t{1} << 26;

[[noreturn]] void fail(const std::string& name, const YAML::Mark& mark, const std::string& what) {
  throw InputError(mark.is_null() ? fmt::format("{}: {}", name, what)
                                  : fmt::format("{}:{}: {}", name, mark.line + 1, what));
}

/// A text in quotes.
std::string quoted(const std::string& text) {
  YAML::Emitter out;
  out << YAML::DoubleQuoted << text;
  return out.c_str();
}

}  // namespace

Metadata read_metadata(const std::filesystem::path& path) {
  const std::string name = path.string();
  const std::string text = read_bytes(path, longest_metadata);
  try {
    const YAML::Node information = YAML::Load(text)["rosbag2_bagfile_information"];
    if (!information.IsDefined() || !information.IsMap()) {
      fail(name, YAML::Mark::null_mark(), "no rosbag2_bagfile_information: expected the metadata of a recording");
    }
    Metadata metadata;
    const YAML::Node files = information["relative_file_paths"];
    if (!files.IsDefined() || !files.IsSequence() || files.size() == 0) {
      fail(name, information.Mark(), "relative_file_paths: expected a list of at least one file");
    }
    for (const YAML::Node& file : files) {
      if (!file.IsScalar() || file.Scalar().empty()) {
        fail(name, file.Mark(), "relative_file_paths: expected the name of a file");
      }
      metadata.files.push_back(file.Scalar());
    }
    const YAML::Node count = information["message_count"];
    std::uint64_t messages = 0;
    if (count.IsDefined() && YAML::convert<std::uint64_t>::decode(count, messages)) {
      metadata.messages = messages;
    }
    return metadata;
  } catch (const YAML::Exception& error) {
    fail(name, error.mark, error.msg);
  }
}

std::string metadata_text(const WrittenBag& bag) {
  const std::int64_t duration = bag.messages > 0 ? bag.last - bag.first : 0;
  std::string topics;
  for (const WrittenTopic& topic : bag.topics) {
    topics += fmt::format(
        "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n"
        "        offered_qos_profiles: {}\n      message_count: {}\n",
        quoted(topic.name), quoted(topic.type), quoted(topic.qos), topic.messages);
  }
  return fmt::format(
      "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: {0}\n  duration:\n    nanoseconds: {1}\n"
      "  starting_time:\n    nanoseconds_since_epoch: {2}\n  message_count: {3}\n  topics_with_message_count:{4}\n{5}"
      "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {6}\n  files:\n"
      "    - path: {6}\n      starting_time:\n        nanoseconds_since_epoch: {2}\n      duration:\n"
      "        nanoseconds: {1}\n      message_count: {3}\n",
      bag.storage, duration, bag.first, bag.messages, bag.topics.empty() ? " []" : "", topics, quoted(bag.file));
}

}  // namespace wheelwright::bag
