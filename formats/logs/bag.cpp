// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/bag.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "core/check.hpp"
#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/bag_files.hpp"
#include "formats/logs/mcap_format.hpp"
#include "formats/logs/ros_messages.hpp"

namespace wheelwright::logs {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_read_topics = 10'000;
constexpr std::size_t longest_topic = 1000;  ///< bytes of its name, and of its type's: ROS allows some 250
constexpr std::size_t most_named = 10;       ///< files that cannot be read

/// A definition in a recording, parsed, or why that failed.
struct ParsedDefinition {
  std::shared_ptr<const std::string> text;  ///< keeps its address its own
  std::shared_ptr<const RosDefinition> definition;
  std::string defect;
};

/// Files one behind the other.
class Bag final : public BagReader {
 public:
  Bag(const std::vector<fs::path>& paths, const BagOptions& options) : hashed_(options.hashed), trust_(options.trust) {
    for (const fs::path& directory : options.msg_path) {
      definitions_.push_back(ros_definitions_from(directory));
    }
    for (const fs::path& path : paths) {
      add(path);
    }
    reports_ = opened_;
  }

  [[nodiscard]] const std::vector<BagTopic>& topics() const override { return topics_; }

  bool next(BagMessage& message) override {
    while (at_ < files_.size()) {
      open(at_);
      while (source_->next(message)) {
        topics_known();
        message.topic = places_[message.topic];
        BagTopic& topic = topics_[message.topic];
        if (topic.encoding == "cdr" && bag::is_packed(message.data) && !unpack(message, topic)) {
          continue;
        }
        ++topic.messages;
        return true;
      }
      close();
    }
    return false;
  }

  void rewind() override {
    if (source_ && open_ == 0) {
      source_->rewind();
    } else {
      source_.reset();
    }
    at_ = 0;
    reports_ = opened_;
    unpacked_wrong_ = packed_bytes_ = unpacked_bytes_ = 0;
    for (BagTopic& topic : topics_) {
      topic.messages = 0;
    }
  }

  [[nodiscard]] const std::vector<BagReport>& reports() const override {
    refresh();
    return reports_;
  }

 private:
  struct File {
    fs::path path;
    std::string metadata;                   ///< of the last file of a directory
    std::optional<std::uint64_t> promised;  ///< by them, for the files since `first`
    std::size_t first = 0;
  };

  /// Adds the files of one argument, and looks into each.
  void add(const fs::path& path) {
    const bag::Parts parts = bag::parts_of(path, trust_);
    const std::size_t first = files_.size();
    std::vector<std::string> losses = parts.losses;
    std::size_t lost = 0;
    for (const bag::Part& part : parts.files) {
      try {
        look_into(part);
      } catch (const InputError& error) {
        if (part.demanded) {
          throw;
        }
        if (++lost <= most_named) {
          losses.emplace_back(error.what());
        }
      }
    }
    if (lost > most_named) {
      losses.push_back(fmt::format("{}: {} more of its {} files cannot be read", path.string(), lost - most_named,
                                   parts.files.size()));
    }
    if (files_.size() == first) {
      throw InputError(fmt::format("{}: none of its {} files can be read: {}", path.string(), parts.files.size(),
                                   losses.empty() ? "" : losses.back()));
    }
    files_.back().metadata = parts.metadata;
    files_.back().promised = parts.promised;
    files_.back().first = first;
    auto& own = opened_[first].losses;
    own.insert(own.begin(), losses.begin(), losses.end());
  }

