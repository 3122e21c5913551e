#pragma once

#include "common/core/clock.hpp"
#include "common/dds/admission/guid_prefix.hpp"

namespace phantom::dds {

inline constexpr core::Nanoseconds kS = core::kNsPerSecond;

/// Participants that differ in their last byte alone, in that order.
inline GuidPrefix prefix(std::uint8_t last) {
  GuidPrefix made{};
  made.back() = last;
  return made;
}

}  // namespace phantom::dds
