// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/bag_log.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/bag.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/logs/ros_messages.hpp"
#include "formats/logs/row_log.hpp"

namespace wheelwright::logs {
namespace {

constexpr std::int64_t one_second = 1'000'000'000;
constexpr std::int64_t wall_clock = 100'000'000 * one_second;
constexpr std::size_t first_messages = 2000;
constexpr std::size_t looked_at = 20000;  ///< messages at least, for topics that a recording without index has

constexpr std::int64_t longest_late = one_second;
constexpr std::size_t longest_run = 5;     ///< messages that are late together
constexpr std::size_t between_runs = 200;  ///< messages: a topic that is late more often than this has several clocks

constexpr std::size_t then_every = 100;  ///< of the later messages of a topic that names its elements

constexpr std::string_view joint_state = "sensor_msgs/msg/JointState";
constexpr std::array<const char*, 3> joint_arrays = {"position", "velocity", "effort"};

/// Everything about a bag that one looks at before its rows are read.
struct BagPlan {
  std::filesystem::path path;
  BagOptions options;
  BagChoice choice;
  std::vector<std::string> topics;               ///< name of each topic
  std::vector<RosDefinition> definitions;        ///< of each source's messages: a reader may know its topics only later
  std::vector<std::vector<std::string>> filled;  ///< of each source: BagTopicView::filled
  BagClocks clocks;                              ///< of each source
};

/// Rotation about the vertical of a quaternion (x, y, z, w) that turns forward to where it points, rad; NaN of one that
/// is none, as of a message whose orientation nobody set.
double yaw_of(const double* q) {
  if (q[0] == 0.0 && q[1] == 0.0 && q[2] == 0.0 && q[3] == 0.0) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return std::atan2(2.0 * (q[3] * q[2] + q[0] * q[1]), q[3] * q[3] + q[0] * q[0] - q[1] * q[1] - q[2] * q[2]);
}

/// Adds the names of a message and the arrays that have numbers in it.
void look_at(const BagTopic& topic, std::string_view data, BagTopicView& view) {
  const std::vector<std::string> names = read_names(*topic.definition, data).value_or(std::vector<std::string>{});
  std::vector<std::string> paths;
  for (const char* array : joint_arrays) {
    for (std::size_t k = 0; k < names.size(); ++k) {
      paths.push_back(fmt::format("{}[{}]", array, k));
    }
  }
  for (const std::string& name : names) {
    if (std::ranges::find(view.names, name) == view.names.end()) {
      view.names.push_back(name);
    }
  }
  RosExtractor extractor(*topic.definition, paths);
  std::vector<double> values(paths.size());
  if (!extractor.read(data, values)) {
    return;
  }
  const auto add = [](std::vector<std::string>& to, const std::string& what) {
    if (std::ranges::find(to, what) == to.end()) {
      to.push_back(what);
    }
  };
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!std::isnan(values[k])) {
      const char* const array = joint_arrays[k / names.size()];
      add(view.filled, array);
      add(view.elements, fmt::format("{}[{}]", array, names[k % names.size()]));
    }
  }
}

/// Adds what an Imu says it does not measure: the first element of a covariance is −1 (sensor_msgs/Imu).
void look_at_imu(const BagTopic& topic, std::string_view data, BagTopicView& view) {
  for (const std::string what : {"angular_velocity", "linear_acceleration"}) {
    RosExtractor extractor(*topic.definition, {what + "_covariance[0]"});
    std::array<double, 1> first{};
    if (extractor.read(data, first) && first[0] == -1.0) {
      view.unmeasured.push_back(what);
    }
  }
}

/// Adds that a pose has no orientation: its first quaternion is none.
void look_at_pose(const BagTopic& topic, std::string_view data, BagTopicView& view) {
  const std::string pose(pose_of(topic.type));
  if (pose.empty()) {
    return;
  }
  RosExtractor extractor(*topic.definition, quaternion_fields(pose + ".orientation"));
  std::array<double, 4> q{};
  if (extractor.read(data, q) && std::isnan(yaw_of(q.data()))) {
    view.unmeasured.emplace_back("orientation");
  }
}

