#pragma once

#include <iosfwd>

#include "common/core/network.hpp"
#include "components/dds_spy/config.hpp"
#include "components/dds_spy/request.hpp"

namespace phantom::dds_spy {

/// Does what was asked until it is done, its time is over or a stop is requested; prints on `out`, remarks to
/// the log. Returns the exit code: kExitMissing if nobody is there, or nothing came of what was to be shown
/// or measured.
int run(const Request& request, const Config& config, const core::NetworkOptions& network, std::ostream& out);

}  // namespace phantom::dds_spy
