#pragma once

// Private to the importer: what PLY and OBJ files consist of, and our own readers of both. assimp drops or
// moves parts of valid ones in silence.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "common/geometry/mesh/mesh_io.hpp"

namespace phantom::geometry::detail {

/// Why a file is not read, without the file's name.
struct UnreadableMesh : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Vertices in the file's units and polygons of three and more corners.
struct Polygons {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::uint32_t> corners;  ///< of all faces, one after the other: indices of vertices
  std::vector<std::uint64_t> ends;     ///< of each face: one past its last corner
  std::vector<std::string> notes;      ///< what was left out, one sentence each

  void add_face(std::span<const std::uint32_t> face) {
    corners.insert(corners.end(), face.begin(), face.end());
    ends.push_back(corners.size());
  }
};

/// Takes the first line off `rest`; lines end with \n, \r\n or \r.
inline std::string_view take_line(std::string_view& rest) {
  const std::size_t end = std::min(rest.find_first_of("\r\n"), rest.size());
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end);
  if (rest.starts_with("\r\n")) rest.remove_prefix(1);
  if (!rest.empty()) rest.remove_prefix(1);
  return line;
}

/// Takes the first word off a line; empty: there is none.
inline std::string_view take_word(std::string_view& rest) {
  constexpr std::string_view kBlank = " \t\v\f";
  rest.remove_prefix(std::min(rest.find_first_not_of(kBlank), rest.size()));
  const std::string_view word = rest.substr(0, rest.find_first_of(kBlank));
  rest.remove_prefix(word.size());
  return word;
}

/// Reads a PLY file of any kind (text, little or big endian; G. Turk, 1994): any order of elements, any
/// numeric types, further elements and properties passed over, triangle strips. Throws UnreadableMesh where
/// the content is not what the head declares.
Polygons read_ply(std::string_view bytes);

/// Reads the polygons of an OBJ file (Wavefront, Advanced Visualizer, appendix B1): indices from either end,
/// continued lines, faces before their vertices. Lines and points are passed over; curves and surfaces are
/// noted. Throws UnreadableMesh, with the line.
Polygons read_obj(std::string_view text);

/// Cuts a polygon into triangles, also one that is not convex: it is seen along its normal, and ears are cut
/// off it. Returns corners − 2 triangles of indices of `polygon`, each turned as the polygon is.
std::vector<std::array<std::uint32_t, 3>> triangulated(std::span<const Eigen::Vector3d> polygon);

/// Reads a PLY or OBJ file as load_mesh() describes. On failure returns false with the reason in `problem`.
/// May throw std::bad_alloc.
bool import_polygons(const std::filesystem::path& path, const MeshImportOptions& options, LoadedMesh& mesh,
                     std::string& problem);

}  // namespace phantom::geometry::detail
