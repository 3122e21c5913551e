#pragma once

namespace phantom::core {

/// Returns the project's version as its CMakeLists.txt states it: "0.1.0". Any thread.
const char* version() noexcept;

}  // namespace phantom::core
