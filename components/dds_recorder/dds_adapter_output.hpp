#pragma once

#include "common/core/network.hpp"
#include "components/dds_recorder/replay.hpp"

namespace phantom::dds_recorder {

/// `dds_recorder replay`: opens the files, publishes them, tells how it went. Returns the exit code: 3 if a
/// topic has another writer now and the request does not allow that. Throws ConfigError, MissingError,
/// DdsError.
int run_replay(const ReplayRequest& request, const core::NetworkOptions& network);

}  // namespace phantom::dds_recorder
