#include "components/phantom_session/session.hpp"

#include <algorithm>
#include <csignal>

#include "common/core/errors.hpp"
#include "common/core/printable.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/configuration/named.hpp"
#include "components/phantom_session/argument_check.hpp"
#include "components/phantom_session/collector.hpp"
#include "components/phantom_session/console.hpp"
#include "components/phantom_session/dds_adapter.hpp"
#include "components/phantom_session/report.hpp"
#include "components/phantom_session/supervisor.hpp"

namespace phantom::phantom_session {
namespace {

constexpr double kPoll_s = 0.05;
constexpr int kLogLinesShown = 40;  // what a process says of its death, and what came before
constexpr int kPollsPerLiveLine = 5;

const runtime::DeployedHost& find_host(const runtime::Deployment& deployment, const std::string& name) {
  if (name.empty() && deployment.hosts.size() == 1) return deployment.hosts.front();
  return runtime::find_named(
      deployment.hosts, name,
      deployment.file.string() + ": hosts: " +
          (name.empty() ? "say by --host which of them this is" : "no host called '" + name + "'"));
}

// Runs one session from start to report; holds what the steps share.
class Session {
 public:
  Session(const runtime::ProcessOptions& options, const runtime::Deployment& deployment, const Config& config,
          const SessionRequest& request)
      : options_(options),
        config_(config),
        request_(request),
        cell_(deployment.cell),
        planned_(plan(deployment, options, request)),
        collector_(config.onset_threshold_Nm, config.row_interval_s,
                   [this](const std::string& line) { say(core::printable(line)); }),
        joints_(config.row_interval_s),
        adapter_(deployment.network, collector_, joints_) {}

  int run() {
    start_all();
    bool healthy = wait_until_ready();
    double seconds = 0.0;
    if (healthy && !runtime::stop_requested()) {
      say("All components are ready." + (page_.empty() ? "" : " Operator's page: " + page_));
      const auto start_ns = core::monotonic_ns();
      healthy = watch();
      seconds = core::seconds(core::monotonic_ns() - start_ns);
    }
    say("Ending the session.");
    supervisor_.stop_all(config_.stop_grace_s);
    {
      const auto guard = adapter_.lock();
      collector_.narrate_rest();
    }
    for (const auto& outcome : supervisor_.outcomes()) {
      // A process that gets SIGTERM before its main() has a handler ends by the signal itself.
      if (outcome.ended_by_us && outcome.exit_code != 0 && outcome.exit_code != 128 + SIGTERM) {
        say(outcome.name + " did not end in order (exit " + std::to_string(*outcome.exit_code) + "); see " +
            log_of(outcome.name).string() + ". Its last words:\n" +
            last_lines(log_of(outcome.name), kLogLinesShown));
        healthy = false;
      }
    }
    report(seconds);
    return healthy ? runtime::kExitDone : runtime::kExitFailed;
  }

 private:
  void say(const std::string& line) { console_.say(line); }
  std::filesystem::path log_of(const std::string& name) const {
    return options_.report_dir / "logs" / (name + ".log");
  }

  void start_all() {
    const auto bin = component_folder();
    for (const auto& planned : planned_) {
      const runtime::DeployedProcess& p = planned.process;
      supervisor_.start({p.name, bin / p.component, planned.arguments, p.nice, log_of(p.name)});
      if (p.on_topics) names_.push_back(p.component);
    }
    say("Started " + std::to_string(planned_.size()) + " processes; their logs are in " +
        (options_.report_dir / "logs").string());
  }

  // Reports each process that died, with the last lines of its log. Returns true if none did.
  bool all_alive() {
    const auto dead = supervisor_.newly_dead();
    for (const auto& process : dead) {
      say(process.name + " ended unexpectedly with code " + std::to_string(*process.exit_code) +
          ". Its last words:\n" + last_lines(log_of(process.name), kLogLinesShown));
    }
    return dead.empty();
  }

  // A stop of an earlier session stays in force until a person resets it.
  void hint_at_reset() {
    const auto guard = adapter_.lock();
    if (hinted_ || !collector_.any_stopped()) return;
    hinted_ = true;
    say("Stopped until an operator resets it: "
        "on the operator's page, or by \"master_io command reset\".");
  }

  // Returns false if a component died or is missing, true if all are ready or the user has requested a stop.
  bool wait_until_ready() {
    const auto limit_ns = core::monotonic_ns() + core::from_seconds(config_.ready_timeout_s);
    std::string missing;
    while (runtime::sleep_unless_stopped(kPoll_s)) {
      if (!all_alive()) return false;
      const bool ready = [&] {
        const auto guard = adapter_.lock();
        page_ = collector_.page();
        return collector_.all_ready(names_, &missing);
      }();
      if (ready) return true;
      hint_at_reset();
      if (core::monotonic_ns() > limit_ns) {
        say("Not ready after " + std::to_string(static_cast<int>(config_.ready_timeout_s)) +
            " s: " + missing);
        return false;
      }
    }
    say("Stopped before all components were ready.");
    return true;
  }

