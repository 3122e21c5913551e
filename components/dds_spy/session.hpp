#pragma once

#include <iosfwd>

#include "common/core/network.hpp"
#include "components/dds_spy/config.hpp"
#include "components/dds_spy/request.hpp"

namespace phantom::dds_spy {

/// Carries out the request until it is complete, its time is over or a stop is requested. Prints the result
/// on `out`, and remarks to the log. Returns the exit code: kExitMissing if there is no participant, or no
/// sample of what was to be shown or measured.
int run(const Request& request, const Config& config, const core::NetworkOptions& network, std::ostream& out);

}  // namespace phantom::dds_spy
