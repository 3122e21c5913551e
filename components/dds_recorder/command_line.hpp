#pragma once

#include <memory>

#include "common/runtime/command_line.hpp"
#include "common/runtime/process.hpp"

namespace phantom::dds_recorder {

/// The command line's subcommands: record, trigger, replay, info, check, convert.
class CommandLine {
 public:
  CommandLine();
  ~CommandLine();
  void add_to(runtime::Command app);
  /// Carries out the subcommand. Returns the exit code; throws as process_main expects.
  int run(const runtime::ProcessOptions& options);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::dds_recorder
