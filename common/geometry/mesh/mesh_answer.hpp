#pragma once

// Private to this library and to its importer: how the importer sends its result through a pipe.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "common/geometry/mesh/mesh_io.hpp"

namespace phantom::geometry::detail {

/// Encodes a result as bytes, except for the mesh itself: a header with counts, then a text (the format's
/// name and the notes, one line each; or the reason of a failure). The bytes of mesh_bytes() follow; they are
/// sent from where they are, without a copy. The encoding is only valid between two programs of one build on
/// one machine.
std::vector<std::uint8_t> answer_head(const LoadedMesh& mesh);
/// Encodes that there is no mesh, and why; nothing follows.
std::vector<std::uint8_t> refusal(std::string_view problem);

/// Returns the greatest number of bytes that an answer within the options' limits has.
std::size_t max_answer_bytes(const MeshImportOptions& options);

/// Decodes a complete answer or refusal. Nothing in the bytes is trusted: counts must account for every byte
/// and keep to the limits, indices must lie within the vertices, coordinates and scale must be finite;
/// otherwise the result is kInternal. A refusal by the importer gives kInvalidArgument. Messages do not
/// contain the file's name.
core::Expected<LoadedMesh> mesh_of_answer(std::span<const std::uint8_t> bytes,
                                          const MeshImportOptions& options);

}  // namespace phantom::geometry::detail
