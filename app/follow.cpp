// SPDX-License-Identifier: Apache-2.0
#include "app/follow.hpp"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <deque>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "commission/watch/blind_watch.hpp"
#include "commission/watch/incident_watch.hpp"
#include "commission/watch/risk_watch.hpp"
#include "core/even_clock.hpp"
#include "detector/multiscale/pose_sums.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "detector/online_model.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/temporary.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/csv.hpp"
#include "results/detection_json.hpp"
#include "results/software.hpp"
#include "results/words/detect_summary.hpp"
#include "results/words/detect_words.hpp"

namespace wheelwright::app {
using namespace words;
namespace {

constexpr double kMerge = 0.5;        // s, as detect() on a whole log
constexpr double kPatience = 5.0;     // s without a row that are silence
constexpr double kFewestRows = 20.0;  // or as long as these many take, where that is longer
constexpr const char* kName = "standard input";
constexpr std::size_t kMostTimes = 1000;  // rows from which the step is taken

// Positions of the columns `names`; nothing, and `missing` says which, where there are not all of them.
std::optional<std::vector<std::size_t>> pick_columns(const logs::CsvRowParser& parser,
                                                     const std::vector<std::string>& names, std::string& missing) {
  std::vector<std::size_t> pick;
  for (const std::string& name : names) {
    const auto& columns = parser.columns();
    const auto it = std::find(columns.begin(), columns.end(), name);
    if (it == columns.end()) {
      missing = name;
      return std::nullopt;
    }
    pick.push_back(static_cast<std::size_t>(it - columns.begin()));
  }
  return pick;
}

// A file of lines to which each run appends: whatever ends a run, it holds whole lines.
class LineFile {
 public:
  /// Cuts off what a run that was killed, or a full disk, left of its last line; everything where it is to be `fresh`.
  /// Throws InputError where another run has the file.
  LineFile(std::filesystem::path path, bool fresh) : path_(std::move(path)) {
    if (fresh) {
      take();
      std::error_code left;  // what stays is told when it is opened
      std::filesystem::remove(path_, left);
    }
    do {
      errno = 0;
      file_ = std::ofstream(path_, std::ios::app | std::ios::binary);
      if (!file_) {
        cannot_write(errno);
      }
      take();
    } while (lock_->gone());
    std::error_code error;
    size_ = std::filesystem::file_size(path_, error);
    if (error) {
      size_ = 0;
    } else if (const std::uintmax_t whole = whole_lines(); whole < size_) {
      size_ = whole;
      std::filesystem::resize_file(path_, size_, error);
    }
  }

  /// Appends `line` and its end. Throws InputError where the file cannot take all of it.
  void append(const std::string& line) {
    errno = 0;
    if (!(file_ << line + "\n" << std::flush)) {
      const int why = errno;
      file_.close();
      cut();
      cannot_write(why);
    }
    size_ += line.size() + 1;
  }

 private:
  [[noreturn]] void cannot_write(int why) const {
    throw InputError(fmt::format("{}: cannot be written ({}): expected a writable place with room on the disk",
                                 path_.string(), std::strerror(why)));
  }
  void take() {
    lock_.reset();
    lock_ = lock_or_refuse(path_, files::PathLock::Kind::alone, path_.string());
  }
  // Bytes up to the end of the last whole line.
  [[nodiscard]] std::uintmax_t whole_lines() const {
    std::ifstream in(path_, std::ios::binary);
    std::string piece(std::size_t{1} << 16, '\0');
    for (std::uintmax_t end = size_; end > 0;) {
      const std::uintmax_t from = end - std::min<std::uintmax_t>(end, piece.size());
      in.seekg(static_cast<std::streamoff>(from));
      in.read(piece.data(), static_cast<std::streamsize>(end - from));
      if (!in) {
        return size_;
      }
      const std::size_t at = std::string_view(piece).substr(0, static_cast<std::size_t>(end - from)).rfind('\n');
      if (at != std::string_view::npos) {
        return from + at + 1;
      }
      end = from;
    }
    return 0;
  }
  void cut() const {
    std::error_code ignored;  // a pipe or a device holds no lines
    if (std::filesystem::is_regular_file(path_, ignored)) {
      std::filesystem::resize_file(path_, size_, ignored);
      if (size_ == 0) {
        std::filesystem::remove(path_, ignored);
      }
    }
  }