  void look_into(const bag::Part& part) {
    if (!files_.empty() && bag::content_of(part.path) == bag::Content::zstd) {
      // It would have to be unpacked twice: its topics are known when it is its turn.
      files_.push_back({part.path, {}, {}, 0});
      opened_.push_back({part.path.string(),
                         bag::storage_ending(part.path) == "db3" ? "sqlite3" : "mcap",
                         fs::file_size(part.path),
                         "",
                         0,
                         {}});
      return;
    }
    auto source = bag::open_source(part.path, {.hashed = hashed_ && files_.empty(), .trust = trust_});
    BagReport report = source->report();
    report.losses.clear();
    files_.push_back({part.path, {}, {}, 0});
    opened_.push_back(std::move(report));
    std::swap(source_, source);
    places_.clear();
    open_ = files_.size() - 1;
    topics_known();
    if (open_ > 0) {
      std::swap(source_, source);
      places_.clear();
      open_ = 0;
      topics_known();
    }
  }

  void open(std::size_t file) {
    if (source_ && open_ == file) {
      return;
    }
    places_.clear();
    source_ = bag::open_source(files_[file].path, {.hashed = hashed_, .trust = trust_});
    open_ = file;
    topics_known();
  }

  /// Takes over the report of the file that is open, behind what was known before it was read.
  void refresh() const {
    if (!source_ || open_ != at_ || at_ >= files_.size()) {
      return;
    }
    BagReport report = source_->report();
    report.messages -= unpacked_wrong_;
    std::vector<std::string> losses = opened_[at_].losses;
    losses.insert(losses.end(), report.losses.begin(), report.losses.end());
    if (unpacked_wrong_ > 0) {
      losses.push_back(
          fmt::format("{}: {} messages packed with zstd could not be unpacked and are left out, the first {}: they are "
                      "damaged, or have{} more than 512 MiB",
                      report.path, unpacked_wrong_, first_wrong_,
                      trust_ ? "" : " more than 32 MiB and 100 times their size (which --trust allows), or"));
    }
    report.losses = std::move(losses);
    reports_[at_] = std::move(report);
  }

  void close() {
    refresh();
    const File& file = files_[at_];
    if (file.promised) {
      std::uint64_t messages = 0;
      for (std::size_t k = file.first; k <= at_; ++k) {
        messages += reports_[k].messages;
      }
      if (messages != *file.promised) {
        reports_[at_].losses.push_back(fmt::format("{}: {} messages were read from its files; it says {}",
                                                   file.metadata, messages, *file.promised));
      }
    }
    unpacked_wrong_ = packed_bytes_ = unpacked_bytes_ = 0;
    ++at_;
    if (files_.size() > 1) {
      source_.reset();
    }
  }

  /// Takes over topics of the file that is open which are new.
  void topics_known() {
    const auto& own = source_->topics();
    while (places_.size() < own.size()) {
      const bag::SourceTopic& topic = own[places_.size()];
      for (const std::string* const name : {&topic.name, &topic.type}) {
        if (name->size() > longest_topic) {
          throw InputError(fmt::format("{}: a topic's name or type of {} bytes, {}: expected at most {}",
                                       source_->report().path, name->size(), files::shown(*name), longest_topic));
        }
      }
      std::vector<std::size_t>& alike = topic_places_[{topic.name, topic.type, topic.encoding}];
      if (const auto same = same_of(topic, alike); same != alike.end()) {
        places_.push_back(*same);
      } else {
        alike.push_back(topics_.size());
        places_.push_back(topics_.size());
        if (topics_.size() == most_read_topics) {
          throw InputError(fmt::format("{}: more than {} topics: expected a recording of one robot",
                                       source_->report().path, most_read_topics));
        }
        topics_.push_back(described(topic, places_.size() - 1));
      }
    }
  }

  /// Which of those of one name and type has the same fields: a recording may bring another definition of a type.
  std::vector<std::size_t>::const_iterator same_of(const bag::SourceTopic& topic,
                                                   const std::vector<std::size_t>& alike) {
    const bool own = topic.encoding == "cdr" && topic.schema_encoding == "ros2msg" && topic.schema != nullptr &&
                     !topic.schema->empty();
    const auto definition = own && !alike.empty() ? definition_of(topic).definition : nullptr;
    return std::ranges::find_if(alike, [&](std::size_t k) {
      const auto& known = topics_[k].definition;
      return definition == nullptr || known == nullptr || known->messages == definition->messages;
    });
  }

