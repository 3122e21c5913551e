#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/experiments/experiment.hpp"

namespace phantom::experiments {
namespace {

const std::map<std::string, Sabotage> kSabotages{{"constant-mu", Sabotage::kConstantMu},
                                                 {"layers-off-by-one", Sabotage::kLayersOffByOne},
                                                 {"ignored-speed", Sabotage::kIgnoredSpeed},
                                                 {"grown-bodies", Sabotage::kGrownBodies},
                                                 {"ignored-offset", Sabotage::kIgnoredOffset},
                                                 {"cubic-clusters", Sabotage::kCubicClusters},
                                                 {"cubic-elements", Sabotage::kCubicElements},
                                                 {"unit-elements", Sabotage::kUnitElements},
                                                 {"latest-object", Sabotage::kLatestObject},
                                                 {"no-memory", Sabotage::kNoMemory},
                                                 {"unfaced-filter", Sabotage::kUnfacedFilter},
                                                 {"weightless", Sabotage::kWeightless},
                                                 {"silence", Sabotage::kSilence},
                                                 {"unit-ratio", Sabotage::kUnitRatio}};

void list(bool as_json) {
  nlohmann::json all = nlohmann::json::array();
  for (const Experiment& experiment : experiments()) {
    nlohmann::json fails_under = nlohmann::json::array();
    for (const auto& [name, sabotage] : kSabotages) {
      const auto& breaks = experiment.fails_under;
      if (std::find(breaks.begin(), breaks.end(), sabotage) != breaks.end()) fails_under.push_back(name);
    }
    all.push_back({{"id", experiment.id},
                   {"title", experiment.title},
                   {"source", experiment.source},
                   {"statement", experiment.statement},
                   {"fails_under", fails_under}});
    if (as_json) continue;
    std::printf("%-15s %s; fails under", experiment.id.c_str(), experiment.source.c_str());
    for (const auto& law : fails_under) std::printf(" %s", law.get<std::string>().c_str());
    std::printf("\n");
  }
  if (as_json) std::cout << all.dump(1) << '\n';
}

/// Returns why nothing can be written into the folder, which is made if need be; "": it can.
std::string problem_of(const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return "cannot be made: " + failed.message();
  const std::filesystem::path probe = folder / ".written_to_try";
  const bool written = static_cast<bool>(std::ofstream(probe) << "" << std::flush);
  std::filesystem::remove(probe, failed);
  return written ? "" : "is read-only";
}

/// Whether all checks passed. An experiment that cannot run has not.
bool run(const Experiment& experiment, const Settings& settings) {
  const auto start = std::chrono::steady_clock::now();
  Report report(settings.out / experiment.id);
  try {
    std::filesystem::create_directories(report.folder());
    experiment.run(report, settings);
    report.write();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "experiments: %s: %s\n", experiment.id.c_str(), error.what());
    return false;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  std::printf("%-15s %s  %zu checks, %.1f s\n", experiment.id.c_str(), report.passed() ? "ok    " : "FAILED",
              report.checks().size() + report.printed().size(), took.count());
  for (const Check& check : report.failed()) {
    std::printf("    %s: %.6g %s, must lie in %.6g … %.6g\n", check.what.c_str(), check.value,
                check.unit.c_str(), check.low, check.high);
  }
  std::fflush(stdout);
  return report.passed();
}

}  // namespace
}  // namespace phantom::experiments

int main(int argc, char** argv) {
  using namespace phantom::experiments;
  CLI::App app(
      "Runs the thesis's experiments through the product's libraries and executables. "
      "Each leaves its data (CSV), what is to be drawn (plots.json) and its checks (checks.json) "
      "in OUT/NAME. scripts/experiments also draws and makes a page. Exit code: "
      "0 all checks passed, 1 one did not, 2 wrong arguments.");
  Settings settings{.out = "experiments", .source_dir = PHANTOM_SOURCE_DIR, .bin_dir = PHANTOM_BIN_DIR};
  bool list_only = false, as_json = false;
  std::vector<std::string> names, known;
  for (const Experiment& experiment : experiments()) known.push_back(experiment.id);
  app.add_option("NAME", names, "experiments to run; default: all")->check(CLI::IsMember(known));
  app.add_option("--out", settings.out, "folder for the results")->capture_default_str();
  app.add_flag("--fast", settings.fast, "coarser where that saves time; the same checks");
  app.add_option("--break", settings.sabotage, "break a law of the physics on purpose: checks must then fail")
      ->transform(CLI::CheckedTransformer(kSabotages));
  app.add_flag("--list", list_only,
               "list the experiments, and the broken laws under which they must fail, and do nothing");
  app.add_flag("--json", as_json, "with --list: for machines");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (list_only) {
    list(as_json);
    return 0;
  }
  if (const std::string problem = problem_of(settings.out); !problem.empty()) {
    std::fprintf(stderr, "experiments: --out: %s: %s; allowed: a folder that can be written\n",
                 settings.out.c_str(), problem.c_str());
    return 2;
  }
  // The product's importer of meshes stands beside its executables, not beside this one.
  setenv("PHANTOM_MESH_IMPORT", (settings.bin_dir / "../libexec/phantom/phantom_mesh_import").c_str(), 0);
  bool all_passed = true;
  for (const Experiment& experiment : experiments()) {
    if (!names.empty() && std::find(names.begin(), names.end(), experiment.id) == names.end()) continue;
    if (!run(experiment, settings)) all_passed = false;
  }
  return all_passed ? 0 : 1;
}
