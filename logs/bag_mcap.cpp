// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/logs/bag_source.hpp>
#include <wheelwright/logs/mcap_reader.hpp>

namespace wheelwright::bag {
namespace {

class McapSource final : public Source {
 public:
  McapSource(const std::filesystem::path& path, std::string shown, bool hashed)
      : reader_(path, {.hashed = hashed}), shown_(std::move(shown)) {
    for (const auto& [id, channel] : reader_.channels()) {
      topic_of(id);
    }
  }

  [[nodiscard]] const std::vector<SourceTopic>& topics() const override { return topics_; }

  bool next(BagMessage& message) override {
    McapMessage found;
    while (reader_.next(found)) {
      if (found.log_time > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
        ++late_;
        continue;
      }
      message = {topic_of(found.channel_id), static_cast<std::int64_t>(found.log_time), found.data};
      ++messages_;
      return true;
    }
    return false;
  }

  void rewind() override {
    reader_.rewind();
    late_ = messages_ = 0;
  }

  [[nodiscard]] BagReport report() const override {
    McapReport own = reader_.report();
    own.path = shown_;
    BagReport report{shown_, "mcap", own.file_size, own.hash, messages_, sentences(own)};
    if (late_ > 0) {
      report.losses.push_back(
          fmt::format("{}: {} messages have a log time of 2^63 ns or more and are left out", shown_, late_));
    }
    return report;
  }

 private:
  std::size_t topic_of(std::uint16_t channel) {
    const auto [place, added] = places_.try_emplace(channel, topics_.size());
    if (added) {
      const McapChannel& own = reader_.channels().at(channel);
      const McapSchema* const schema = reader_.schema_of(own);
      topics_.push_back({own.topic, schema != nullptr ? full_ros_name(schema->name) : "", own.message_encoding,
                         schema != nullptr ? schema->encoding : "", schema != nullptr ? schema->text : ""});
    }
    return place->second;
  }

  McapReader reader_;
  std::string shown_;
  std::vector<SourceTopic> topics_;
  std::map<std::uint16_t, std::size_t> places_;
  std::uint64_t late_ = 0;
  std::uint64_t messages_ = 0;
};

}  // namespace

std::unique_ptr<Source> open_mcap(const std::filesystem::path& path, const std::string& shown, bool hashed) {
  return std::make_unique<McapSource>(path, shown, hashed);
}

}  // namespace wheelwright::bag
