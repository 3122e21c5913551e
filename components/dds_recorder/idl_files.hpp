#pragma once

#include <array>

namespace phantom::dds_recorder {

struct IdlFile {
  const char* name;
  const char* text;
};

/// The unchanged files of idl/; embed.cmake generates this.
extern const std::array<IdlFile, 6> kIdlFiles;

}  // namespace phantom::dds_recorder