/// The names and filled arrays of every topic that has them. The first messages are looked at one by one, since drivers
/// begin with NaN and publishers share topics; later ones now and then.
std::vector<BagTopicView> view_topics(BagReader& bag) {
  constexpr std::size_t each = 50;
  std::map<std::size_t, BagTopicView> met;
  std::map<std::size_t, RosExtractor> unread;
  std::map<std::size_t, std::size_t> counts;
  BagMessage message;
  std::size_t read = 0;
  while ((read < looked_at || met.size() < bag.topics().size()) && bag.next(message)) {
    ++read;
    const BagTopic& topic = bag.topics()[message.topic];
    BagTopicView& view = met[message.topic];
    const std::size_t count = counts[message.topic]++;
    if (topic.definition && (count == 0 || (count < each && !view.unreadable.empty()))) {
      RosExtractor& any =
          unread.try_emplace(message.topic, *topic.definition, std::vector<std::string>{}).first->second;
      view.unreadable = any.read(message.data, {}) ? "" : any.error();
    }
    if (topic.type == joint_state && topic.definition && (count < each || count % then_every == 0)) {
      look_at(topic, message.data, view);
    } else if (topic.definition && count == 0) {
      topic.type == "sensor_msgs/msg/Imu" ? look_at_imu(topic, message.data, view)
                                          : look_at_pose(topic, message.data, view);
    }
  }
  std::vector<BagTopicView> views;
  for (std::size_t k = 0; k < bag.topics().size(); ++k) {
    const auto view = met.find(k);
    views.push_back(view != met.end() ? view->second : BagTopicView{});
    views.back().silent = view == met.end();
    views.back().topic = &bag.topics()[k];
  }
  return views;
}

/// Times of the first messages of each source's topic.
std::vector<TopicTimes> first_times(BagReader& bag, const std::vector<BagSource>& sources) {
  std::vector<TopicTimes> times;
  std::vector<RosExtractor> extractors;
  for (const BagSource& source : sources) {
    times.push_back({bag.topics()[source.topic].name, {}, {}});
    extractors.emplace_back(*bag.topics()[source.topic].definition, std::vector<std::string>{});
  }
  BagMessage message;
  bag.rewind();
  while (std::ranges::any_of(times, [](const TopicTimes& t) { return t.stamps.size() < first_messages; }) &&
         bag.next(message)) {
    const auto source = std::ranges::find(sources, message.topic, &BagSource::topic);
    const auto k = static_cast<std::size_t>(source - sources.begin());
    if (source == sources.end() || times[k].stamps.size() >= first_messages || !extractors[k].read(message.data, {})) {
      continue;
    }
    times[k].log_times.push_back(message.log_time);
    times[k].stamps.push_back(extractors[k].stamp());
  }
  return times;
}

/// What `column` makes of its fields.
double value_of(const BagColumn& column, const double* numbers) {
  if (column.is_yaw()) {
    return column.factor * yaw_of(numbers);
  }
  double sum = 0.0;
  for (std::size_t k = 0; k < column.fields.size(); ++k) {
    sum += numbers[k];
  }
  return column.factor * (column.rule == BagColumn::Rule::mean ? sum / static_cast<double>(column.fields.size()) : sum);
}

/// A message that waits for earlier ones that come late.
struct Waiting {
  std::int64_t time = 0;
  std::vector<double> numbers;  ///< as extracted
  std::size_t message = 0;      ///< of the topic, counted from 1
};

