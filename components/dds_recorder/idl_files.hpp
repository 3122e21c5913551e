#pragma once

#include <array>

namespace phantom::dds_recorder {

struct IdlFile {
  const char* name;
  const char* text;
};

/// The files of idl/, as they are; made by embed.cmake.
extern const std::array<IdlFile, 5> kIdlFiles;

}  // namespace phantom::dds_recorder
