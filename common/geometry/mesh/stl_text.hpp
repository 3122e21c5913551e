#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/geometry/mesh/stl.hpp"

namespace phantom::geometry {

/// Number of bytes at an STL's beginning that looks_like_text_stl() asks for.
inline constexpr std::size_t kStlLookBytes = 1024;

/// Returns whether a file that begins with these bytes is a text STL: "solid" after blanks or a byte order
/// mark, and no byte that a text does not have. The header of a binary STL may begin with "solid", too; the
/// binary numbers behind it tell.
bool looks_like_text_stl(std::span<const std::uint8_t> head);

/// A text STL as read, in the file's own units and axes.
struct TextStl {
  StlMesh mesh;
  std::vector<std::string> notes;  ///< what was passed over, or is missing at the end: one sentence each
  std::string problem;             ///< with its line; empty: the text is one
  bool too_many = false;           ///< it has more than the most triangles; what follows them was not read
};

/// Reads all solids of a text STL as one mesh and joins equal corners. Key words may be in capitals, split
/// ("end facet") and separated by any blanks; a solid may have no facets, any name or none; polygons become
/// fans of triangles. Ignores normals. A text that ends early gives what was whole, and a note. Not real-time
/// safe.
TextStl read_text_stl(std::string_view text, std::uint32_t max_triangles);

}  // namespace phantom::geometry