  // Returns the cell's only arm, for the names of its links and joints. Without it they are shown by number.
  std::optional<robot::SerialArm> load_only_arm() const {
    try {
      const runtime::CellConfig cell = runtime::load_checked_cell(cell_);
      if (cell.arms.size() == 1) return runtime::load_arm(cell.arm());
    } catch (const std::exception&) {  // the components that need the cell report what is wrong with it
    }
    return std::nullopt;
  }

  void name_links() {
    const auto arm = load_only_arm();
    if (!arm) return;
    std::vector<std::string> names;
    for (const robot::Link& link : arm->links()) names.push_back(link.name);
    const auto guard = adapter_.lock();
    collector_.on_link_names(std::move(names));
  }

  void show_live() {
    if (!console_.is_terminal() || ++polls_ % kPollsPerLiveLine != 0) return;
    const std::string line = [&] {
      const auto guard = adapter_.lock();
      return collector_.live_line();
    }();
    console_.show(line);
  }

  // Runs until the time is up or the user requests a stop (true), or a component dies (false).
  bool watch() {
    if (console_.is_terminal()) name_links();
    const auto end_ns = core::monotonic_ns() + core::from_seconds(request_.seconds);
    while (runtime::sleep_unless_stopped(kPoll_s)) {
      if (!all_alive()) return false;
      if (request_.seconds > 0.0 && core::monotonic_ns() >= end_ns) return true;
      show_live();
    }
    return true;
  }

  void report(double seconds) {
    const auto guard = adapter_.lock();
    write_report({options_.report_dir, seconds, start_utc_ns_, page_, supervisor_.outcomes(), collector_});
    joints_.write(options_.report_dir);
    draw_plots(options_.report_dir, collector_, joints_, load_only_arm());
    say("Report: " + (options_.report_dir / "index.html").string() + " (figures in summary.json)");
  }

  const runtime::ProcessOptions& options_;
  const Config& config_;
  const SessionRequest& request_;
  std::filesystem::path cell_;
  Console console_;
  int polls_ = 0;
  std::vector<PlannedProcess> planned_;
  Collector collector_;
  JointLog joints_;
  DdsAdapter adapter_;
  Supervisor supervisor_;
  std::vector<std::string> names_;
  std::string page_;
  bool hinted_ = false;
  core::Nanoseconds start_utc_ns_ = core::utc_ns();
};

}  // namespace

std::vector<PlannedProcess> plan(const runtime::Deployment& deployment,
                                 const runtime::ProcessOptions& options, const SessionRequest& request) {
  std::vector<PlannedProcess> planned;
  const auto& processes =
      find_host(deployment, options.host.empty() ? deployment.host : options.host).processes;
  for (const std::string& name : request.without) {
    if (std::none_of(processes.begin(), processes.end(), [&](const auto& p) { return p.name == name; }))
      throw core::ConfigError("--without " + name + ": no such process in " + deployment.file.string());
  }
  for (const auto& process : processes) {
    if (std::find(request.without.begin(), request.without.end(), process.name) != request.without.end())
      continue;
    PlannedProcess entry{
        process,
        {"--deployment", deployment.file.string(), "--domain", std::to_string(deployment.network.domain),
         "--report-dir", options.report_dir.string()}};
    if (options.log_level != runtime::ProcessOptions().log_level)
      entry.arguments.insert(entry.arguments.end(), {"--log-level", options.log_level});
    if (!options.host.empty()) entry.arguments.insert(entry.arguments.end(), {"--host", options.host});
    if (!options.state_dir.empty())
      entry.arguments.insert(entry.arguments.end(), {"--state-dir", options.state_dir.string()});
    // The rest of its entry it reads itself.
    if (process.name != process.component)
      entry.arguments.insert(entry.arguments.end(), {"--name", process.name});
    if (process.component == "master_io") {
      entry.arguments.insert(entry.arguments.end(), request.master_options.begin(),
                             request.master_options.end());
    }
    if (process.component == "synthetic_viewer" && !request.page_secrets.empty())
      entry.arguments.insert(entry.arguments.end(), {"--page-secrets", request.page_secrets.string()});
    entry.own_arguments =
        !process.arguments.empty() || (process.component == "master_io" && !request.master_options.empty());
    planned.push_back(std::move(entry));
  }
  return planned;
}

int run_session(const runtime::ProcessOptions& options, const runtime::Deployment& deployment,
                const Config& config, const SessionRequest& request) {
  return Session(options, deployment, config, request).run();
}

}  // namespace phantom::phantom_session