/// What the walk reads from one topic.
struct Reading {
  std::size_t topic = 0;
  std::vector<BagColumn> columns;
  std::vector<std::size_t> slots;  ///< of each column in the row
  TopicClock clock;
  std::optional<RosExtractor> extractor;
  std::vector<double> numbers;  ///< as extracted
  std::vector<double> values;   ///< one for each column
  /// Of each number whether it is one, and which. A wrapped angle says nothing of a mean, or of what lies between two.
  std::vector<std::optional<WheelAngle>> angles;
  double longest_gap = 0.0;  ///< s, behind which the last step of an angle says nothing of the next
  std::size_t messages = 0;  ///< of the topic so far
  std::size_t damaged = 0;
  std::size_t unstamped = 0;
  std::size_t without = 0;      ///< messages that have none of the columns
  std::size_t late = 0;         ///< messages that came after later ones
  std::deque<Waiting> waiting;  ///< by their times
  std::int64_t arrived = 0;     ///< time of the last message
  std::size_t behind = 0;       ///< the last so many messages rise in time and are behind an earlier one
  std::size_t run_from = 0;     ///< the first of these, as counted
  std::size_t last_behind = 0;  ///< the last one that was late, as counted; 0 before the first
  std::string first_damage;
  std::vector<std::string> filled;     ///< arrays that were known to have numbers when columns were chosen
  std::vector<std::string> late_fill;  ///< in words, those that had some later
};

class BagWalk final : public RowWalk {
 public:
  BagWalk(const BagPlan& plan, const std::vector<std::string>& names, double longest_step, LogReport* report,
          std::int64_t origin)
      : plan_(plan), names_(names), report_(report), cleaner_(names, report), row_(names.size() + 1), origin_(origin) {
    BagOptions options = plan.options;
    options.hashed = report != nullptr;
    bag_ = open_bag({plan.path}, options);
    cleaner_.set_longest_step(longest_step);
    std::vector<AlignedStream> streams;
    for (std::size_t k = 0; k < plan.choice.sources.size(); ++k) {
      add_reading(k, streams);
    }
    if (readings_.empty()) {
      throw InputError(plan.path.string() + ": none of the wanted columns is in it");
    }
    cleaner_.begin_file(fmt::format("{}: {}, message ", plan.path.string(), plan.topics[readings_.front().topic]));
    aligner_.emplace(names.size(), std::move(streams));
  }

  bool next(RowOutcome& outcome) override {
    std::int64_t time = 0;
    while (!aligner_->pop(time, std::span(row_).subspan(1))) {
      if (finished_) {
        return false;
      }
      read_on();
    }
    row_[0] = static_cast<double>(time - origin_) / static_cast<double>(one_second);
    ++number_;
    if (const std::string* missing = uncovered()) {
      cleaner_.count(&LogReport::uncovered, number_, *missing);
      outcome = RowOutcome::dropped;
    } else {
      outcome = cleaner_.clean(row_, number_);
    }
    return true;
  }

  [[nodiscard]] double t() const override { return cleaner_.t(); }
  [[nodiscard]] const double* values() const override { return row_.data() + 1; }

  void describe(LogFileReport& file) const override {
    for (const BagReport& of : bag_->reports()) {
      file.format = of.storage;
      file.bytes += of.bytes;
      file.hash += (file.hash.empty() ? "" : " ") + of.hash;
      file.notes.insert(file.notes.end(), of.losses.begin(), of.losses.end());
    }
    const std::int64_t whole_seconds = origin_ / one_second;
    file.time_origin = static_cast<double>(whole_seconds);
    file.time_zone = "UTC";
    file.header = plan_.choice.header;
    for (const std::string& field : plan_.choice.header) {
      if (!is_used(field)) {
        file.ignored.push_back(field);
      }
    }
    file.notes.insert(file.notes.end(), plan_.choice.notes.begin(), plan_.choice.notes.end());
    file.notes.insert(file.notes.end(), plan_.clocks.notes.begin(), plan_.clocks.notes.end());
    for (std::size_t k = 0; k < readings_.size(); ++k) {
      describe(readings_[k], k, file);
    }
    for (std::size_t k = 0; k < plan_.topics.size(); ++k) {
      const BagTopic& topic = bag_->topics()[k];
      const bool read = std::ranges::find(readings_, k, &Reading::topic) != readings_.end();
      if (!read && topic.messages > 0 && std::ranges::any_of(readings_, [&](const Reading& reading) {
            return plan_.topics[reading.topic] == topic.name;
          })) {
        file.notes.push_back(fmt::format(
            "{} messages of {} are of another type or definition, or otherwise encoded ({}, {}), and were not read",
            topic.messages, topic.name, topic.type, topic.encoding));
      }
    }
    for (std::size_t k = plan_.topics.size(); k < bag_->topics().size(); ++k) {
      file.notes.push_back(fmt::format(
          "{} begins so late that it was not looked at for columns; begin the recording anew, or cut it, to use it",
          bag_->topics()[k].name));
    }
  }

