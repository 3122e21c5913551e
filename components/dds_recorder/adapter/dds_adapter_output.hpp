#pragma once

#include "common/core/network.hpp"
#include "components/dds_recorder/replay.hpp"

namespace phantom::dds_recorder {

/// Carries out `dds_recorder replay`: opens the files, publishes their samples, logs the result. Returns the
/// exit code. Throws ConfigError, DdsError, and MissingError, also for a topic that has another writer now if
/// the request does not allow that (exit code 3).
int run_replay(const ReplayRequest& request, const core::NetworkOptions& network);

}  // namespace phantom::dds_recorder