  BagTopic described(const bag::SourceTopic& topic, std::size_t place) {
    BagTopic found{topic.name, topic.type, topic.encoding, {}, {}, 0};
    if (topic.encoding != "cdr") {
      found.no_definition = fmt::format("its messages are in {}: only cdr can be read", files::shown(topic.encoding));
      return found;
    }
    if (topic.schema_encoding == "ros2msg" && topic.schema != nullptr && !topic.schema->empty()) {
      const ParsedDefinition& parsed = definition_of(topic);
      if (parsed.definition != nullptr) {
        found.definition = parsed.definition;
        return found;
      }
      found.no_definition = fmt::format("its definition in the recording is damaged ({})", parsed.defect);
    } else if (topic.schema_encoding == "ros2idl") {
      found.no_definition = "its definition in the recording is IDL, which is not read";
    } else {
      found.no_definition = "the recording has no definition of it";
    }
    try {
      for (const RosDefinitions& directory : definitions_) {
        if (auto definition = directory.find(topic.type)) {
          found.definition = std::make_shared<const RosDefinition>(*std::move(definition));
          break;
        }
      }
    } catch (const InputError& error) {
      found.no_definition += fmt::format(", and its file cannot be used ({})", error.what());
      return found;
    }
    if (!found.definition) {
      if (auto definition = bundled(topic.type, place)) {
        found.definition = std::make_shared<const RosDefinition>(*std::move(definition));
      }
    }
    if (found.definition) {
      found.no_definition.clear();
    } else {
      found.no_definition += fmt::format(
          ", and {} is not bundled: expected the directory of its .msg file as --msg-path", files::shown(topic.type));
    }
    return found;
  }

  /// The definition that a file has of a topic. It is parsed once, however many topics share it.
  const ParsedDefinition& definition_of(const bag::SourceTopic& topic) {
    const auto [place, added] = parsed_.try_emplace({topic.schema.get(), topic.type});
    ParsedDefinition& parsed = place->second;
    if (added) {
      parsed.text = topic.schema;
      try {
        RosDefinition definition = parse_ros_definition(topic.type, *topic.schema);
        definition.origin = "the recording";
        parsed.definition = std::make_shared<const RosDefinition>(std::move(definition));
      } catch (const InputError& error) {
        parsed.defect = error.what();
      }
    }
    return parsed;
  }

  /// The bundled form that fits the first message, where there are several and there is one.
  std::optional<RosDefinition> bundled(const std::string& type, std::size_t place) {
    auto forms = bundled_ros_forms(type);
    if (forms.empty()) {
      return std::nullopt;
    }
    if (forms.size() > 1) {
      if (auto data = source_->first_message(place)) {
        if (const auto unpacked = bag::is_packed(*data) ? unpacker_.unpack(*data) : std::nullopt) {
          data = std::string(*unpacked);
        }
        for (RosDefinition& form : forms) {
          if (RosExtractor(form, {}).read(*data, {})) {
            return std::move(form);
          }
        }
      }
    }
    return std::move(forms.front());
  }

  bool unpack(BagMessage& message, const BagTopic& topic) {
    packed_bytes_ += message.data.size();
    if (const auto data = unpacker_.unpack(message.data, trust_)) {
      unpacked_bytes_ += data->size();
      if (!trust_ && unpacked_bytes_ > files::most_unpacked(packed_bytes_)) {
        throw InputError(
            fmt::format("{}: its messages: {}", files_[at_].path.string(), files::too_much_unpacked(packed_bytes_)));
      }
      message.data = *data;
      return true;
    }
    if (unpacked_wrong_++ == 0) {
      first_wrong_ = fmt::format("on {} at {}", topic.name, bag::shown_time(message.log_time));
    }
    return false;
  }