 private:
  /// Of the plan's source `k`, where one of its columns is wanted.
  void add_reading(std::size_t k, std::vector<AlignedStream>& streams) {
    const BagSource& source = plan_.choice.sources[k];
    Reading reading;
    reading.topic = source.topic;
    reading.clock = plan_.clocks.clocks[k];
    reading.filled = plan_.filled[k];
    AlignedStream stream;
    std::vector<std::string> fields;
    for (const BagColumn& column : source.columns) {
      const auto name = std::ranges::find(names_, column.name);
      if (name == names_.end()) {
        continue;
      }
      reading.columns.push_back(column);
      fields.insert(fields.end(), column.fields.begin(), column.fields.end());
      reading.slots.push_back(static_cast<std::size_t>(name - names_.begin()));
      stream.angle.push_back(column.name == "theta");
      const bool wheel = column.name == "phi_r" || column.name == "phi_l";
      reading.angles.insert(reading.angles.end(), column.fields.size(),
                            wheel ? std::optional(WheelAngle()) : std::nullopt);
    }
    if (reading.columns.empty()) {
      return;
    }
    stream.columns = reading.slots;
    stream.longest_gap = longest_gap_of(reading.clock.median_step);
    stream.time_error = reading.clock.jitter;
    reading.extractor.emplace(plan_.definitions[k], fields);
    reading.longest_gap = static_cast<double>(stream.longest_gap) / static_cast<double>(one_second);
    reading.numbers.resize(fields.size());
    reading.values.resize(reading.columns.size());
    readings_.push_back(std::move(reading));
    streams.push_back(std::move(stream));
  }

  /// Takes in the next message that matters.
  void read_on() {
    BagMessage message;
    if (!bag_->next(message)) {
      for (std::size_t k = 0; k < readings_.size(); ++k) {
        release(k, std::numeric_limits<std::int64_t>::max());
      }
      aligner_->finish();
      finished_ = true;
      return;
    }
    const auto found = std::ranges::find(readings_, message.topic, &Reading::topic);
    if (found == readings_.end()) {
      return;
    }
    Reading& reading = *found;
    ++reading.messages;
    if (report_ != nullptr && reading.messages % then_every == 0) {
      look_again(reading, message);
    }
    if (!reading.extractor->read(message.data, reading.numbers)) {
      damage(reading, reading.extractor->error());
      return;
    }
    std::int64_t time = message.log_time;
    if (reading.clock.stamped) {
      const std::optional<std::int64_t> stamp = reading.extractor->stamp();
      if (!stamp && !reading.clock.zero_is_time) {
        ++reading.unstamped;
        return;
      }
      time = stamp.value_or(0);
    }
    const double shifted = static_cast<double>(time) + static_cast<double>(reading.clock.shift);
    if (!(std::abs(shifted) < static_cast<double>(farthest_time))) {
      damage(reading, "its time is more than 146 years away");
      return;
    }
    find_values(reading, reading.numbers);
    if (std::ranges::all_of(reading.values, [](double value) { return std::isnan(value); })) {
      ++reading.without;
      return;
    }
    put_in_order(static_cast<std::size_t>(found - readings_.begin()), time + reading.clock.shift);
  }

