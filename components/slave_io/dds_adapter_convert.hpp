#pragma once

#include <cstddef>

#include "components/slave_io/dds_adapter.hpp"
#include "phantom_idl/teleoperation.h"

namespace phantom::slave_io {

/// Why a sample cannot be used, in words for the log; null if it can. Order and source are checked apart
/// (dds::SourceGuard).
const char* refusal(const msg::MasterState& master, const Expectations& expected) noexcept;
/// `own_session`: whose slave_states its echo must name to count as an answer.
MasterSample to_sample(const msg::MasterState& master, core::Nanoseconds received_ns,
                       std::uint64_t own_session) noexcept;

/// Everything of a slave_state but its stamp.
msg::SlaveState to_message(const SlaveReport& report, std::size_t joint_count);

}  // namespace phantom::slave_io
