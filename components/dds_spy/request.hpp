#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/runtime/process/command_line.hpp"
#include "components/dds_spy/dds_adapter.hpp"

namespace phantom::dds_spy {

enum class Command { kLive, kTopology, kEcho, kRates, kLatency, kQos, kEvents, kTypes };

/// The command line's arguments, unchecked.
struct Request {
  Command command = Command::kLive;
  std::vector<std::string> topics, instances, writers, kinds;
  std::optional<double> seconds;  ///< 0: until Ctrl-C; none: the command's default
  double interval_s = 0.0;        ///< hz, latency: period of interim reports; 0: at the end only
  double every_s = 0.0;           ///< echo: at most one sample per writer and instance in this time
  std::uint64_t count = 0;        ///< echo: ends after this number of samples; 0: no limit
  bool json = false, reliable = false, history = false, ask_types = false, all_octets = false;
};

/// Declares the subcommands and options on `app`.
void add_options(runtime::Command app, Request& request);
/// Returns the text that --help shows after the options.
std::string help_text();
/// Returns what to read for the request.
Reading reading_of(const Request& request);

}  // namespace phantom::dds_spy
