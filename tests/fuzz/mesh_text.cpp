// Heads of mesh files, in which units and up-axes are looked for.

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "common/geometry/mesh/mesh_units.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace phantom::geometry;
  const std::string_view head(reinterpret_cast<const char*>(bytes), size);
  for (const char* format :
       {"Collada", "Additive", "3mf", "Open Game Engine Exchange", "Drawing Interchange", ""}) {
    const DeclaredFrame frame = declared_in_text(format, head);
    if (frame.scale && !(std::isfinite(*frame.scale) && *frame.scale > 0)) std::abort();
  }
  return 0;
}