  /// Whether an array has numbers now that had none when columns were chosen.
  void look_again(Reading& reading, const BagMessage& message) {
    const BagTopic& topic = bag_->topics()[message.topic];
    if (topic.type != joint_state || !topic.definition || reading.filled.size() == joint_arrays.size()) {
      return;
    }
    BagTopicView now;
    look_at(topic, message.data, now);
    for (const std::string& array : now.filled) {
      if (std::ranges::find(reading.filled, array) == reading.filled.end()) {
        reading.filled.push_back(array);
        const auto element = std::ranges::find_if(now.elements, [&](const auto& e) { return e.starts_with(array); });
        reading.late_fill.push_back(
            fmt::format("{}: {} has numbers from about message {} on, too late to be looked at for columns: --map "
                        "NAME={}.{} takes them",
                        topic.name, array, reading.messages, topic.name, *element));
      }
    }
  }

  static void damage(Reading& reading, const std::string& why) {
    if (reading.damaged++ == 0) {
      reading.first_damage = fmt::format("message {}: {}", reading.messages, why);
    }
  }

  /// What the columns make of the numbers.
  static void find_values(Reading& reading, const std::vector<double>& numbers) {
    const double* number = numbers.data();
    for (std::size_t k = 0; k < reading.columns.size(); ++k) {
      reading.values[k] = value_of(reading.columns[k], number);
      number += reading.columns[k].fields.size();
    }
  }

  /// Undoes the whole turns of wheel angles, joint by joint.
  void unwrap(Reading& reading, Waiting& message) {
    const double time = static_cast<double>(message.time) / static_cast<double>(one_second);
    std::size_t at = 0;
    for (const BagColumn& column : reading.columns) {
      for (const std::string& field : column.fields) {
        double& number = message.numbers[at];
        std::optional<WheelAngle>& angle = reading.angles[at++];
        if (!angle || !std::isfinite(number) || column.factor == 0.0 || time == angle->time()) {
          continue;
        }
        const double step = time - angle->time();
        const double value = number * column.factor;
        number = (step > 0.0 ? angle->follow(time, value, step <= reading.longest_gap) : angle->begin(time, value)) /
                 column.factor;
        if (angle->jumped() && report_ != nullptr && report_->angle_wraps.count++ == 0) {
          report_->angle_wraps.first = fmt::format("{}: {}, message {}, {} for column {}", plan_.path.string(),
                                                   plan_.topics[reading.topic], message.message, field, column.name);
        }
      }
    }
  }

  /// Keeps the values of a reading back until none that is up to longest_late earlier can come. A time that goes back
  /// by more is another recording, and so is a run of messages behind an earlier one where none was late for long: the
  /// clock was set back.
  void put_in_order(std::size_t k, std::int64_t time) {
    Reading& reading = readings_[k];
    std::deque<Waiting>& waiting = reading.waiting;
    if (!waiting.empty() && time < waiting.back().time - longest_late) {
      release(k, std::numeric_limits<std::int64_t>::max());
    }
    const auto later = std::ranges::upper_bound(waiting, time, {}, [](const Waiting& message) { return message.time; });
    const bool late = later != waiting.end();
    reading.late += late ? 1U : 0U;
    waiting.insert(later, {time, reading.numbers, reading.messages});
    follow_run(reading, time, late);
    if (reading.behind == longest_run) {
      begin_again(k);
    }
    release(k, waiting.back().time - longest_late);
  }

  /// Counts the messages behind an earlier one that come one after another.
  static void follow_run(Reading& reading, std::int64_t time, bool late) {
    const bool goes_on = late && reading.behind > 0 && time > reading.arrived;
    const bool begins =
        late && !goes_on && (reading.last_behind == 0 || reading.messages > reading.last_behind + between_runs);
    reading.behind = goes_on ? reading.behind + 1 : begins ? 1 : 0;
    reading.run_from = begins ? reading.messages : reading.run_from;
    reading.last_behind = late ? reading.messages : reading.last_behind;
    reading.arrived = time;
  }

