#pragma once

namespace phantom::dds {

/// Redirects Fast DDS's log to the project's log. Fast DDS's own output to standard error would wait for the
/// reader of that stream, even at the process's end. While the process ends, entries are dropped.
/// Thread-safe; further calls do nothing.
void take_over_fast_dds_log();

}  // namespace phantom::dds
