#pragma once

namespace phantom::dds {

/// Lets what Fast DDS logs go to our log, from now on: its own way to standard error would wait for who reads
/// that, also at the process's end. Thread-safe; further calls do nothing.
void take_over_fast_dds_log();

}  // namespace phantom::dds