  /// Ends what came before the run that is behind it.
  void begin_again(std::size_t k) {
    Reading& reading = readings_[k];
    const auto of_run = [&](const Waiting& message) { return message.message >= reading.run_from; };
    std::deque<Waiting> run;
    std::ranges::copy_if(reading.waiting, std::back_inserter(run), of_run);
    std::erase_if(reading.waiting, of_run);
    release(k, std::numeric_limits<std::int64_t>::max());
    reading.late -= run.size();
    reading.behind = 0;
    reading.waiting = std::move(run);
  }

  void release(std::size_t k, std::int64_t until) {
    Reading& reading = readings_[k];
    std::deque<Waiting>& waiting = reading.waiting;
    while (!waiting.empty() && waiting.front().time <= until) {
      unwrap(reading, waiting.front());
      find_values(reading, waiting.front().numbers);
      aligner_->push(k, waiting.front().time, reading.values);
      waiting.pop_front();
    }
  }

  /// A column of another topic that has no value in this row.
  [[nodiscard]] const std::string* uncovered() const {
    for (std::size_t r = 1; r < readings_.size(); ++r) {
      for (const std::size_t slot : readings_[r].slots) {
        if (std::isnan(row_[slot + 1])) {
          return &names_[slot];
        }
      }
    }
    return nullptr;
  }

  [[nodiscard]] bool is_used(const std::string& field) const {
    return std::ranges::any_of(readings_, [&](const Reading& reading) {
      const std::string& topic = plan_.topics[reading.topic];
      return std::ranges::any_of(reading.columns, [&](const BagColumn& column) {
        return std::ranges::any_of(column.fields, [&](const std::string& own) {
          const std::string plain = fmt::format("{}.{}", topic, own.substr(0, own.find('[')));
          return field == fmt::format("{}.{}", topic, own) || field == plain + "[]";
        });
      });
    });
  }

  void describe(const Reading& reading, std::size_t stream, LogFileReport& file) const {
    const std::string& topic = plan_.topics[reading.topic];
    if (reading.damaged > 0) {
      file.notes.push_back(fmt::format("{} of {} messages of {} could not be read and were left out (first: {})",
                                       reading.damaged, reading.messages, topic, reading.first_damage));
    }
    file.notes.insert(file.notes.end(), reading.late_fill.begin(), reading.late_fill.end());
    if (reading.unstamped > 0) {
      file.notes.push_back(
          fmt::format("{} of {} messages of {} have no time stamp, unlike the others, and were left out",
                      reading.unstamped, reading.messages, topic));
    }
    if (reading.without > 0) {
      file.notes.push_back(
          fmt::format("{} of {} messages of {} have none of the columns that are read (other joints, or "
                      "NaN) and were left out",
                      reading.without, reading.messages, topic));
    }
    if (reading.late > 0) {
      file.notes.push_back(
          fmt::format("{} of {} messages of {} were recorded after later ones and put in the order of "
                      "their stamps",
                      reading.late, reading.messages, topic));
    }
    if (const std::size_t stale = aligner_->stale(stream); stale > 0) {
      file.notes.push_back(fmt::format("{} of {} messages of {} are not later than the one before and were left out",
                                       stale, reading.messages, topic));
    }
    if (stream == 0) {
      return;
    }
    for (const std::size_t slot : reading.slots) {
      file.interpolated.push_back({names_[slot], topic, aligner_->error()[slot]});
    }
  }