  std::filesystem::path path_;
  std::unique_ptr<files::PathLock> lock_;
  std::ofstream file_;
  std::uintmax_t size_ = 0;
};

// Writes what happens as it happens: the file first, since what reads standard output may be gone.
class Teller {
 public:
  explicit Teller(const FollowOptions& how) : json_(how.json) {
    if (!how.events.empty()) {
      file_.emplace(how.events, how.fresh);
    }
  }

  /// `as_json` and `as_text` make the line; each is asked where it is needed.
  template <typename AsJson, typename AsText>
  void operator()(const AsJson& as_json, const AsText& as_text) {
    std::string line;
    if (json_ || file_) {
      line = files::json_text(as_json(), -1);
    }
    append(line);
    say_line(json_ ? line : files::one_line(std::string(as_text())));
  }
  /// A line for the file alone.
  void append(const std::string& line) {
    if (file_) {
      file_->append(line);
    }
  }

 private:
  bool json_;
  std::optional<LineFile> file_;
};

// One residual: its detector, its columns, its events, and the model that names its outputs.
template <typename AnyDetector>
class Watch {
 public:
  Watch(AnyDetector detector, std::vector<std::size_t> pick, const OnlineModel& model)
      : detector_(std::move(detector)),
        pick_(std::move(pick)),
        model_(model),
        sample_(pick_.size()),
        recorder_(model.model.n(), kMerge) {}

  /// Takes a row, tells an event that begins with it, also to `incidents` where it is not null; whether there was a
  /// decision.
  bool take(const LogBlock& row, std::size_t number, Teller& tell, commission::IncidentWatch* incidents) {
    if (!row.segment_starts.empty()) {
      detector_.restart();
    }
    for (std::size_t c = 0; c < pick_.size(); ++c) {
      sample_[c] = row.columns[pick_[c]][0];
    }
    const Decision& decision = detector_.step(row.t[0], sample_);
    for (std::size_t i = 0; decision.valid && i < decision.channels.size(); ++i) {
      const detector::ChannelDecision& c = decision.channels[i];
      if (recorder_.add(i, number, row.t[0], c.residual, c.threshold.lower, c.threshold.upper, c.outside, c.alarm)) {
        const detector::Event& event = recorder_.events().back();
        tell([&] { return results::to_json(event, model_); }, [&] { return event_line(event, model_); });
        if (incidents) {
          incidents->event(event);
        }
      } else if (c.alarm && incidents) {
        incidents->lasts(row.t[0]);
      }
    }
    return decision.valid;
  }
  [[nodiscard]] bool any() const { return !recorder_.events().empty(); }

 private:
  AnyDetector detector_;
  std::vector<std::size_t> pick_;
  OnlineModel model_;
  std::vector<double> sample_;
  detector::EventRecorder recorder_;
};

// Times in which no row comes.
class Silence {
 public:
  Silence(double step, Teller& tell)
      : patience_(static_cast<std::int64_t>(1000.0 * std::max(kPatience, kFewestRows * step))), tell_(tell) {}

  [[nodiscard]] std::chrono::milliseconds patience() const { return patience_; }
  /// Nothing has come for the patience.
  void noticed() {
    if (!std::exchange(told_, true)) {
      tell();
    }
  }
  void row(double t) {
    if (std::exchange(told_, false)) {
      silence_.until = t;
      tell();
    }
    silence_ = {.since = t, .until = std::nullopt, .seconds = 0.0};
    last_ = Clock::now();
  }

 private:
  using Clock = std::chrono::steady_clock;
  void tell() {
    silence_.seconds = std::chrono::duration<double>(Clock::now() - last_).count();
    tell_([&]() -> Json { return {{"silent", results::to_json(silence_)}}; }, [&] { return silence_line(silence_); });
  }

  std::chrono::milliseconds patience_;
  Teller& tell_;
  Clock::time_point last_ = Clock::now();
  commission::StreamSilence silence_;
  bool told_ = false;
};

// What comes from `descriptor`; `silence` is told where nothing does.
class Awaited final : public files::ByteSource {
 public:
  Awaited(int descriptor, Silence& silence)
      : stream_(files::open_stream(descriptor, kName)), descriptor_(descriptor), silence_(silence) {}

