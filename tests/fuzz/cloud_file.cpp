// Files of clouds: whatever their octets are, they are read or refused with a reason, and no more points come
// of them than they can hold.

#include "components/workspace_camera/cloud_file.hpp"

#include <cstdint>
#include <cstdlib>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace phantom;
  const auto cloud = workspace_camera::read_cloud({reinterpret_cast<const char*>(bytes), size});
  if (!cloud) {
    if (cloud.status().message().empty()) std::abort();
    return 0;
  }
  // A point needs three numbers, of a digit and what parts it from the next, or of four octets.
  if (cloud->empty() || cloud->size() % 3 != 0 || 2 * cloud->size() > 3 * size) std::abort();
  return 0;
}