  const BagPlan& plan_;
  const std::vector<std::string>& names_;
  LogReport* report_;
  RowCleaner cleaner_;
  std::vector<double> row_;  ///< time, then the columns
  std::int64_t origin_;
  std::unique_ptr<BagReader> bag_;
  std::vector<Reading> readings_;
  std::optional<StreamAligner> aligner_;
  std::size_t number_ = 0;
  bool finished_ = false;
};

class BagFile final : public RowFile {
 public:
  BagFile(const std::filesystem::path& path, const LogOptions& options, TimeOrigin origin)
      : plan_{.path = path,
              .options = {.msg_path = options.msg_path, .hashed = false, .trust = options.trust},
              .choice = {},
              .topics = {},
              .definitions = {},
              .filled = {},
              .clocks = {}},
        origin_(std::move(origin)) {
    const auto bag = open_bag({path}, plan_.options);
    const std::vector<BagTopicView> views = view_topics(*bag);
    plan_.choice = choose_bag_columns(views, options, path.string());
    for (const BagTopic& topic : bag->topics()) {
      plan_.topics.push_back(topic.name);
    }
    if (plan_.choice.sources.empty()) {
      throw InputError(nothing_in(*bag, options));
    }
    for (const BagSource& source : plan_.choice.sources) {
      plan_.definitions.push_back(*bag->topics()[source.topic].definition);
      plan_.filled.push_back(views[source.topic].filled);
    }
    const std::vector<TopicTimes> times = first_times(*bag, plan_.choice.sources);
    plan_.clocks = bag_clocks(times);
    for (const BagSource& source : plan_.choice.sources) {
      for (const BagColumn& column : source.columns) {
        names_.push_back(column.name);
      }
    }
    if (!origin_->has_value()) {
      const TopicTimes& rows = times.front();
      const bool stamped = plan_.clocks.clocks.front().stamped;
      const std::int64_t first = rows.stamps.empty() ? 0
                                 : stamped           ? rows.stamps.front().value_or(0)
                                                     : rows.log_times.front();
      *origin_ = first > wall_clock ? first / one_second * one_second : 0;
    }
  }

  [[nodiscard]] std::string path() const override { return plan_.path.string(); }
  [[nodiscard]] const std::vector<std::string>& columns() const override { return names_; }
  [[nodiscard]] std::unique_ptr<RowWalk> open(const std::vector<std::string>& names, double longest_step,
                                              LogReport* report) override {
    return std::make_unique<BagWalk>(plan_, names, longest_step, report, origin_->value());
  }

 private:
  [[nodiscard]] std::string nothing_in(const BagReader& bag, const LogOptions& options) const {
    std::string message = plan_.path.string() + ": no topic has a column of a log";
    std::string loss;
    for (const BagReport& report : bag.reports()) {
      if (loss.empty() && !report.losses.empty()) {
        loss = "; " + report.losses.front();
      }
    }
    if (bag.topics().empty()) {
      return message + ": there is no message in it" + loss;
    }
    message += ": it has";
    for (const BagTopic& topic : bag.topics()) {
      message += fmt::format("{} {} ({}{})", &topic == &bag.topics().front() ? "" : ",", topic.name, topic.type,
                             topic.definition ? "" : ": " + topic.no_definition);
    }
    message += loss;
    for (const std::string& note : plan_.choice.notes) {
      message += "; " + note;
    }
    if (options.msg_path.empty() &&
        std::ranges::any_of(bag.topics(), [](const BagTopic& topic) { return !topic.definition; })) {
      message += "; --msg-path DIR says where definitions are";
    }
    return message +
           "; --map NAME=TOPIC.FIELD takes any numeric field, e.g. --map omega_r=/joints.velocity[right_wheel]";
  }

  BagPlan plan_;
  std::vector<std::string> names_;
  TimeOrigin origin_;
};

}  // namespace

std::unique_ptr<RowFile> bag_file(const std::filesystem::path& path, const LogOptions& options,
                                  const TimeOrigin& origin) {
  return std::make_unique<BagFile>(path, options, origin);
}

}  // namespace wheelwright::logs
