#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace phantom::runtime {

class Fields;

/// Another arm of the cell, in a session of its own.
struct OtherArmConfig {
  std::string arm;
  std::string partition;  ///< DDS partition of its slave_state; empty: the default one
};
inline constexpr std::size_t kMaxOtherArms = 4;
/// Stands for the first of them where samples name an object; those of further ones follow. Objects of a cell
/// have the low numbers.
inline constexpr std::uint16_t kFirstOtherArmId = 65'000;

/// Refuses a text of the key `partition` that is no name of a DDS partition; empty is one. Throws
/// core::ConfigError.
void check_partition(const Fields& fields, const std::string& partition);
/// Reads the list `other_arms`; empty if the file has none. Throws core::ConfigError.
std::vector<OtherArmConfig> read_other_arms(const Fields& file);

}  // namespace phantom::runtime
