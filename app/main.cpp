// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <sstream>
#include <system_error>
#include <thread>
#include <vector>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "app/command_tree.hpp"
#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/options.hpp"
#include "core/error.hpp"
#include "formats/files/temporary.hpp"
#include "results/software.hpp"

namespace {

using namespace wheelwright::app;

// Of each command one sentence: the rest is in its own help.
class ShortList : public CLI::Formatter {
 public:
  std::string make_subcommand(const CLI::App* command) const override {
    std::ostringstream out;
    CLI::detail::format_help(out, command->get_name(), first_sentence(command->get_description()), get_column_width());
    return out.str();
  }
};

std::string joined(int count, char** words) {
  std::string line = "wheelwright";
  for (int k = 1; k < count; ++k) {
    line += std::string(" ") + words[k];
  }
  return line;
}

// When the program is interrupted, what it is writing is removed, and it ends with 128 + the signal's number. A thread
// waits for the signal, since a handler must not touch files. Signals that whoever started the program has switched off
// stay off.
void end_when_interrupted() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction now {};
    if (sigaction(signal, nullptr, &now) == 0 && now.sa_handler != SIG_IGN) {
      sigaddset(&signals, signal);
    }
  }
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::thread([signals] {
    int signal = 0;
    if (sigwait(&signals, &signal) == 0) {
      wheelwright::files::remove_temporaries();
      remove_empty_directories();
      _exit(128 + signal);
    }
  }).detach();
}

int without_thread(const std::system_error& error) {
  tell_error(fmt::format("no thread can be started ({}): expected room for more of them: ulimit -u, or fewer --threads",
                         error.code().message()));
  return kBadInput;
}

int run(int argc, char** argv) {
  CLI::App program(
      "Model-based fault detection for wheeled robots, with thresholds that are derived, not tuned.\n"
      "A robot and a log of fault-free driving go in; a model with thresholds that no healthy robot exceeds, while the "
      "assumptions that it lists hold, comes out.",
      "wheelwright");
  program.set_version_flag("--version", wheelwright::results::software());
  program.require_subcommand(1);
  program.formatter(std::make_shared<ShortList>());
  program.footer(
      "Start with:  wheelwright try BAG --urdf robot.urdf, or wheelwright commission LOG --robot robot.yaml --out "
      "result\n"
      "Each command has its own --help.");
  const std::vector<Command> commands = add_commands(program);
  program.failure_message([argc, argv, &program](const CLI::App*, const CLI::Error& error) {
    const std::string meant = suggestion(words_of(program), {argv + 1, argv + argc});
    return fmt::format("wheelwright: {}{}\nRun with --help for more information.\n", error.what(),
                       meant.empty() ? "" : "; " + meant);
  });
  refuse_mistaken_values(program);
  try {
    refuse_lost_values({argv + 1, argv + argc});
    program.parse(argc, argv);
    for (const auto& [name, run] : commands) {
      if (program.got_subcommand(name)) {
        return run(joined(argc, argv));
      }
    }
    return kBadInput;
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? kDone : kBadInput;
  } catch (const OutputLost&) {
    return kBadInput;
  } catch (const wheelwright::Error& error) {
    tell_error(error.what());
    return kBadInput;
  } catch (const std::filesystem::filesystem_error& error) {
    tell_error(fmt::format("{}: {}: expected a file or directory that can be read and written", error.path1().string(),
                           error.code().message()));
    return kBadInput;
  } catch (const std::system_error& error) {
    return without_thread(error);
  } catch (const std::bad_alloc&) {
    tell("wheelwright: not enough memory for this input: expected a shorter log, fewer threads or a larger machine\n");
    return kInternal;
  } catch (const std::exception& error) {
    tell("wheelwright: internal failure: {}\nThis is a bug; please report it with the input.\n", error.what());
    return kInternal;
  }
}

}  // namespace

// Tables of some megabytes come and go by the hundred: the system is not asked anew for each, page by page.
static void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
  // Each thread's arena reserves 64 MB of addresses; where there are none left, every allocation calls the system.
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur < (rlim_t{4} << 30)) {
    mallopt(M_ARENA_MAX, 1);
  }
#endif
}

// A file that is opened takes the lowest descriptor that is free: where a standard stream is closed, results would be
// mixed with what is printed. Its place is taken by a descriptor that can be neither read nor written, so that the loss
// of what was to stand there is noticed as that of a closed stream is.
static void occupy_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) == -1 && errno == EBADF && open("/", O_PATH) != stream) {
      _exit(kInternal);
    }
  }
}

int main(int argc, char** argv) {
  occupy_closed_streams();
  keep_freed_memory();
  std::signal(SIGXFSZ, SIG_IGN);  // what is too large for a limit cannot be written: that is told
  try {
    end_when_interrupted();
  } catch (const std::system_error& error) {
    return finished(without_thread(error));
  }
  const int code = run(argc, argv);
  discard_gathered();
  remove_empty_directories();
  return finished(code);
}