  std::size_t read(char* to, std::size_t size) override {
    pollfd wanted{.fd = descriptor_, .events = POLLIN, .revents = 0};
    if (::poll(&wanted, 1, static_cast<int>(silence_.patience().count())) == 0) {
      silence_.noticed();
    }
    return stream_->read(to, size);
  }
  [[nodiscard]] std::uint64_t file_bytes() const override { return stream_->file_bytes(); }
  [[nodiscard]] std::string hash() const override { return stream_->hash(); }
  [[nodiscard]] const char* packing() const override { return stream_->packing(); }

 private:
  std::unique_ptr<files::ByteSource> stream_;
  int descriptor_;
  Silence& silence_;
};

// The `count`-th row that is left out: each of the first, then at 10, 100, 1000, … rows, for a watch of weeks.
void tell_left_out(const std::string& why, std::size_t count) {
  constexpr std::size_t kEach = 5;
  std::size_t ten = 10;
  while (ten < count) {
    ten *= 10;
  }
  if (count <= kEach) {
    tell("wheelwright detect: {} (row left out)\n", why);
  } else if (count == ten) {
    tell("wheelwright detect: {} (row left out, {} of them by now)\n", why, count);
  }
}

// Spells without a decision on the torque residual, with what the parser met in them.
class Blindness {
 public:
  Blindness(const OnlineModel& model, logs::CsvRowParser& parser, Teller& tell)
      : model_(model),
        parser_(parser),
        tell_(tell),
        watch_(model.measurement.nominal_step, model.filter.settle / model.filter.beta) {}

  /// Before each line.
  void begin_line() {
    if (watch_.spell().rows == 0) {
      parser_.begin_counts();
      unreadable_ = {};
      crawling_ = 0;
    }
  }
  /// A row with a decision at `t`.
  void decided(double t) {
    if (watch_.crawls(t)) {
      ++crawling_;
      undecided(t);
      return;
    }
    ++decisions_;
    if (const auto spell = watch_.decided(t)) {
      tell(*spell, t);
    }
  }
  void undecided(std::optional<double> t) {
    if (const auto spell = watch_.undecided(t)) {
      tell(*spell, std::nullopt);
    }
  }
  /// Returns how many lines were unreadable by now.
  std::size_t unreadable(const std::string& why) {
    unreadable_.first = unreadable_.count++ == 0 ? why : unreadable_.first;
    undecided(std::nullopt);
    return unreadable_.count;
  }
  [[nodiscard]] bool blind() const { return watch_.blind(); }
  /// Rows at which something was decided.
  [[nodiscard]] std::size_t decisions() const { return decisions_; }
  [[nodiscard]] std::string line() const { return blind_line(watch_.spell(), std::nullopt, why()); }

 private:
  [[nodiscard]] std::string why() const {
    logs::LogReport met = parser_.report();
    met.wraps = met.angle_wraps = {};
    std::vector<std::string> causes = logs::sentences(met);
    if (unreadable_.count > 0) {
      causes.push_back(fmt::format("{} line{} could not be read (first {})", unreadable_.count,
                                   unreadable_.count == 1 ? "" : "s", unreadable_.first));
    }
    if (crawling_ > 0) {
      causes.push_back(crawling_words(model_, crawling_));
    }
    return why_blind(model_, causes);
  }
  void tell(const commission::BlindSpell& spell, std::optional<double> until) {
    tell_(
        [&]() -> Json {
          return {{"blind", results::to_json(spell, until, why())}};
        },
        [&] { return blind_line(spell, until, why()); });
  }

