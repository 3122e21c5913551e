#pragma once

#include <memory>

#include "common/runtime/process.hpp"

namespace CLI {
class App;
}

namespace phantom::dds_recorder {

/// The subcommands: record, trigger, replay, info, check, convert.
class CommandLine {
 public:
  CommandLine();
  ~CommandLine();
  void add_to(CLI::App& app);
  /// Carries out what was asked for. Returns the exit code; throws as process_main expects.
  int run(const runtime::ProcessOptions& options);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::dds_recorder
