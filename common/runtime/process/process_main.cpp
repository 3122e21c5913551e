#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <optional>
#include <system_error>

#include "common/core/errors.hpp"
#include "common/core/version.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/last_words.hpp"
#include "common/runtime/process/log.hpp"
#include "common/runtime/process/process.hpp"
#include "common/runtime/process/signals.hpp"

namespace phantom::runtime {
namespace {

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// The loader calls this before the constructors of shared libraries, which take tens of milliseconds. Only
// executables link this file, for process_main(). A sanitizer has to begin first.
void before_constructors() { install_signal_handlers(); }
[[gnu::used, gnu::section(".preinit_array")]] void (*const kBeforeConstructors)() = before_constructors;
#endif

void add_common_options(Command app, ProcessOptions& options, const std::vector<const char*>& parameters) {
  app.option("--config", options.config, "parameters of this component (YAML); default: the shipped ones");
  app.text_flag("--help-config", fmt::format("{}", fmt::join(parameters, "\n\n")),
                "print every parameter with its default, range and meaning: the shipped file");
  app.option("--deployment,--topology", options.deployment,
             "topology: domain, hosts, transports, cell (YAML)");
  app.text_flag("--help-deployment", kTopologyKeys, "print every key of a topology with range and meaning");
  app.text_flag("--help-cell", fmt::format("{}\n\n{}", kCellKeys, kArmKeys),
                "print every key of cell and arm files with range and meaning");
  app.option(
      "--name", options.name,
      "which of the topology's processes this is, if there are several of this component; default: the "
      "component's name");
  app.option("--domain", options.domain, "DDS domain, instead of the topology's").between(0, 232);
  app.option("--host", options.host,
             "which of the topology's hosts this is; default: its only one, or the one whose interfaces "
             "this machine has");
  app.option("--log-level", options.log_level, "trace, debug, info, warning, error or off")
      .one_of({"trace", "debug", "info", "warning", "error", "off"});
  app.flag("--check", options.check, "validate configuration, files and devices, then exit");
  app.option("--state-dir", options.state_dir,
             "folder for what outlives the process (the stop in force); "
             "default: $PHANTOM_STATE_DIR, or the one place of this host: /var/lib/phantom/stops where the "
             "packages are installed, else /var/tmp/phantom");
  app.option("--report-dir", options.report_dir, "folder for the files that this session leaves behind");
}

int fail(const ProcessOptions& options, int code, const std::string& what) {
  print_line(options.component + ": " + what);
  return code;
}

int ended_with(const ProcessOptions& options, const std::function<int()>& run) {
  try {
    return run();
  } catch (const ConfigError& problem) {
    return fail(options, kExitUsage, problem.what());
  } catch (const MissingError& problem) {
    return fail(options, kExitMissing, problem.what());
  } catch (const std::exception& problem) {
    return fail(options, kExitFailed, problem.what());
  }
}

// Applies what the topology says of this process: parameters unless --config names others, and arguments
// ahead of those of the command line, unless that asks for something by a subcommand. What is wrong with the
// topology is told by whoever needs it: a component by its own load_deployment().
void apply_entry(CommandLine& line, ProcessOptions& options, int argc, const char* const* argv) {
  std::optional<DeployedProcess> own;
  try {
    own = load_deployment(options).own;
  } catch (const std::exception&) {
    return;
  }
  if (!own || own->component != options.component) {
    if (options.name.empty()) return;
    throw ConfigError("--name " + options.name + ": " + options.deployment.string() + " has no " +
                      options.component + " of that name here; allowed: a name that it has, or none");
  }
  if (options.config.empty()) options.config = own->config;
  if (own->arguments.empty() || line.has_subcommand()) return;
  try {
    line.parse_after(own->arguments, argc, argv);
  } catch (const ConfigError& problem) {
    throw ConfigError(own->place + ".arguments: " + problem.what());
  }
}

}  // namespace

int process_main(int argc, char** argv, const ProcessDescription& description) {
  install_signal_handlers();
  leave_last_words(description.name);
  ProcessOptions options;
  options.component = description.name;
  CommandLine line(description.name, description.summary, std::string("phantom ") + core::version());
  add_common_options(line.root(), options, description.parameters);
  if (description.add_options) description.add_options(line.root());
  line.root().details(
      description.details +
      "\nExit codes: 0 done, 1 failed while running, 2 wrong arguments or configuration, 3 a needed "
      "device, file "
      "or peer is missing.");
  if (const auto wrong = line.parse(argc, argv)) return *wrong ? kExitUsage : kExitDone;
  options.deployment_named = !options.deployment.empty();
  if (!options.deployment_named) options.deployment = share_path("deploy/topologies/single_host.yaml");
  const int code = ended_with(options, [&] {
    std::error_code unreadable;  // as where a folder on the way may not be entered
    if (options.deployment_named && !std::filesystem::exists(options.deployment, unreadable))
      throw core::MissingError("--deployment " + options.deployment.string() + ": there is no such file");
    apply_entry(line, options, argc, argv);
    if (options.config.empty()) options.config = share_path("config/" + description.name + ".yaml");
    begin_log(options.component, options.log_level);
    signals_started();
    return description.run(options);
  });
  finish_log();
  return code;
}

}  // namespace phantom::runtime
