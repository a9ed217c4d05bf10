// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/bench.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace wheelwright::bench {
namespace {

/// Prints one subject's line when both medians are there.
class Line : public benchmark::BenchmarkReporter {
 public:
  Line(Form form, const Subject& subject) : form_(form), subject_(subject) {}

  bool ReportContext(const Context& /*context*/) override { return true; }

  void ReportRuns(const std::vector<Run>& runs) override {
    const auto found = std::ranges::find(runs, "median", &Run::aggregate_name);
    const Run& median = found == runs.end() ? runs.front() : *found;  // of one run there are no aggregates
    (median.run_name.function_name == subject_.name ? ours_ : peer_) =
        median.GetAdjustedRealTime() / benchmark::GetTimeUnitMultiplier(median.time_unit);
  }

  void Finalize() override {
    if (!ours_ || !peer_) {
      return;  // --benchmark_filter
    }
    const Subject& s = subject_;
    const std::string note = s.note ? s.note(*ours_) : "";
    if (form_ == Form::json) {
      nlohmann::ordered_json line = {{"name", s.name},         {"rows", s.rows},          {"p", s.p},
                                     {"threads", s.threads},   {"seconds", *ours_},       {"peer", s.peer},
                                     {"peer_seconds", *peer_}, {"ratio", *peer_ / *ours_}};
      if (!note.empty()) {
        line["note"] = note;
      }
      fmt::print("{}\n", line.dump());
    } else {
      fmt::print("{:<28} {:>10} rows  p {:>2}  {:>2} thr  {:>11.6f} s  {:<28} {:>11.6f} s  ratio {:>9.3g}  {}\n",
                 s.name, s.rows, s.p, s.threads, *ours_, s.peer, *peer_, *peer_ / *ours_, note);
    }
    std::fflush(stdout);
  }

 private:
  Form form_;
  const Subject& subject_;
  std::optional<double> ours_, peer_;
};

void add(const std::string& name, const Work& work, int repetitions) {
  auto* const one = benchmark::RegisterBenchmark(name.c_str(), work.run)->Repetitions(repetitions);
  if (work.own_clock) {
    one->UseManualTime()->Iterations(1);
  } else {
    one->UseRealTime();
  }
}

}  // namespace

bool take_options(std::vector<char*> options, void (*help)()) {
  char interleaved[] = "--benchmark_enable_random_interleaving=true", least[] = "--benchmark_min_time=0.1",
       warm_up[] = "--benchmark_min_warmup_time=1e-9";  // one call
  options.insert(options.begin() + 1, {interleaved, least, warm_up});
  int left = static_cast<int>(options.size());
  benchmark::Initialize(&left, options.data(), help);
  return left == 1;
}

void compare(Form form, const Subject& subject, const Work& ours, const Work& peer, int repetitions) {
  benchmark::ClearRegisteredBenchmarks();
  add(subject.name, ours, repetitions);
  add(subject.name + " | " + subject.peer, peer, repetitions);
  Line line(form, subject);
  benchmark::RunSpecifiedBenchmarks(&line);
}

std::multimap<std::string, std::function<void(Form)>>& benchmarks() {
  static std::multimap<std::string, std::function<void(Form)>> all;
  return all;
}

bool register_bench(std::string name, std::function<void(Form)> run) {
  benchmarks().emplace(std::move(name), std::move(run));
  return true;
}

}  // namespace wheelwright::bench