  const OnlineModel& model_;
  logs::CsvRowParser& parser_;
  Teller& tell_;
  commission::BlindWatch watch_;
  logs::Occurrences unreadable_;
  std::size_t crawling_ = 0;  // rows of the spell by whose clock hardly any time goes by
  std::size_t decisions_ = 0;
};

}  // namespace

ExitCode follow(int stream, TorqueDetector detector, const OnlineModel& model, const detector::DetectorOptions& options,
                const logs::CsvOptions& reader, const FollowOptions& how) {
  Teller teller(how);
  const bool proves = options.residual == detector::Residual::d1;  // isolation stands on bounds
  Json header = {{"schema", kEventsSchema},
                 {"software", results::software()},
                 {"robot", model.robot.name},
                 {"warrant", results::threshold_word(model.warrant, options.residual)}};
  if (!proves) {
    header["residual"] = detector::residual_word(options.residual);
  }
  teller.append(files::json_text(header, -1));
  Silence silence(model.measurement.nominal_step, teller);
  files::LineReader in(std::make_unique<Awaited>(stream, silence), kName);
  std::string_view line;
  do {
    if (!in.next(line)) {
      throw InputError("standard input: expected a header line with the names of the columns, found its end");
    }
  } while (!logs::is_csv_content(line));
  logs::CsvRowParser parser(line, reader, model.measurement.nominal_step);
  std::string missing;
  const auto pick = pick_columns(parser, model.measurement.columns(), missing);
  if (!pick) {
    throw InputError("standard input: no column '" + missing + "', which the model was commissioned on");
  }
  Watch torque(std::move(detector), *pick, model);
  std::optional<Watch<detector::KinematicDetector>> kinematic;
  if (model.kinematic && !proves && !model.kinematic->constant) {
    tell("wheelwright detect: the model has no constant thresholds of the kinematic residual: it is not watched\n");
  } else if (model.kinematic) {
    if (const auto pose = pick_columns(parser, model.kinematic->measurement.columns(), missing)) {
      kinematic.emplace(make_detector(*model.kinematic, options), *pose, commission::with_kinematic_outputs(model));
    } else {
      tell("wheelwright detect: no column '{}': the kinematic residual is not watched\n", missing);
    }
  }
  std::optional<detector::ScaleDetector> scales;
  commission::RiskRecorder at_risk(kMerge), pose_at_risk(kMerge);
  std::vector<double> sample(pick->size()), pose_sample;
  if (model.at_risk) {
    scales.emplace(model, detector::ScaleDetectorOptions{.false_alarms = commission::torque_false_alarms(model)});
  }
  std::optional<detector::PoseSumDetector> pose_sums;
  std::vector<std::size_t> pose_pick;
  if (kinematic && model.kinematic->at_risk) {
    pose_pick = *pick_columns(parser, model.kinematic->measurement.columns(), missing);
    pose_sample.resize(pose_pick.size());
    pose_sums.emplace(*model.kinematic, detector::PoseSumOptions{.false_alarms = commission::pose_false_alarms(model)});
  }
  const auto announce = [&](const commission::RiskEvent& event) {
    teller(
        [&]() -> Json {
          return {{"at_risk", results::to_json(event, model)}};
        },
        [&] { return "at a stated risk, " + commission::sentence(event, model.model); });
  };
  commission::IncidentWatch incidents(model, kinematic.has_value());
  const std::vector<std::size_t> isolated =
      *pick_columns(parser, commission::isolation_columns(model, kinematic.has_value()), missing);
  std::vector<double> isolated_sample(isolated.size());
  const auto tell_incident = [&](const char* change, const detector::Incident& incident) {
    teller(
        [&]() -> Json {
          Json said = results::to_json(incident);
          said["change"] = change;
          return {{"incident", std::move(said)}};
        },
        [&] { return fmt::format("incident {}: {}", change, incident_sentence(incident)); });
  };
  commission::IncidentWatch* const joined = proves ? &incidents : nullptr;
  const auto settle = [&](bool all) {
    for (const commission::IncidentWatch::Told& told : incidents.settle(all)) {
      if (told.closed) {
        tell_incident("closed", *told.closed);
      }
      tell_incident(told.change == detector::IncidentRecorder::Change::opened ? "opened" : "narrowed", told.incident);
    }
  };
  Blindness blindness(model, parser, teller);
  LogBlock row;
  std::size_t number = 0;
  std::vector<double> times;      // of the first rows
  double beat = core::kInfinity;  // s, of the last heartbeat
  const auto heartbeat = [&](double t) {
    const bool open = incidents.open().has_value();
    teller(
        [&]() -> Json {
          return {{"watching",
                   {{"t", t},
                    {"rows", number},
                    {"decided", blindness.decisions()},
                    {"blind", blindness.blind()},
                    {"incident", open}}}};
        },
        [&] {
          return fmt::format("watching at {:.6g} s: {} rows, {} decided{}{}", t, number, blindness.decisions(),
                             blindness.blind() ? ", blind" : "", open ? ", an incident is open" : "");
        });
  };
  std::optional<core::EvenTimes> even;
  if (model.robot.clock && model.robot.clock->step > 0.0) {
    even.emplace(*model.robot.clock);
  }
  std::deque<LogBlock> untimed;  // rows whose place a later one tells
  const auto watch = [&] {
    for (std::size_t c = 0; c < isolated.size(); ++c) {
      isolated_sample[c] = row.columns[isolated[c]][0];
    }
    if (joined) {
      joined->row(row.t[0], isolated_sample, !row.segment_starts.empty());
    }
    if (torque.take(row, number, teller, joined)) {
      blindness.decided(row.t[0]);
    } else {
      blindness.undecided(row.t[0]);
    }
    if (times.size() < kMostTimes) {
      times.push_back(row.t[0]);
    }
    if (kinematic) {
      kinematic->take(row, number, teller, joined);
    }
    const auto sum = [&](auto& sums, const auto& columns, std::vector<double>& values, auto& recorder) {
      if (!row.segment_starts.empty()) {
        sums.restart();
      }
      for (std::size_t c = 0; c < values.size(); ++c) {
        values[c] = row.columns[columns[c]][0];
      }
      sums.step(row.t[0], values);
      if (recorder.add(sums, row.t[0])) {
        announce(recorder.watch().events.back());
      }
    };
    if (scales) {
      sum(*scales, *pick, sample, at_risk);
    }
    if (pose_sums) {
      sum(*pose_sums, pose_pick, pose_sample, pose_at_risk);
    }
    settle(false);
    ++number;
    if (how.heartbeat > 0.0 && !(row.t[0] >= beat && row.t[0] < beat + how.heartbeat)) {
      // The first row, and where the clock went back, only set the beat.
      if (row.t[0] >= beat) {
        heartbeat(row.t[0]);
      }
      beat = row.t[0];
    }
  };
  std::size_t lines = 0;  // of data, readable or not
  while (in.next(line)) {
    blindness.begin_line();
    lines += logs::is_csv_content(line) ? 1 : 0;
    try {
      if (!parser.parse(line, row)) {
        if (logs::is_csv_content(line)) {
          blindness.undecided(std::nullopt);
        }
        continue;
      }
    } catch (const InputError& error) {
      tell_left_out(error.what(), blindness.unreadable(error.what()));
      continue;
    }
    silence.row(row.t[0]);
    if (!even) {
      watch();
      continue;
    }
    even->take(row.t[0], !row.segment_starts.empty());
    untimed.push_back(row);
    while (const auto place = even->next()) {
      row = std::move(untimed.front());
      untimed.pop_front();
      row.t[0] = place->t;
      row.segment_starts.assign(place->starts ? 1 : 0, 0);
      watch();
    }
  }
  settle(true);
  if (incidents.open()) {
    tell_incident("closed", *incidents.open());
  }
  if (torque.any() || (kinematic && kinematic->any()) || !at_risk.watch().events.empty() ||
      !pose_at_risk.watch().events.empty()) {
    return kNo;
  }
  if (blindness.decisions() == 0) {
    tell("wheelwright detect: {}\n", why_undecided(model, number, core::median_step(times)));
    return kBadInput;
  }
  if (blindness.blind()) {
    tell("wheelwright detect: standard input ended {}\n", blindness.line());
    return kBadInput;
  }
  const double settling = model.filter.settle / (model.filter.beta * model.measurement.nominal_step);
  if (static_cast<double>(blindness.decisions()) + settling < 0.5 * static_cast<double>(lines)) {
    tell("wheelwright detect: standard input: {}\n", why_mostly_undecided(blindness.decisions(), lines, {}));
    return kBadInput;
  }
  return kDone;
}

}  // namespace wheelwright::app
