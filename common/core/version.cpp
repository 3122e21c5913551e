#include "common/core/version.hpp"

namespace phantom::core {

const char* version() noexcept { return PHANTOM_VERSION; }

}  // namespace phantom::core