  bool hashed_;
  bool trust_;
  std::vector<RosDefinitions> definitions_;
  std::map<std::pair<const std::string*, std::string>, ParsedDefinition> parsed_;  ///< by text and type
  std::vector<File> files_;
  std::vector<BagReport> opened_;  ///< as they were before reading

  std::unique_ptr<bag::Source> source_;
  std::size_t open_ = 0;             ///< the file of source_
  std::vector<std::size_t> places_;  ///< of its topics in topics_
  std::size_t at_ = 0;               ///< the file that is being read
  std::vector<BagTopic> topics_;
  std::map<std::array<std::string, 3>, std::vector<std::size_t>> topic_places_;  ///< by name, type and encoding
  mutable std::vector<BagReport> reports_;
  bag::MessageUnpacker unpacker_;
  std::uint64_t unpacked_wrong_ = 0;
  std::uint64_t packed_bytes_ = 0;    ///< of the packed messages of the file that is being read
  std::uint64_t unpacked_bytes_ = 0;  ///< what came out of them
  std::string first_wrong_;
};

}  // namespace

bool is_bag(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    for (fs::directory_iterator at(path, error), end; !error && at != end; at.increment(error)) {
      if (at->path().filename() == "metadata.yaml" || !bag::storage_ending(at->path().filename()).empty()) {
        return true;
      }
    }
    return false;
  }
  try {
    switch (bag::content_of(path)) {
      case bag::Content::mcap:
      case bag::Content::sqlite: return true;
      case bag::Content::zstd: break;
      default: return false;
    }
    // A packed stream may give its first bytes one by one.
    std::string head(16, '\0');
    const auto bytes = files::open_bytes(path);
    std::size_t size = 0;
    while (const std::size_t got = size < head.size() ? bytes->read(head.data() + size, head.size() - size) : 0) {
      size += got;
    }
    head.resize(size);
    return head.starts_with("\x89MCAP") || head.starts_with("SQLite format 3");
  } catch (const InputError&) {
    return false;
  }
}

std::unique_ptr<BagReader> open_bag(const std::vector<fs::path>& paths, const BagOptions& options) {
  check::that(!paths.empty(), "open_bag", "at least one path");
  return std::make_unique<Bag>(paths, options);
}

}  // namespace wheelwright::logs

namespace wheelwright::logs::bag {
namespace {

constexpr std::size_t bag_piece = std::size_t{1} << 18;

/// A file that was packed with zstd as a whole, read from its unpacked copy.
class PackedSource final : public Source {
 public:
  PackedSource(const std::filesystem::path& path, const SourceOptions& options)
      : shown_(path.string()), file_(directory_->path() / "unpacked") {
    unpack(path, options);
    const std::string name = shown_ + " (unpacked)";
    switch (content_of(file_)) {
      case Content::mcap: source_ = open_mcap(file_, name, {.trust = options.trust, .stored = bytes_}); break;
      case Content::sqlite: source_ = open_sqlite(file_, name, {.trust = options.trust}); break;
      default:
        throw InputError(
            fmt::format("{}: is no recording: {}expected an MCAP file or an SQLite database inside the zstd "
                        "file",
                        shown_, loss_.empty() ? "" : loss_ + "; "));
    }
  }

  [[nodiscard]] const std::vector<SourceTopic>& topics() const override { return source_->topics(); }
  bool next(BagMessage& message) override { return source_->next(message); }
  void rewind() override { source_->rewind(); }
  [[nodiscard]] std::optional<std::string> first_message(std::size_t topic) override {
    return source_->first_message(topic);
  }

  [[nodiscard]] BagReport report() const override {
    BagReport report = source_->report();
    report.path = shown_;
    report.bytes = bytes_;
    report.hash = hash_;
    if (!loss_.empty()) {
      report.losses.insert(report.losses.begin(), loss_);
    }
    return report;
  }

 private:
  void unpack(const std::filesystem::path& path, const SourceOptions& options) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> to(std::fopen(file_.c_str(), "wb"), &std::fclose);
    const auto check = [&](bool written) {
      if (!written) {
        throw InputError(
            fmt::format("{}: cannot be unpacked to {} ({}): expected room there, or TMPDIR to name another "
                        "directory",
                        shown_, file_.string(), std::strerror(errno)));
      }
    };
    check(to != nullptr);
    const auto from = files::open_bytes(path, options.hashed, true);
    bytes_ = std::filesystem::file_size(path);
    const std::uint64_t most = std::min<std::uint64_t>(largest_copy, files::most_unpacked(bytes_));
    std::vector<char> buffer(bag_piece);
    std::uint64_t unpacked = 0;
    bool limit = false;
    try {
      while (const std::size_t got = from->read(buffer.data(), buffer.size())) {
        unpacked += got;
        if (unpacked > most && !options.trust) {
          limit = true;
          break;
        }
        check(std::fwrite(buffer.data(), 1, got, to.get()) == got);
      }
    } catch (const InputError& error) {
      if (unpacked == 0 || std::ferror(to.get()) != 0) {
        throw;
      }
      loss_ = fmt::format("{}; unpacked up to byte {} of the file, {} bytes of its content", error.what(),
                          from->file_bytes(), unpacked);
    }
    if (limit) {
      throw InputError(
          most < files::most_unpacked(bytes_)
              ? fmt::format("{}: more than {} bytes come out of it: expected a smaller recording, or --trust", shown_,
                            largest_copy)
              : shown_ + ": " + files::too_much_unpacked(bytes_));
    }
    check(std::fflush(to.get()) == 0);
    if (options.hashed) {
      mcap::WindowedFile file(path, true);
      file.leave(file.size());
      hash_ = file.hash();
    }
  }

  std::string shown_;
  std::unique_ptr<files::Temporary> directory_ = temporary_directory();
  std::filesystem::path file_;
  std::unique_ptr<Source> source_;
  std::uint64_t bytes_ = 0;
  std::string hash_;
  std::string loss_;
};

}  // namespace

std::optional<std::string> Source::first_message(std::size_t /*topic*/) { return std::nullopt; }

Content content_of(const std::filesystem::path& path) {
  mcap::WindowedFile file(path, false);
  const std::string head = file.peek(0, static_cast<std::size_t>(std::min<std::uint64_t>(16, file.size())));
  const std::string_view start = head;
  return start.empty()                                                  ? Content::empty
         : start.starts_with(mcap::magic.substr(0, 5))                  ? Content::mcap
         : start.starts_with(std::string_view("SQLite format 3\0", 16)) ? Content::sqlite
         : files::is_zstd(start)                                        ? Content::zstd
                                                                        : Content::other;
}

std::unique_ptr<Source> open_source(const std::filesystem::path& path, const SourceOptions& options) {
  const std::string name = path.string();
  if (!options.trust) {
    refuse_holes(path);
  }
  switch (content_of(path)) {
    case Content::mcap: return open_mcap(path, name, options);
    case Content::sqlite: return open_sqlite(path, name, options);
    case Content::zstd: return std::make_unique<PackedSource>(path, options);
    case Content::empty: throw InputError(name + ": is empty: nothing was recorded, or nothing of it reached the disk");
    case Content::other: break;
  }
  throw InputError(name + ": at byte 0: is no recording: expected an MCAP file or an SQLite database of rosbag2");
}

std::string shown_time(std::int64_t time) {
  const std::int64_t seconds = time / 1'000'000'000, rest = time % 1'000'000'000;
  return fmt::format("{}{}.{:09} s", time < 0 ? "-" : "", seconds < 0 ? -seconds : seconds, rest < 0 ? -rest : rest);
}

}  // namespace wheelwright::logs::bag
